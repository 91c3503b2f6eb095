"""The tables of runs, scores, studies and ensembles, from numbers written by hand: whole lines, heads and units."""

from __future__ import annotations

import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.experiments.run import run_comparison as runs
from sinssim.experiments.run import run_report as run
from sinssim.experiments.run import run_scores as score
from sinssim.experiments.run.finished_runs import Entry
from sinssim.experiments.run.parts import PARTS
from sinssim.experiments.studies import study_exhibits as study
from sinssim.experiments.studies.study_results import ErrorGrowth, Pick, Row, Verdict
from sinssim.recording.console import show, show_items
from tests.recording import fake_run
from tests.recording.by_hand import printed

HEADS = ["horizontal height velocity attitude", "final, m rms, m max, m max, m max, m/s max, arcmin"]


def numbers(size: float) -> dict[str, float | None]:
    """Return errors that are all different; the table has six of them."""
    names = [f"{kind}_{name}" for name in ("horizontal_error_m", "height_error_m", "velocity_error_mps",
             "attitude_error_arcsec") for kind in ("final", "rms", "max")]  # fmt: skip
    return dict(zip(names, (size * k for k in (1.0, 2.0, 3.0, -4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 90.0)),
                    strict=True))  # fmt: skip


PASSAGE = {"start_s": 1.0, "end_s": 2.0, "damage_arcsec": 3.0, "text": "euler: pitch went through 90°"}
ROW = "1 2 3 6 9 1.5"
"""The cells of the errors of size 1: horizontal final, rms and max, then the largest of the others; 90″ are 1.5′."""


def summary(**changes: Any) -> dict[str, Any]:
    found = {
        "algorithms": {"quaternion": numbers(1.0), "euler": numbers(2.0)}, "failures": {}, "singularities": {},
        "timing": {"truth_s": 0.0, "sensors_s": 1.25, "navigation_s": 0.5}, "flagged_samples": {}, "start_s": 10.0,
        "end_s": 30.0,
    }  # fmt: skip
    return found | changes


def finished(found: dict[str, Any]) -> Any:
    """Return a finished run with a summary and the parts that have an entry in it."""
    parts = {kind.name: kind(None, entry=found[kind.name]) for kind in PARTS if kind.name in found}  # type: ignore[arg-type]
    return SimpleNamespace(scenario=fake_run.scenario(), summary=found, parts=parts)


def of_run(found: dict[str, Any]) -> list[str]:
    """Return the lines that a run with a summary prints."""
    of: Any = {"status": "finished", **found}
    return printed(lambda console: show_items(run.brief(finished(found), of), console))


def test_the_errors_of_a_run() -> None:
    scenario = fake_run.scenario()
    lines = of_run(summary())
    assert lines[:5] == ["fake: errors against the truth", HEADS[0], "algorithm " + HEADS[1], f"quaternion {ROW}",
                         "euler 2 4 6 12 18 3"]  # fmt: skip
    assert lines[-1] == "Time: sensors 1.25 s, navigation 0.50 s"
    of_filter = {name: numbers(size) for name, size in (("smoothed", 3.0), ("aided", 4.0))} | {"backward": None}
    failed = summary(
        failures={"euler": {"text": "it stopped."}}, filter=of_filter, flagged_samples={"saturated": 1200, "late": 0},
        singularities={"euler": [PASSAGE]}, not_attained=["Leg 3 was cut."],
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "sentences", lambda found: [f"sentences of {sorted(found)}"])
        lines = of_run(failed)
    assert lines[3:7] == [f"quaternion {ROW}", "euler 2 4 6 12 18 3",
                          "aided 4 8 12 24 36 6",
                          "smoothed 3 6 9 18 27 4.5"]  # fmt: skip
    assert lines[7] == "Leg 3 was cut."
    samples = round(20.0 * scenario.imu.rate_hz)
    assert f"Flagged by the sensors, of {samples:,} samples: 1,200 saturated." in lines
    assert lines[-4:] == ["euler has no result: it stopped.", "euler: pitch went through 90°",
                          "sentences of ['aided', 'backward', 'smoothed']",
                          "Time: sensors 1.25 s, navigation 0.50 s"]  # fmt: skip


@pytest.mark.parametrize(
    ("about", "title"),
    [
        ({"reference_file": "ref.csv", "compared_with": "reference"}, "errors against the reference ref.csv"),
        ({"reference_file": None, "compared_with": "quaternion"}, "differences from quaternion"),
        ({"reference_file": None, "compared_with": None}, "one solution, no reference"),
    ],
)
def test_the_title_of_a_log(about: dict[str, Any], title: str) -> None:
    found = summary(log=about | {"notes": ["Read."], "knows": ["velocity"]})
    lines = of_run(found)
    assert lines[0] == f"fake: {title}"
    assert "Read." in lines
    assert not any(line.startswith("Height of the inertial solutions") for line in lines)


def test_outages_and_phases_of_a_run() -> None:
    keys = ("horizontal_error_m", "horizontal_sigma_m", "height_error_m", "velocity_error_mps",
            "smoothed_max_horizontal_error_m")  # fmt: skip
    each = [{"from_s": start, "to_s": start + 30.0} | dict(zip(keys, values, strict=True)) for start, values in
            ((100.0, (1.5, 2.5, 3.5, 0.25, 0.125)), (250.0, (4.5, 5.5, 6.5, 0.5, 0.75)))]  # fmt: skip
    median, p90 = (dict(zip(keys, values, strict=True)) for values in ((3.0, 4.0, 5.0, 0.375, 0.4375),
                                                                      (4.2, 5.2, 6.2, 0.475, 0.6875)))  # fmt: skip
    outages = {"each": each, "against": "the truth", "median": median, "p90": p90, "error_over_sigma": 1.23}
    phases = {
        "horizontal_error_m": 12.34, "horizontal_added_m": 5.678, "velocity_error_mps": 0.0321,
        "velocity_added_mps": -0.0456, "heading_error_arcmin": None, "heading_added_arcmin": 1.5,
        "tilt_error_arcsec": 4.25, "tilt_added_arcsec": -6.75,
    }  # fmt: skip
    found = summary(outages=outages, phases={"aided": [{"phase": "taxi", "from_s": 120.4, "to_s": 300.6, **phases}]})
    lines = of_run(found)
    assert lines[5:19] == [
        "aided: what each phase added",
        "from … to horizontal added velocity added heading added tilt added",
        "phase s m m m/s m/s arcmin arcmin arcsec arcsec",
        "taxi 120 … 301 12.3 5.68 0.0321 −0.0456 – 1.50 4.25 −6.75",
        "2 outages: errors at the end, against the truth",
        "from … to horizontal 1σ of the filter height velocity smoothed, largest",
        "s m m m m/s m",
        "100 … 130 1.50 2.50 3.50 0.250 0.125",
        "250 … 280 4.50 5.50 6.50 0.500 0.750",
        "median 3.00 4.00 5.00 0.375 0.438",
        "90 % 4.20 5.20 6.20 0.475 0.688",
        *lines[16:19],
    ]
    assert lines[16].startswith("Errors at the end of each phase. Added: length of the change")
    assert ("2 outages of 30 s: horizontal error at the end 3.00 m (median), 4.20 m (90 %); smoothed, at most 0.438 m "
            "and 0.688 m within the outage. The errors at the end are 1.23 of their 1σ (rms).") in lines  # fmt: skip
    many = found | {"outages": outages | {"each": each * 8}}
    lines = of_run(many)
    assert "16 outages: errors at the end, against the truth" in lines
    assert not any(line.startswith("100 …") for line in lines)


def test_the_sources_of_the_phases() -> None:
    """The two largest sources of a tenth or more; the notes come before all other lines."""

    def of(key: str, size: float, **shares: float) -> dict[str, Any]:
        return {key: size, "shares": shares}

    sources = {
        "horizontal": of("horizontal_sigma_m", 12.34, gyros=0.615, accels=0.25, baro=0.125),
        "heading": of("heading_sigma_arcmin", 0.567, walk=0.95, bias=0.05), "tilt": of("tilt_sigma_arcsec", 0.0),
    }  # fmt: skip
    keys = (one.format(what) for one in ("horizontal_{}_m", "velocity_{}_mps", "heading_{}_arcmin", "tilt_{}_arcsec")
            for what in ("error", "added"))  # fmt: skip
    row = dict.fromkeys(keys, 1.5) | {"phase": "taxi", "from_s": 0.0, "to_s": 60.0}
    found = summary(phases={"aided": [row | {"sources": sources}], "euler": [row | {"no_sources": "It has a gap."}]})
    lines = of_run(found)
    start = lines.index("aided: sources of what each phase added, 1σ of all runs")
    assert lines[start + 1 : start + 3] == [
        "phase horizontal heading tilt", "taxi 12.3 m: gyros 62 %, accels 25 % 0.567 arcmin: walk 95 % 0",
    ]  # fmt: skip
    assert lines[start + 3].startswith("Errors at the end of each phase. Added: ")
    assert lines[start + 4] == "euler: the sources of the phases’ errors are unknown (no budget). It has a gap."
    assert lines[start + 5].startswith("Sources: root mean square over all runs of what a phase adds")


def test_finished_runs(tmp_path: Path) -> None:
    date = datetime.datetime(2024, 5, 6, 7, 8, 9).astimezone()
    entries = [
        Entry(Path("a/one"), "run", "flight", "finished", "aided", 1.23456, 1_234_567, date),
        Entry(Path("b"), "run", "drive", "failed", "", None, 98_765, date, "It is broken.", "0.1"),
        Entry(Path("c"), "study", "", "", "", None, 432, date),
    ]
    assert printed(lambda console: show_items(runs.list_exhibits(entries, Path("here")), console)) == [
        "horizontal rms", "directory kind scenario m of size date",
        "a/one run flight 1.235 aided 1.23 MB 2024-05-06 07:08",
        "b run, failed drive 98.8 kB 2024-05-06 07:08",
        "c study 432 B 2024-05-06 07:08",
        "3 in here, 1.33 MB.",
        "Not read: It is broken.",
    ]  # fmt: skip


def test_scores(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the rms of the horizontal error; a solution without one is last."""
    found = {"own": numbers(2.0), "theirs": numbers(1.0), "none": dict.fromkeys(numbers(1.0))}
    monkeypatch.setattr(score, "known_numbers", lambda error, span: found[error])
    monkeypatch.setattr(score, "error_exhibits", lambda *_, **__: [])
    monkeypatch.setattr(score, "schuler_period", lambda *_: 5000.0)
    scored = SimpleNamespace(name="theirs", path=Path("x.csv"), seconds=12.5, sentences=("Late.", "North."))
    other = SimpleNamespace(name="none", path=Path("y.csv"), seconds=None, sentences=("Empty.",))
    run_ = SimpleNamespace(name="run")
    judge: Any = SimpleNamespace(run=run_, against="the truth", axes="north", ellipsoid=None)
    of: Any = score.Scored(judge, [scored, other], {name: name for name in found}, (1.5, 90.0))  # type: ignore[list-item, misc]
    vars(of)["motion"] = None
    lines = printed(lambda console: show(score.score_exhibits(of), console))
    assert lines == [
        "run: errors against the truth, 1.5 s to 90 s, by the rms horizontal error",
        HEADS[0],
        f"rank algorithm {HEADS[1]} time, s",
        f"1 theirs * {ROW} 12.5",
        "2 own 2 4 6 12 18 3",
        "3 none * – – – – – –",
        "* theirs (x.csv): Late. North.",
        "* none (y.csv): Empty.",
    ]


def row(algorithm: str, rate: float, size: float, **changes: Any) -> Row:
    kept = {"status": "done"} | changes
    return Row("part", "cone", "rate-gyros", "ideal", algorithm, "level", "normal", "exact", rate, (), "hold",
               max_horizontal_error_m=size, max_velocity_error_mps=2.0 * size, max_attitude_error_arcsec=3.0 * size,
               **kept)  # fmt: skip


def study_result(**more: Any) -> Any:
    """Return the result of a study without parts and costs."""
    plan = SimpleNamespace(name="s", description="", parts=[], seed=1, block=lambda name: None)
    return SimpleNamespace(
        **{"study": plan, "status": "finished", "seconds": 1.0, "verdicts": [], "picks": [], "rows": [], "orders": [],
           "coordinate_errors": [], "headings": [], "costs": {}, "attitude_costs": [], "motions": {}, "histories": {},
           **more}
    )  # fmt: skip


def test_a_study() -> None:
    parts = [SimpleNamespace(title=title, decides=(), sensors=("ideal",), variants=("rate-gyros",), rates_hz=rates,
                             schedules_hz=(), text="", coordinates=())
             for title, rates in (("rates", (10.0, 20.0, 50.0)), ("cases", (10.0,)))]  # fmt: skip
    lines = [row("euler", rate, 10.0 / rate) for rate in (50.0, 10.0, 20.0)]
    lines += [row("poisson", rate, 40.0 / rate) for rate in (10.0, 20.0)]
    cases = [row("euler", 10.0, 0.75), row("poisson", 10.0, 5.0, status="failed")]
    verdict = Verdict("coning", "It is so.", "refuted", "Because.", measured="3 m", expected="")
    pick = Pick("rates", "ideal", "rate-gyros", "euler at 10 Hz", "it is best",
                {"max_horizontal_error_m": 1.25, "attitude_drift_arcsec_h": 0.5, "us_per_second": 37.5})  # fmt: skip
    none = Pick("cases", "tactical", "platform", "", "none qualifies")
    growth = ErrorGrowth(np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    result = study_result(picks=[pick, none], rows=lines + cases, of_part={"rates": lines, "cases": cases}.get,
                          history=lambda row: growth)  # fmt: skip
    result.study.parts = parts
    shown = printed(lambda console: show(study.exhibits_of(result), console))
    assert shown == [
        "Recommended engines",
        "horizontal attitude processor time", "part sensors recommended engine m ″/h µs/s",
        "rates ideal euler at 10 Hz 1.25 0.500 37.5",
        "cases tactical, platform none qualifies – – –",
        "rates:", "cone: largest attitude error, ″",
        "10 Hz 20 Hz 50 Hz", "euler 3.00 1.50 0.600", "poisson 12.0 6.00 –",
        "cases:", "Largest and final errors, cone",
        "horizontal max velocity max attitude max", "algorithm m m/s ″", "euler 0.750 1.50 2.25",
        "poisson failed failed failed",
        "1 of 7 navigations failed; the report gives the reasons.",
    ]  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Verdict, "title", "claim of the coning")
        decided = study_result(verdicts=[verdict])
        shown = printed(lambda console: show(study.exhibits_of(decided), console))
    assert shown[1:3] == ["claim verdict measured expected", "claim of the coning refuted 3 m –"]


def test_a_narrow_console_shows_the_lowest_and_the_highest_rate() -> None:
    lines = [row("euler", rate, 10.0 / rate) for rate in (50.0, 10.0, 20.0)]
    paint = {"euler": "#112233"}
    table = study._against_rates(lines, "max_attitude_error_arcsec", lambda one: one.algorithm, paint)
    assert printed(lambda console: show_items([table], console), 24) == ["10 Hz 50 Hz", "euler 3.00 0.600"]
    assert printed(lambda console: show_items([table], console), 40)[0] == "10 Hz 20 Hz 50 Hz"
