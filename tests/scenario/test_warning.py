"""Everything that flies a plan warns of the limits of its aircraft, once."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import sinssim
from sinssim.cli.app import main
from sinssim.experiments.studies.study_schema import Study
from sinssim.experiments.studies.trade_schema import Axis, TradeStudy
from sinssim.scenario.planned_limits import findings

STEEP = """\
name = "steep"
[flight]
aircraft = "737"
start = { on = "air", latitude_deg = 48.0, longitude_deg = 11.0, altitude_m = 6000.0, airspeed_kt = 280.0 }
[[flight.legs]]
type = "descend"
altitude_m = 5980.0
vertical_speed_mps = 20.0
[imu]
grade = "tactical"
rate_hz = 50.0
[[ensemble.vary]]
key = "flight.legs.1.altitude_m"
type = "uniform"
low = 5970.0
high = 5990.0
"""
"""A descent that is steeper than the aircraft descends with idle engines; each run of an ensemble has its own."""


@pytest.fixture(scope="module")
def steep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("plans") / "steep.toml"
    file.write_text(STEEP)
    return file


def said(call: Callable[[], Any]) -> list[str]:
    """Return the warnings of a call, and check that each is given at its place here."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    found = [one for one in caught if issubclass(one.category, sinssim.SinssimWarning)]
    assert {one.filename for one in found} <= {__file__}
    return [str(one.message) for one in found]


def test_the_library_warns_once(steep: Path) -> None:
    """Also for many runs of a plan, and for the cells of a study."""
    plan = sinssim.load_scenario(steep)
    (one,) = (finding.text for finding in findings(plan))
    assert "with idle engines the 737 descends at" in one
    assert said(lambda: sinssim.fly(plan)) == [one]
    assert said(lambda: sinssim.ensemble(plan.model_copy(update={"ensemble": None}), 3, threads=1)) == [one]
    cells = Axis(key="imu.grade", values=("tactical", "laser-standard"))
    trade = TradeStudy(name="trade", scenario=str(steep), draw=("r95(end)",), axes=(cells,))
    assert said(lambda: sinssim.compare(trade)) == [one]


@pytest.mark.slow
def test_runs_budgets_studies_and_varied_plans_warn_once(steep: Path) -> None:
    """The runs of the ensemble descend to different heights."""
    part = {"title": "p", "rates_hz": (50.0,), "motions": ({"scenario": str(steep)},), "algorithms": ("quaternion",)}
    (one,) = (finding.text for finding in findings(sinssim.load_scenario(steep)))
    plan = sinssim.load_scenario(steep)
    assert said(lambda: sinssim.run(plan)) == [one]
    assert said(lambda: sinssim.budget(plan)) == [one]
    assert said(lambda: sinssim.ensemble(plan, 2, threads=1)) == [one]
    assert set(said(lambda: sinssim.compare(Study.model_validate({"name": "s", "parts": (part,)})))) == {one}


@pytest.mark.parametrize("command", ["budget", "ensemble", "run"])
def test_commands_warn_by_a_line(
    command: str, steep: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Once, and not with --quiet. What follows the flight is left out."""
    (one,) = (finding.text for finding in findings(sinssim.load_scenario(steep)))

    def stop(*_: object, **__: object) -> None:
        raise sinssim.RunError("the flight began")

    monkeypatch.setattr("sinssim.truth.flight.flight.cached_flight", stop)
    for quiet, lines in (((), [f"WARNING: {one}"]), (("--quiet",), [])):
        with pytest.raises(SystemExit):
            main([command, str(steep), "-o", str(tmp_path / "out"), *quiet])
        *before, last = capsys.readouterr().err.strip().splitlines()
        assert "the flight began" in last
        assert before == lines
