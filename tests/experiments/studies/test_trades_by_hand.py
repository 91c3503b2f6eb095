"""Tables, sentences and files of trade studies whose every number is written by hand."""

from __future__ import annotations

import shlex
from dataclasses import replace
from math import inf, nan, pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.experiments.studies import trade_cells, trade_exhibits
from sinssim.experiments.studies.trade_cells import cells_of, command_of
from sinssim.experiments.studies.trade_exhibits import exhibits_of, grids, growth, to_json
from sinssim.experiments.studies.trade_result import (
    TradeResult,
    Unit,
    cell_table,
    definitions,
    failure_lines,
    headline,
    instants,
    label_of,
    requirement_lines,
    unit_for,
    verdict_text,
)
from sinssim.experiments.studies.trade_run import TradeMedia
from sinssim.experiments.studies.trade_schema import Axis, TradeStudy
from sinssim.recording.page import page_of
from sinssim.recording.rerun_exhibits import markdown, record_chart
from sinssim.statistics.requirements import Quantity, parse_quantity, parse_requirement
from tests.experiments.studies.trade_examples import ACCEL, BIAS, GRADE, study
from tests.experiments.studies.trades_by_hand import ASK, OTHER, RISING, UNITS, made, without
from tests.recording.spies import Drawn

SECOND = pi / 648_000.0


def test_the_table_of_the_cells(tmp_path: Path) -> None:
    """Lengths share the unit of the largest, and so do speeds and angles; verdicts with what no column shows."""
    result = made(tmp_path)
    heads, rows, count = cell_table(without(result, 5))
    assert heads == ["cell", "unit", "gyro bias σ, deg/h", "CEP, m", "R95, m", "rate, nmi/h", "v north, mm/s",
                     "v east, mm/s", "tilt n, arcsec", "tilt e, arcsec", "heading, arcsec", *ASK]  # fmt: skip
    assert count == 3
    assert rows[0] == ["1", "A", "0.02", "50.0", "100", "0.100", "1.00", "2.00", "3.00", "4.00", "10.0", "met",
                       "met: 33.3 m at 30 s", "met: 10.0 arcsec at 45 s"]  # fmt: skip
    assert rows[3] == ["4", "B", "0.02", "200", "400", "0.400", "4.00", "8.00", "12.0", "16.0", "40.0", "NOT MET",
                       "NOT MET: 133 m at 30 s", "NOT MET: 40.0 arcsec at 45 s"]  # fmt: skip
    assert rows[4] == ["5", "B", "0.01", "failed", *[""] * 10]
    (when,) = instants(made(tmp_path))
    heads, rows, count = cell_table(made(tmp_path), when, bands=True)
    assert heads[3:] == ["CEP, m", "R95, m", "rate, nmi/h", "v north, mm/s", "v east, mm/s", "tilt n, arcsec",
                         "tilt e, arcsec", "heading, arcsec"]  # fmt: skip
    assert rows[2] == ["3", "A", "0.05", "50.0 (40.0 … 75.0)", "100 (80.0 … 150)", "0.100 (0.0800 … 0.150)", "1.00",
                       "2.00", "3.00", "4.00", "10.0"]  # fmt: skip
    with_nees = made(tmp_path)
    with_nees.cells[1].numbers.values.update(nees_mean=1.234, nees_share_in_band=0.876)
    heads, rows, _ = cell_table(with_nees)
    assert heads[11:13] == ["NEES / n", "in band"]
    assert [row[11:13] for row in rows[:2]] == [["–", "–"], ["1.23", "88 %"]]
    assert list(definitions(with_nees)) == ["CEP, R95", "velocity, tilt, heading", "rate"]
    runs = made(tmp_path, cell="ensemble", runs=90)
    assert list(definitions(runs)) == ["CEP, R95", "velocity, tilt, heading", "rate", "band"]
    runs.cells[0].numbers.values["nees_mean"] = 1.0
    assert list(definitions(runs))[-1] == "NEES"
    said = definitions(runs)
    assert said["CEP, R95"] == "50th and 95th percentile over the runs; the error of a failed run is infinite"
    assert said["rate"].startswith("R95 of ")
    assert said["rate"].endswith(", of each run; 1 nmi = 1852 m")
    assert said["velocity, tilt, heading"].endswith("over the runs that did not fail; 1σ where its mean is zero")
    assert "95 % confidence: of percentiles by order statistics, of a root mean square by χ²" in said["band"]
    assert "mean of all states per degree of freedom" in said["NEES"]
    assert "lies in its 95 % band" in said["NEES"]
    of_budget = definitions(result)
    assert of_budget["CEP, R95"] == "radius of the circle that contains half, or 95 %, of all runs"
    assert of_budget["rate"] == "R95 divided by the time since the start; 1 nmi = 1852 m"


def test_units(tmp_path: Path) -> None:
    """The unit of a requirement if it is one that tables use, else the one that suits the largest value."""
    result = made(tmp_path)
    assert unit_for(result, Quantity("r95", "end")) == Unit("m", 1.0)  # 600 m; km is not taken from the requirement
    assert unit_for(result, Quantity("r95", "at", 30.0)) == Unit("m", 1.0)
    assert unit_for(result, Quantity("velocity_east", "end")) == Unit("mm/s", 1e-3)
    assert unit_for(result, Quantity("velocity_down", "end")) == Unit("m/s", 1.0)
    assert unit_for(result, Quantity("velocity_east", "end"), Quantity("velocity_down", "end")) == Unit("m/s", 1.0)
    assert unit_for(result, Quantity("rate", "end")) == Unit("nmi/h", 1.0)
    asked = study(tmp_path, require=("heading(end) <= 2 deg", "cep(end) <= 1 nmi"))
    other = TradeResult(asked, result.cells, media=TradeMedia())
    assert unit_for(other, Quantity("heading", "end")) == Unit("deg", pytest.approx(pi / 180.0))
    assert unit_for(other, Quantity("cep", "end")) == Unit("nmi", 1852.0)
    assert unit_for(other, Quantity("cep", "at", 30.0)).name == "m"
    assert Unit("km", 1e3).text(1234.5) == "1.23"
    assert Unit("km", 1e3).text(inf) == "∞"


@pytest.mark.parametrize(
    ("text", "label"),
    [("r95(end)", "R95 at the end"), ("cep(90 s)", "CEP at 90 s"), ("rate(end)", "rate at the end"),
     ("heading(run)", "heading error largest of the run, rms"), ("position_down(end)", "height error at the end, rms")],
)  # fmt: skip
def test_quantities_in_words(text: str, label: str) -> None:
    assert label_of(parse_quantity(text)) == label


def test_grids(tmp_path: Path) -> None:
    """A grid over the last two axes for each value of the first; a star where the requirement then is met."""
    result = without(made(tmp_path, (OTHER, UNITS, RISING)), 9)
    first, second = grids(result, Quantity("r95", "at", 30.0))
    assert first.title == "R95 at 30 s, m: accel bias σ 10 µg; * meets r95(30 s) <= 100 m"
    assert second.title == "R95 at 30 s, m: accel bias σ 25 µg; * meets r95(30 s) <= 100 m"
    assert [column.head for column in first.columns] == ["unit \\ gyro bias σ, deg/h", "0.02", "0.01", "0.05"]
    assert first.rows == [["A", "33.3 *", "66.7 *", "100 *"], ["B", "133", "167", "200"]]
    assert second.rows == [["A", "233", "267", "failed"], ["B", "333", "367", "400"]]
    (plain,) = grids(made(tmp_path), Quantity("cep", "end"))
    assert plain.title == "CEP at the end, m"
    assert plain.rows[1] == ["B", "200", "250", "300"]


def test_which_cells_meet_what(tmp_path: Path) -> None:
    lines = requirement_lines(without(made(tmp_path), 2))
    named = "unit A, gyro bias σ 0.02 deg/h; unit A, gyro bias σ 0.05 deg/h"
    assert lines == [f"{ASK[0]}: met in 2 of 5 cells ({named}).", f"{ASK[1]}: met in 2 of 5 cells ({named}).",
                     f"{ASK[2]}: met in 2 of 5 cells ({named}).",
                     f"All 3 requirements together: met in 2 of 5 cells ({named})."]  # fmt: skip
    assert failure_lines(without(made(tmp_path), 2)) == ["cell 2, unit A, gyro bias σ 0.01 deg/h: failed: it fell."]
    judged = {1: "met", 2: "undecided", 3: "met", 4: "met", 5: "met", 6: "undecided", 7: "met", 8: "not met", 9: "met",
              10: "met", 11: "not met", 12: "not met"}  # fmt: skip
    lines = requirement_lines(made(tmp_path, (OTHER, UNITS, RISING), judged, cell="ensemble", runs=10))
    assert lines[0] == (
        f"{ASK[0]}: met with 95 % confidence in 7 of 12 cells (numbers 1, 3–5, 7, 9, 10), undecided in 2; about 260 "
        "more runs would decide them."
    )
    assert lines[3] == (
        "All 3 requirements together: met with 95 % confidence in 2 of 12 cells (accel bias σ 10 µg, unit A, gyro bias "
        "σ 0.02 deg/h; accel bias σ 10 µg, unit A, gyro bias σ 0.05 deg/h), undecided in 1."
    )
    everything = made(tmp_path, (RISING,))
    assert requirement_lines(everything)[3] == "All 3 requirements together: met in 3 of 3 cells."


def test_the_headline(tmp_path: Path) -> None:
    result = made(tmp_path, set=("seed=9",))
    grid = "standing.toml: 2 values of unit × 3 values of gyro bias σ."
    assert headline(result) == f"6 covariance budgets of {grid} The same in every cell: seed=9."
    failed, left = replace(result.cells[4], numbers=None, failure="it fell."), replace(result.cells[5], numbers=None)
    stopped = TradeResult(result.study, (*result.cells[:4], failed, left), "interrupted", media=TradeMedia())
    assert headline(stopped).endswith("The study was interrupted: 4 of 6 cells are finished. 1 of 6 cells failed.")
    runs = made(tmp_path, cell="ensemble", runs=90)
    for one, number in zip(runs.cells, (90.0, 70.0, 80.0, 90.0, 90.0, 90.0), strict=True):
        one.numbers.values["runs"] = number
    assert headline(runs) == (f"6 ensembles of 70 to 90 runs of {grid} R95 has no upper bound with fewer than 72 runs.")


def test_arrays_rows_and_verdicts(tmp_path: Path) -> None:
    result = without(made(tmp_path, words={2: "undecided"}), 5)
    np.testing.assert_allclose(3.0 * result.values("r95(30 s)"), [[100.0, 200.0, 300.0], [400.0, nan, 600.0]])
    low, high = result.band("cep(end)")
    assert low.tolist()[0] == pytest.approx([40.0, 80.0, 120.0])
    assert high.tolist()[0] == pytest.approx([75.0, 150.0, 225.0])
    assert result.verdicts(ASK[0]).tolist() == [["met", "undecided", "met"], ["not met", "", "not met"]]
    assert result.verdicts().tolist() == [["met", "undecided", "met"], ["not met", "", "not met"]]
    assert [one.status for one in result.cells] == ["finished"] * 4 + ["failed", "finished"]
    row = result.rows[2]
    head = {"cell": 3, GRADE: "tactical", "unit": "A", BIAS: 0.05, "status": "finished"}
    assert {name: row[name] for name in list(row)[:5]} == head
    assert list(row)[:5] == list(head)
    assert row["r95_end_m"] == pytest.approx(300.0)
    assert [row[text] for text in ASK] == ["met"] * 3
    assert row["failure"] == ""
    assert [result.rows[4][name] for name in (*ASK, "failure", "status")] == [None, None, None, "it fell.", "failed"]
    assert result.name(6) == "unit B, gyro bias σ 0.05 deg/h"
    assert verdict_text(result.cells[1], parse_requirement(ASK[0])) == "undecided"
    assert verdict_text(result.cells[4], parse_requirement(ASK[0])) == ""


def test_the_file_of_numbers(tmp_path: Path) -> None:
    result = without(made(tmp_path), 2)
    found = to_json(result)
    assert {k: v for k, v in found.items() if k not in ("cells", "versions", "definitions", "scenario")} == {
        "study": "small", "description": "", "status": "finished", "set": [], "cell": "budget", "finished": 5,
        "failed": 1, "notes": [], "computed": 0, "seconds": 0.0,
        "axes": [
            {"name": "unit", "keys": [GRADE], "unit": "", "values": ["tactical", "laser-standard"],
             "labels": ["A", "B"]},
            {"name": "gyro bias σ", "keys": [BIAS], "unit": "deg/h", "values": [0.02, 0.01, 0.05], "labels": []},
        ],
    }  # fmt: skip
    third = found["cells"][2]
    assert {k: third[k] for k in ("cell", "settings", "status", "failure")} == {
        "cell": 3, "settings": {GRADE: "tactical", BIAS: 0.05}, "status": "finished", "failure": "",
    }  # fmt: skip
    assert third["values"]["r95_end_m"] == pytest.approx(300.0)
    assert third["requirements"][0] == {
        "requirement": ASK[0], "verdict": "met", "value": pytest.approx(0.3), "limit": 0.3, "unit": "km",
        "time_s": 60.0, "more_runs": 0, "exceeded_from_s": None, "after_fixes_end_s": None,
    }  # fmt: skip
    asked = [word for text in ASK for word in ("--require", text)]
    line = shlex.split(third["command"])
    assert line == ["sinssim", "budget", result.study.scenario, "--set", f'{GRADE}="tactical"', "--set",
                    f"{BIAS}=0.05", *asked]  # fmt: skip
    assert third["digest"] != found["cells"][0]["digest"]
    assert (found["cells"][1]["values"], found["cells"][1]["requirements"]) == ({}, [])
    assert (to_json(made(tmp_path))["seconds"], to_json(made(tmp_path))["computed"]) == (12.35, 4)
    assert to_json(made(tmp_path))["notes"] == ["A note."]


def test_the_command_of_a_cell(tmp_path: Path) -> None:
    """Runs, fixed and varied keys, times that no requirement has, requirements."""
    asked = {"times_s": (30.1234567, 40.5), "require": ("r95(40.5 s) <= 1 km",), "axes": (UNITS, RISING)}
    runs = study(tmp_path, cell="ensemble", runs=70, set=("seed=9",), **asked)
    varied = ["--set", f'{GRADE}="laser-standard"', "--set", f"{BIAS}=0.01"]
    ends = ["--at", "30.1234567", "--require", "r95(40.5 s) <= 1 km"]
    line = shlex.split(command_of(runs, cells_of(runs)[4], "python -m sinssim"))
    assert line == ["python -m sinssim", "ensemble", runs.scenario, "--runs", "70", "--set", "seed=9", *varied, *ends]
    plain = study(tmp_path, inertial=True, **asked)
    line = shlex.split(command_of(plain, cells_of(plain)[4]))
    assert line == ["sinssim", "budget", plain.scenario, "--inertial", *varied, *ends]
    assert cells_of(plain)[4].number == 5
    assert cells_of(plain)[4].place == (1, 1)
    assert cells_of(plain)[4].settings == (f'{GRADE}="laser-standard"', f"{BIAS}=0.01")


def test_times_within_a_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Estimated at 100 s, flown once from 10 s to 150 s: it lasts 140 s; shorter times need no flight."""
    flown: list[str] = []

    def fly(scenario: SimpleNamespace, *, errors: str) -> SimpleNamespace:
        assert errors == "none"
        flown.append(scenario.name)
        return SimpleNamespace(start=10.0, end=150.0)

    monkeypatch.setattr(trade_cells, "expected_duration", lambda scenario: 100.0)
    monkeypatch.setattr(trade_cells, "flight_key", lambda flight, seed: f"{flight} {seed}")
    monkeypatch.setattr(trade_cells, "true_motion", fly)
    flight, parked = (SimpleNamespace(name=str(f), flight=f, seed=3, log=None) for f in ("climb", None))
    known: dict[str, float] = {}
    for time in (90.0, 120.0, 140.0):
        trade_cells._check_times(study(tmp_path, times_s=(time, 5.0)), flight, known)
    assert (flown, known) == (["climb"], {"climb 3": 140.0})
    with pytest.raises(InputError, match=r"t = 140\.5 s lies outside the run, which lasts 140 s; give a time"):
        trade_cells._check_times(study(tmp_path, times_s=(140.5, 5.0)), flight, known)
    with pytest.raises(InputError, match=r"t = 120 s lies outside the run, which lasts 100 s"):
        trade_cells._check_times(study(tmp_path, times_s=(120.0,)), parked, known)
    with pytest.raises(InputError, match=r"'cep\(150 s\) <= 1 m': 150 s lies outside the run, which lasts 140 s"):
        trade_cells._check_times(study(tmp_path, require=("cep(150 s) <= 1 m",)), flight, known)
    parked.log = "recorded"
    trade_cells._check_times(study(tmp_path, times_s=(120.0,)), parked, known)
    assert len(flown) == 1


def test_markdown(tmp_path: Path) -> None:
    lines = markdown(exhibits_of(without(made(tmp_path, description="Of two units."), 2))).splitlines()
    assert lines[:5] == ["# small: a trade study", "", "Of two units.", "", lines[4]]
    assert lines[4].startswith("6 covariance budgets of")
    start = lines.index("**At the end**")
    assert lines[start + 2].startswith("| cell | unit | gyro bias σ, deg/h | CEP, m | R95, m |")
    assert lines[start + 3] == "|---|---|---|" + "---:|" * 11
    assert lines[start + 4].startswith("| 1 | A | 0.02 | 50.0 (40.0 … 75.0) | 100 (80.0 … 150) |")
    later = lines.index("**At 30 s**")
    assert lines[later + 4].startswith("| 1 | A | 0.02 | 16.7 (13.3 … 25.0) | 33.3 (26.7 … 50.0) |")
    assert "cell 2, unit A, gyro bias σ 0.01 deg/h: failed: it fell." in lines
    commands = lines[lines.index("```") + 1 :]
    assert [f"{BIAS}={value}" in command for command, value in zip(commands, (0.02, 0.01, 0.05) * 2, strict=False)] == [
        True
    ] * 6


def test_what_a_study_asks_for() -> None:
    plan = TradeStudy(name="s", scenario="parked", axes=(Axis(**RISING),), times_s=(0.0, 90.0),
                      require=("rate(120 s) <= 1 kt", "cep(run) <= 3 m"))  # fmt: skip
    assert plan.instants == (0.0, 90.0, 120.0)
    assert plan.drawn == (Quantity("rate", "at", 120.0), Quantity("cep", "run"))
    assert len(plan.quantities) == 12 + 11 + 12 + 2  # no rate at the start
    late = plan.model_copy(update={"times_s": (640.0, 33.0, 0.0, 90.0, 512.5, 7.25)})
    assert late.instants == (0.0, 7.25, 33.0, 90.0, 120.0, 512.5, 640.0)
    assert TradeStudy(name="s", scenario="parked", axes=(Axis(**RISING),)).drawn == (Quantity("r95", "end"),)
    linked = Axis(keys=(BIAS, ACCEL), values=((0.1, 2.0), (0.3, 4.0)))
    assert (linked.title, linked.name_of(1)) == ("gyro bias σ & accel bias σ", "0.3 & 4")
    assert (linked.unit, linked.numeric) == ("", False)
    assert linked.settings(1) == ((BIAS, 0.3), (ACCEL, 4.0))


@pytest.mark.parametrize("wide", [False, True])
def test_growth_of_the_cells_in_a_recording(tmp_path: Path, wide: bool) -> None:
    """In m, or as its logarithm where nothing is zero: R95 at the end of 100 to 600 m, or of 10 m in the first cell."""
    result = made(tmp_path)
    if wide:
        result.cells[0].numbers.r95[:] = [0.0, 5.0, 10.0]  # type: ignore[union-attr]
    drawn: Any = Drawn()
    for charts in growth(result):
        for chart in charts:
            record_chart(drawn, f"trade/{chart.key}", chart, 0.0)
            assert (chart.y.log, chart.unit(upright=True)[0]) == (wide, "m")
    for key, factor in (("r95", 1.0), ("cep", 0.5)):
        names = [f"{unit}, {bias} deg/h" for unit in "AB" for bias in ("0.02", "0.01", "0.05")]
        columns = []
        for k in range(6):
            ends = np.array([0.0, 5.0, 10.0]) if wide and not k and key == "r95" else (k + 1.0) * np.array([0, 50, 100])
            values = factor * ends if key == "cep" or not wide or k else ends
            with np.errstate(divide="ignore"):
                columns.append(np.where(values > 0.0, np.log10(values), np.nan) if wide else values)
        drawn.shows(f"trade/{key}", names, [0.0, 30.0, 60.0], np.column_stack(columns))


def test_panels_beyond_twelve_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last two axes are within a panel: of a grid of 2 × 2 × 3, two panels."""
    monkeypatch.setattr(trade_exhibits, "MOST_PANELS", 1)
    three = page_of(exhibits_of(made(tmp_path, (OTHER, UNITS, RISING))))
    assert "The figures show 1 of 2 panels; the table has all." in three
    assert "The figures show" not in page_of(exhibits_of(made(tmp_path)))
