"""Trade studies from end to end: the numbers of their commands, resumed bit for bit, failures as results."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.cli import app as cli
from sinssim.errors import InputError, RunError
from sinssim.experiments.ensembles import ensemble_plan
from sinssim.experiments.studies import trade_run as running
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_run import trade
from sinssim.experiments.studies.trade_schema import TradeStudy
from sinssim.units import DEG_H
from tests.experiments.studies.trade_examples import ACCEL, AIDED, AXES, BIAS, GRADE, study
from tests.slow import slow

TIMES: dict[str, Any] = {"times_s": (30.0,), "require": ("r95(40 s) <= 8 m", "heading(end) <= 1 deg")}


@pytest.fixture(autouse=True)
def _without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """The pictures and the recording of a study have tests of their own; here they would only take time."""
    for name in ("figures.figure_of", "figures.save", "rerun_exhibits.record"):
        monkeypatch.setattr(f"sinssim.recording.{name}", lambda *_, **__: None)


def numbers(result: TradeResult) -> dict[int, dict[str, float]]:
    """Return all numbers of all cells, in which NaN is None."""
    return {
        one.number: {k: None if np.isnan(v) else v for k, v in one.numbers.values.items()}  # type: ignore[misc]
        for one in result.cells
        if one.numbers is not None
    }


def answer(capsys: pytest.CaptureFixture[str], command: str, folder: Path) -> dict[str, Any]:
    """Return what a cell's command prints with --json."""
    _, *words = shlex.split(command)
    with pytest.raises(SystemExit) as end:
        cli.main([*words, "--json", "-o", str(folder)])
    assert not end.value.code
    return dict(json.loads(capsys.readouterr().out))


def test_budgets_are_those_of_their_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every number of `sinssim budget`, bit for bit."""
    result = trade(study(tmp_path, axes=AXES[:1], **TIMES))
    assert not result.failures
    for number in (2,):
        found = result.cells[number - 1]
        own = answer(capsys, result.command(number), tmp_path / f"budget{number}")
        assert found.value("cep_end_m") == own["cep_m"]
        assert found.value("r95_end_m") == own["r95_m"]
        assert found.value("rate_end_nmi_h") == own["r95_over_time_nmi_per_h"]
        table = {row["time_s"]: row for row in own["table"]}
        for time, when in ((60.0, "end"), (30.0, "30s")):
            assert found.value(f"cep_{when}_m") == table[time]["cep_m"]
            assert found.value(f"r95_{when}_m") == table[time]["r95_m"]
            for kind in ("sigma", "mean"):
                for name, value in table[time][kind].items():
                    component, _, unit = name.rpartition("_")
                    assert found.value(f"{kind}_{component}_{when}_{unit}") == value
        assert found.numbers is not None
        judged = [(v.requirement, v.verdict == "met", v.value, v.limit, v.time_s) for v in found.numbers.verdicts]
        theirs = [(a["requirement"], a["met"], a["value"], a["limit"], a["time_s"]) for a in own["requirements"]]
        assert judged == theirs


def test_ensembles_are_those_of_their_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every number of `sinssim ensemble`, bit for bit."""
    result = trade(study(tmp_path, axes=AXES[:1], cell="ensemble", runs=20, require=TIMES["require"]), threads=1)
    assert not result.failures
    for number in (2,):
        found = result.cells[number - 1]
        own = answer(capsys, result.command(number), tmp_path / f"ensemble{number}")
        pairs = {
            "cep_end_m": own["final_horizontal_m"]["cep"],
            "r95_end_m": own["final_horizontal_m"]["r95"],
            "rate_end_nmi_h": own["rate_nmi_h"]["end"]["r95"],
            "rate_line_cep_nmi_h": own["rate_nmi_h"]["line"]["cep"],
            "rate_line_r95_nmi_h": own["rate_nmi_h"]["line"]["r95"],
        }
        for column, band in pairs.items():
            for key, ending in (("value", ""), ("low", "_low"), ("high", "_high")):
                assert band[key] in (found.value(column + ending), None), (column, key)  # None: infinite
        for theirs, ours in (("velocity_n_mps", "velocity_north_end_mps"), ("attitude_e_rad", "tilt_east_end_rad")):
            assert found.value(f"sigma_{ours}") == own["components"][theirs]["final_sigma"]
            assert found.value(f"mean_{ours}") == own["components"][theirs]["final_mean"]
        assert found.value("mean_heading_end_rad") == -own["components"]["attitude_d_rad"]["final_mean"]
        assert found.numbers is not None
        judged = [(v.requirement, v.verdict, v.value, v.limit, v.time_s) for v in found.numbers.verdicts]
        assert judged == [
            (a["requirement"], a["verdict"], a["value"], a["limit"], a["time_s"]) for a in own["requirements"]
        ]


def test_one_bias_alone_by_closed_form(tmp_path: Path) -> None:
    """A gyro bias alone: R95 ∝ bias, and R95 = 2.4477 R b (t − sin ω t / ω), Schuler's ω, to 1 % in ten minutes."""
    axes = ({"key": BIAS, "values": (0.01, 0.1, 1.0)},)
    start = "navigation.initial_error."
    fixed = ("imu.grade=ideal", "parked.duration_s=600.0", "parked.roll_deg=0.0", "navigation.vertical=baro-loop",
             f"{start}position_sigma_m=0.0", f"{start}tilt_sigma_arcmin=0.0")  # fmt: skip
    found = trade(study(tmp_path, axes=axes, set=fixed)).values("r95(end)")
    np.testing.assert_allclose(found / found[0], [1.0, 10.0, 100.0], rtol=1e-9)
    radius, omega, t = 6.378e6, np.sqrt(9.81 / 6.378e6), 600.0
    sigma = radius * 0.01 * DEG_H * (t - np.sin(omega * t) / omega)
    assert found[0] == pytest.approx(2.4477 * sigma, rel=0.01)


@pytest.mark.parametrize("n", [25, *slow(200)])
def test_budget_and_ensemble_agree(n: int, tmp_path: Path) -> None:
    """Of N runs, CEP within 4.5 standard errors, rms within 4.5 of σ/√(2N); 24 comparisons fail by chance once in 6000.

    The standard error of CEP of a circular normal distribution is √(p(1 − p)/N)/f = 0.5/√N/(0.589/σ).
    """
    axes = ({"key": GRADE, "values": ("laser-navigation", "laser-standard")}, {"key": ACCEL, "values": (20.0, 500.0)})
    fixed = ("parked.duration_s=300.0", "navigation.vertical=baro-loop", "parked.roll_deg=0.0")
    budgets = trade(study(tmp_path, axes=axes, set=fixed))
    runs = trade(study(tmp_path, axes=axes, set=fixed, cell="ensemble", runs=n), threads=1)
    cep = budgets.values("cep(end)")
    off = (runs.values("cep(end)") - cep) / (0.5 / np.sqrt(n) * cep / 1.1774 / 0.589)
    assert np.abs(off).max() < 4.5
    for name in ("velocity_north(end)", "velocity_east(end)", "tilt_north(end)", "tilt_east(end)", "heading(end)"):
        sigma = budgets.values(name)
        assert (np.abs(runs.values(name) / sigma - 1.0) * np.sqrt(2.0 * n)).max() < 4.5
    low, high = runs.band("heading(end)")
    assert (low < runs.values("heading(end)")).all()
    assert (runs.values("heading(end)") < high).all()


def test_resumed_bit_for_bit(tmp_path: Path) -> None:
    """An interrupted study keeps its finished cells; continued, it is the one that was not interrupted."""
    made, place = study(tmp_path, **TIMES), tmp_path / "out"
    whole = trade(made)

    def stop(text: str, fraction: float) -> None:
        if text.startswith("3/6"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as interrupt:
        trade(made, place, progress=stop)
    assert "3 of 6 cells are finished, in" in " ".join(interrupt.value.__notes__)
    left = json.loads((place / "results.json").read_text(encoding="utf-8"))
    assert (left["status"], left["finished"]) == ("interrupted", 3)
    assert [cell["status"] for cell in left["cells"]] == ["finished"] * 3 + ["open"] * 3
    assert "interrupted" in (place / "report.html").read_text(encoding="utf-8")
    with pytest.raises(InputError, match="--resume"):
        trade(made, place)
    resumed = trade(made, place, resume=True)
    assert resumed.computed == 3
    assert numbers(resumed) == numbers(whole)
    assert [one.numbers.verdicts for one in resumed.cells] == [one.numbers.verdicts for one in whole.cells]  # type: ignore[union-attr]
    again = trade(made, place, resume=True)
    assert again.computed == 0
    assert numbers(again) == numbers(whole)


def test_an_ensemble_is_continued_within_a_cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its finished groups of runs, here of 16, are kept, and more runs extend it."""
    monkeypatch.setattr(ensemble_plan, "_CHUNK", 16)
    axes = ({"key": BIAS, "values": (0.01, 0.1)},)
    made, place = study(tmp_path, axes=axes, cell="ensemble", runs=25), tmp_path / "out"
    whole = trade(made, threads=1)

    def stop(text: str, fraction: float) -> None:
        if "16/25" in text and text.startswith("1/2"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trade(made, place, progress=stop, threads=1)
    assert len(list(place.glob("cells/*/runs/*.parquet"))) >= 2
    resumed = trade(made, place, resume=True, threads=1)
    assert numbers(resumed) == numbers(whole)
    more = trade(study(tmp_path, axes=axes, cell="ensemble", runs=33), place, resume=True, threads=1)
    assert more.values("runs").tolist() == [33.0, 33.0]
    assert numbers(more) == numbers(trade(study(tmp_path, axes=axes, cell="ensemble", runs=33), threads=1))


def test_further_values_extend_a_study(tmp_path: Path) -> None:
    place = tmp_path / "out"
    trade(study(tmp_path), place)
    wider = study(tmp_path, axes=({"key": GRADE, "values": ("laser-standard", "tactical")},
                                  {"key": BIAS, "values": (0.1, 0.2)}))  # fmt: skip
    found = trade(wider, place, resume=True)
    assert found.computed == 3  # laser-standard with 0.1 deg/h is there
    assert numbers(found) == numbers(trade(wider))


def test_damaged_cells_are_named_and_computed_again(tmp_path: Path) -> None:
    made, place = study(tmp_path), tmp_path / "out"
    whole = trade(made, place)
    first, second, *_ = sorted((place / "cells").glob("*.json"))
    first.write_text(first.read_text(encoding="utf-8").replace("r95_end_m", "r95_end_n", 1), encoding="utf-8")
    second.write_bytes(second.read_bytes()[:-100])
    said: list[str] = []
    found = trade(made, place, resume=True, say=said.append)
    assert found.computed == 2
    assert [sum(str(file) in text and "computed again" in text for text in said) for file in (first, second)] == [1, 1]
    assert numbers(found) == numbers(whole)


def test_damaged_runs_are_named_and_computed_again(tmp_path: Path) -> None:
    axes = ({"key": BIAS, "values": (0.01, 0.1)},)
    made, place = study(tmp_path, axes=axes, cell="ensemble", runs=10), tmp_path / "out"
    whole = trade(made, place, threads=1)
    manifest, *_ = sorted(place.glob("cells/*/ensemble.json"))
    manifest.write_text("{", encoding="utf-8")
    (runs,) = [file for file in place.glob("cells/*/runs/*.parquet") if file.parents[1] != manifest.parent]
    runs.write_bytes(runs.read_bytes()[:-50])
    said: list[str] = []
    found = trade(made, place, resume=True, say=said.append, threads=1)
    assert any(str(manifest) in text for text in said)
    assert any(str(runs) in text for text in said)
    assert numbers(found) == numbers(whole)


def test_a_failed_cell_is_a_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The others are computed; it is counted and named, and its numbers are NaN."""
    axes = ({"key": "parked.latitude_deg", "values": (50.0, 89.9)}, {"key": BIAS, "values": (0.01, 0.1)})
    found = trade(study(tmp_path, axes=axes), tmp_path / "out")
    assert list(found.failures) == [3, 4]
    assert "89.900 deg" in found.failures[3]
    assert np.isnan(found.values("r95(end)")).tolist() == [[False, False], [True, True]]
    summary = (tmp_path / "out" / "summary.md").read_text(encoding="utf-8")
    assert "2 of 4 cells failed" in summary
    assert "cell 3, parked latitude 89.9 deg, gyro bias σ 0.01 deg/h: failed: " in summary
    assert [row["status"] for row in found.rows] == ["finished", "finished", "failed", "failed"]
    with pytest.raises(InputError, match="all 2 cells of the study small failed; cell 1: the motion reaches"):
        trade(study(tmp_path, axes=({"key": "parked.latitude_deg", "values": (89.9, 89.8)},)))

    def broken(*_: object) -> None:
        raise ZeroDivisionError("nothing to divide by")

    monkeypatch.setattr(running, "of_budget", broken)
    with pytest.raises(RunError, match="ZeroDivisionError: nothing to divide by"):
        trade(study(tmp_path))


def test_one_motion_is_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cells on the same motion share it, also where they do not follow one another."""
    made: list[float] = []
    real = ensemble_plan._truth
    monkeypatch.setattr(
        ensemble_plan, "_truth", lambda scenario: made.append(scenario.parked.latitude_deg) or real(scenario)
    )
    axes = ({"key": BIAS, "values": (0.01, 0.1)}, {"key": "parked.latitude_deg", "values": (0.0, 20.0, 40.0, 60.0)})
    trade(study(tmp_path, axes=axes))
    assert made == [0.0, 20.0, 40.0, 60.0]
    made.clear()
    trade(study(tmp_path, axes=axes, cell="ensemble", runs=2), threads=1)
    assert made == [0.0, 20.0, 40.0, 60.0]


def test_settings_of_a_filter(tmp_path: Path) -> None:
    """Budgets and ensembles with a filter: consistency, and the filter's own R95."""
    axes = ({"key": "filter.measurement_noise_factor", "values": (1.0, 3.0)},)
    budgets = trade(study(tmp_path, AIDED, axes))
    assert not budgets.failures
    own = budgets.values("filter_r95_end_m")
    assert own[1] > own[0] > 0.0
    inertial = trade(study(tmp_path, AIDED, axes, inertial=True))
    assert (inertial.values("r95(end)") > budgets.values("r95(end)")).all()
    fewer = ("ensemble.epoch_s=5.0",)
    runs = trade(study(tmp_path, AIDED, axes, cell="ensemble", runs=8, set=fewer), threads=1)
    nees, share = runs.values("nees_mean"), runs.values("nees_share_in_band")
    assert nees[0] > nees[1] > 0.0  # a filter that is told larger noise states larger errors
    assert ((share >= 0.0) & (share <= 1.0)).all()


def test_too_long(tmp_path: Path) -> None:
    """The study is measured by its first cells; what they give is kept."""
    place = tmp_path / "out"
    with pytest.raises(InputError, match=r"would take too long: 6 budgets, about .*--limit-minutes 1\.") as error:
        trade(study(tmp_path), place, limit_minutes=0.0)
    assert "2 of 6 cells are finished" in " ".join(error.value.__notes__)
    assert trade(study(tmp_path), place, resume=True).computed == 4


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"resume": True}, "need the directory"),
        ({"overwrite": True}, "need the directory"),
        ({"directory": "x", "overwrite": True, "resume": True}, "exclude each other"),
        ({"limit_minutes": -1.0}, "limit_minutes = -1.0 must not be negative"),
    ],
)
def test_options(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, keys: dict[str, Any], said: str) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=said):
        trade(study(tmp_path), **keys)
    assert [p.name for p in tmp_path.iterdir()] == ["standing.toml"]


def test_times_outside_the_run(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="t = 99 s lies outside the run"):
        trade(study(tmp_path, times_s=(99.0,)))
    with pytest.raises(InputError, match="99 s lies outside the run"):
        trade(study(tmp_path, times_s=(99.0,), cell="ensemble", runs=2), threads=1)


def test_a_scenario_without_a_budget() -> None:
    with pytest.raises(InputError, match="has no budget"):
        trade(TradeStudy(name="x", scenario="gyro_free", axes=({"key": "seed", "values": (1, 2)},)))
