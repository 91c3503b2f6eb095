"""Cells: their scenarios are those of --set, and wrong values are named."""

from __future__ import annotations

import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.experiments.studies import trade_cells
from sinssim.experiments.studies.trade_cells import cells_of, command_of, digest_of, place_name
from sinssim.experiments.studies.trade_schema import Axis, TradeStudy
from sinssim.scenario.load import load_scenario
from tests.experiments.studies.trade_examples import AIDED, BIAS, GRADE, study
from tests.simulation.test_guided_passes import plan


def test_a_cell_is_its_command(tmp_path: Path) -> None:
    """The scenario of a cell is the one that its command loads."""
    axes = (
        {"key": GRADE, "values": ("tactical", "laser-standard")},
        {"key": "imu.lever_arm_m", "values": ([1.0, 0, 2.0],)},
    )
    made = study(tmp_path, axes=axes, set=("seed=9",), times_s=(30.0,), require=("r95(40 s) <= 1 km",))
    cells = cells_of(made)
    assert [cell.place for cell in cells] == [(0, 0), (1, 0)]
    for cell in cells:
        program, kind, scenario, *options = shlex.split(command_of(made, cell))
        assert (program, kind) == ("sinssim", "budget")
        assert options[-4:] == ["--at", "30", "--require", "r95(40 s) <= 1 km"]
        settings = [options[k + 1] for k, word in enumerate(options) if word == "--set"]
        assert load_scenario(scenario, settings) == cell.scenario
        assert cell.scenario is not None
        assert cell.scenario.seed == 9
        assert cell.scenario.imu.lever_arm_m == (1.0, 0, 2.0)
    assert place_name(made, cells[0].place) == "grade tactical, lever arm [1, 0, 2]"


def test_digests(tmp_path: Path) -> None:
    """They depend on what determines the numbers, and on nothing else."""
    made = study(tmp_path)
    first, second, *_ = cells_of(made)
    digest = first.digest
    assert digest != second.digest
    assert digest_of(study(tmp_path, name="other", description="x"), first.scenario) == digest
    assert digest_of(study(tmp_path, times_s=(3.0,)), first.scenario) != digest
    assert digest_of(study(tmp_path, inertial=True), first.scenario) != digest
    few, many = (study(tmp_path, cell="ensemble", runs=n) for n in (10, 20))
    assert cells_of(few)[0].digest == cells_of(many)[0].digest != digest
    required = study(tmp_path, cell="ensemble", runs=10, require=("r95(end) <= 1 m",))
    assert digest_of(required, first.scenario) == digest_of(few, first.scenario)


def test_the_times_of_a_flight_by_its_navigator_are_those_of_the_flight_by_the_truth() -> None:
    """Beyond the estimate of the plan the flight is flown, by the truth: every run has a duration of its own."""
    scenario, lasts = plan(), dict[str, float]()
    with pytest.raises(InputError, match=r"t = 60 s lies outside the run, which lasts 54\.9 s"):
        trade_cells._check_times(SimpleNamespace(instants=(60.0,), requirements=()), scenario, lasts)  # type: ignore[arg-type]
    assert list(lasts.values()) == pytest.approx([54.9], abs=0.5)


def test_a_changed_track_is_another_cell(tmp_path: Path) -> None:
    """The scenario names its file alone; a study that goes on with other fixes must not keep the cells of the old."""
    way, digests = tmp_path / "way.csv", list[str]()
    contents = 'name = "driven"\nimu = { grade = "tactical", rate_hz = 10.0 }\n' \
               f'[track]\nfile = "{way}"\nvehicle = "land"\n'  # fmt: skip
    for step in (1e-4, 2e-4):
        rows = "".join(f"{t},{50.0 + step * t:.6f},10.0,100.0\n" for t in range(61))
        way.write_text(f"time_s,latitude_deg,longitude_deg,height_m\n{rows}", encoding="utf-8")
        digests.append(cells_of(study(tmp_path, contents))[0].digest)
    assert digests[0] != digests[1]


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        (({"key": "imu.grde", "values": ("tactical", "ideal")},), ["axes.1 (imu.grde)", "Did you mean 'imu.grade'"]),
        (
            ({"key": GRADE, "values": ("ideal", "tactical")}, {"key": BIAS, "values": (0.1, -1.0)}),
            [f"axes.2 ({BIAS}): the value −1", "cell 2 (grade ideal, gyro bias σ −1 deg/h) and 1 more", "at least 0"],
        ),
        (
            ({"key": GRADE, "values": ("nix", "tactical")}, {"key": BIAS, "values": (0.1, -1.0)}),
            ["2 values of the axes", "the value nix", "unknown IMU grade 'nix'", "the value −1"],
        ),
        (({"key": GRADE, "values": ("tactical", 3)},), ["the value 3", "cell 2", "text in quotes"]),
        (({"key": "parked.duration_s", "values": (10.0, 1e99)},), ["the value 1e+99", "at most"]),
        (({"key": "flight.legs.2.altitude_m", "values": (1.0,)},), ["flight.legs.2.altitude_m"]),
    ],
)
def test_wrong_values_are_named(tmp_path: Path, axes: tuple[dict[str, Any], ...], said: list[str]) -> None:
    with pytest.raises(InputError) as error:
        cells_of(study(tmp_path, axes=axes))
    for text in said:
        assert text in str(error.value)


def test_a_wrong_key_is_named_once(tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        cells_of(
            study(tmp_path, axes=({"key": "imu.grde", "values": ("a", "b", "c")}, {"key": BIAS, "values": (1, 2)}))
        )
    assert str(error.value).count("imu.grde'") == 1
    assert BIAS not in str(error.value)


def test_values_that_do_not_go_together_are_the_cells_mistake(tmp_path: Path) -> None:
    """A filter needs aiding sensors; each value is fine with another one of the other axis."""
    axes = (
        {"key": "filter.alignment", "values": ("at-rest", "in-motion")},
        {"key": "filter.alignment_s", "values": (20.0, 30.0)},
    )
    with pytest.raises(InputError, match="the value in-motion"):  # wrong in all of its cells
        cells_of(study(tmp_path, AIDED, axes))
    mixed = ({"key": "navigation.frame", "values": ("level", "inertial")},
             {"key": "navigation.curvature", "values": ("exact", "spherical")})  # fmt: skip
    cells = cells_of(study(tmp_path, AIDED, mixed))
    assert [bool(cell.failure) for cell in cells] == [False, False, False, True]
    assert "inertial" in cells[3].failure
    assert cells[3].scenario is None


def test_a_fixed_key_that_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"Did you mean 'imu\.rate_hz'"):
        cells_of(study(tmp_path, set=("imu.rte_hz=3.0",)))


@pytest.mark.parametrize("kind", ["budget", "ensemble"])
def test_times_outside_the_run_are_refused_beforehand(tmp_path: Path, kind: str) -> None:
    """They have nothing to do with the axes, so that none is named; the run lasts 60 s."""
    made = study(tmp_path, cell=kind, require=("r95(end) <= 1 m", "r95(2 min) <= 1 km"))
    with pytest.raises(InputError) as error:
        cells_of(made)
    assert str(error.value) == (
        "the study small: requirement 'r95(2 min) <= 1 km': 120 s lies outside the run, which lasts 60 s; give a time "
        "up to this, or (end)."
    )
    with pytest.raises(InputError, match=r"the study small: t = 60\.5 s lies outside the run, which lasts 60 s; give"):
        cells_of(study(tmp_path, cell=kind, times_s=(60.5, 7.0)))
    assert len(cells_of(study(tmp_path, cell=kind, times_s=(60.0,), require=("r95(60 s) <= 1 m",)))) == 6


def test_a_time_outside_the_run_of_some_cells_is_their_mistake(tmp_path: Path) -> None:
    lengths = {"key": "parked.duration_s", "values": (50.0, 70.0)}
    long, wrong = {"key": "parked.duration_s", "values": (80.0, 70.0)}, {"key": GRADE, "values": ("ideal", "tactical")}
    with pytest.raises(InputError, match=r"the value 50 cannot be used .* 65 s lies outside the run, which lasts 50 s"):
        cells_of(study(tmp_path, axes=(wrong, lengths), times_s=(65.0,)))
    assert not any(cell.failure for cell in cells_of(study(tmp_path, axes=(wrong, long), times_s=(65.0,))))


def test_the_duration_of_a_flight_is_that_of_the_flight_and_not_its_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    """Flown once for all cells, and only for times beyond the estimate of 5064 s."""
    flown = []

    def motion(scenario: Any, *, errors: str) -> Any:
        assert errors == "none"
        flown.append(scenario)
        return SimpleNamespace(start=2.0, end=5101.0)

    monkeypatch.setattr(trade_cells, "true_motion", motion)
    axis = Axis(key=GRADE, values=("laser-navigation", "laser-standard"))
    for time in (5000.0, 5099.0):
        made = TradeStudy(name="f", scenario="first_flight", axes=(axis,), require=(f"r95({time} s) <= 1 km",))
        assert len(cells_of(made)) == 2
    assert len(flown) == 1
    made = TradeStudy(name="f", scenario="first_flight", axes=(axis,), require=("r95(5100 s) <= 1 km",))
    with pytest.raises(InputError, match="5100 s lies outside the run, which lasts 5099 s"):
        cells_of(made)
