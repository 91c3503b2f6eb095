"""Tables, sentences, curves and the order of an ensemble in every medium, from numbers that are chosen."""

from __future__ import annotations

import re
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.exhibits import Sentence
from sinssim.experiments.ensembles import ensemble_exhibits as ensemble
from sinssim.experiments.ensembles import ensemble_exhibits as files
from sinssim.experiments.ensembles.ensemble_summary import DEFINITIONS, Component, Regulation
from sinssim.recording.console import show
from sinssim.recording.page import page_of
from sinssim.recording.rerun_exhibits import markdown, record_chart, record_cloud
from sinssim.units import fixed
from tests.experiments.ensembles.made_ensemble import ARCMIN, EAST, NORTH, NUMBERS, TIME, Result
from tests.recording.by_hand import printed
from tests.recording.spies import Drawn, cells, read, values_of

CEP, R95, TINT_CEP, TINT_R95 = (0, 158, 115), (0, 114, 178), (90, 153, 136), (90, 135, 161)
MET, NOT_MET = (0, 158, 115), (213, 94, 0)
NONE = np.nan
ASKED: Any = (("cep(60 s) <= 30 m", "met"), ("rate(end) <= 0.4 m/s", "undecided"), ("r95(run) <= 70 m", "not met"))


def exhibits(*verdicts: Any, **changes: Any) -> Any:
    result: Any = Result(*verdicts)
    return ensemble.exhibits_of(result, replace(NUMBERS, **changes))


def heads(html: str) -> list[str]:
    """Return the headings of a page, as text."""
    return [re.sub("<[^>]*>", "", one) for one in re.findall(r"<h[123]>(.*?)</h[123]>", html)]


def test_the_page_in_order() -> None:
    html = page_of(exhibits(*ASKED))
    assert "<title>&lt;trial&gt;: an ensemble of 5 runs</title>" in html
    requirements = ["Requirements", "cep(60 s) &lt;= 30 m: met", "rate(end) &lt;= 0.4 m/s: undecided",
                    "r95(run) &lt;= 70 m: not met"]  # fmt: skip
    rest = ["Errors of the population", "Each run", "Errors by component", "Consistency of the filter",
            "ANEES by block of states", "NIS by sensor", "Runs to examine", "Failed runs", "Definitions",
            "How it was computed"]  # fmt: skip
    assert heads(html) == ["&lt;trial&gt;: an ensemble of 5 runs", *requirements, *rest]
    assert '<p class="lead">From A.</p>' in html
    assert "<p><strong>A &lt;note&gt;.</strong></p>" in html
    assert html.count('role="img"') == 2 + 2 + 1 + 9 + 1 + 2  # with the common legend of the components
    plain: Any = Result(filtered=False)
    plain.plan.scenario.description, plain.failures, plain.notes = "", {}, []
    html = page_of(ensemble.exhibits_of(plain, NUMBERS))
    assert heads(html)[1:] == [one for k, one in enumerate(rest) if k not in (3, 4, 5, 7)]
    assert "lead" not in html.partition("<body>")[2]


def test_the_tables_of_the_page() -> None:
    rows = cells(page_of(exhibits()))
    assert rows[:6] == [
        ["", "CEP (95 % band)", "R95 (95 % band)"],
        ["horizontal error at 60 s, m", "4.50 (3.00 … 8.50)", "13.0 (10.0 … 17.0)"],
        ["horizontal error at the end, m", "42.0 (35.0 … 60.0)", "90.0 (75.0 … ∞)"],
        ["rate by the line Σ t r / Σ t², nmi/h", "0.270 (0.220 … 0.330)", "0.580 (0.480 … 0.730)"],
        ["rate at the end r(T) / T, nmi/h", "0.370 (0.320 … 0.430)", "0.680 (0.610 … 0.830)"],
        ["circle of a normal distribution with this covariance, m", "44.0", "95.5"],
    ]
    part = rows[6:16]
    assert part[0] == ["", "unit", "mean at the end", "σ at the end ± standard error", "rms over runs and epochs"]
    assert part[1] == ["position, north", "m", "−1.00", "2.00 ± 0.50", "3.00"]
    assert part[3] == ["position, down", "m", "−3.00", "6.0 ± 1.5", "9.00"]
    assert part[5] == ["velocity, east", "mm/s", "5.00", "10.00 ± 0.25", "20.0"]
    assert part[9] == ["attitude φ, down", "arcmin", "9.00", "18.00 ± 0.25", "36.0"]
    assert [row[0].partition(", ")[2] for row in part[1:]] == ["north", "east", "down"] * 3
    squares = ["", "mean over all epochs", "at the last epoch", "95 % band there", "epochs within the band"]
    assert rows[16:25] == [
        squares, ["attitude", "1.25", "0.750", "0.500 … 1.75", "88 %"],
        squares, ["gnss", "1.25", "3.50", "0.500 … 1.75", "–"],
        ["", "run", "rate Σ t r / Σ t², nmi/h", "final, m", "command for the complete run"],
        ["the &lt;worst&gt;", "3", "0.75", "52.2", "sinssim run &lt;3&gt;"],
        ["median", "2", "failed", "–", "sinssim run &lt;2&gt;"],
        ["run", "seed", "reason"], ["2", "1002", "it &lt;fell&gt; over."],
    ]  # fmt: skip
    assert rows[25:-2] == [["", "definition"], *([k, v] for k, v in DEFINITIONS.items())]
    assert rows[-1] == ["algorithms", "cayley", "0b5cb1e800cf…", "/home/me/cayley.py"]
    without = cells(page_of(exhibits(own_content=[])))
    assert without[-1] == rows[-3]


def test_lengths_in_the_unit_of_the_ensemble() -> None:
    table = ensemble._headline(NUMBERS, fixed("halves", 0.5))
    assert table.rows[1] == ["horizontal error at the end, halves", "84.0 (70.0 … 120)", "180 (150 … ∞)"]
    assert table.rows[-1][1:] == ["88.0", "191"]
    assert table.rows[-2][1] == "0.370 (0.320 … 0.430)"


def test_what_a_page_has_of_each_run() -> None:
    """All but the failed run 2, at every epoch; a radius that is not finite is none."""
    result: Any = Result()
    plain, (time, *errors) = ensemble._each_run(result)
    assert (plain["runs"], plain["seeds"], plain["all"]) == ([0, 1, 3, 4], ["1000", "1001", "1003", "1004"], 5)
    assert plain["commands"][2] == "sinssim run <3>"
    assert plain["radii"] == [[0.0, 4.5, 42.0], [0.0, 13.0, 90.0]]
    np.testing.assert_array_equal(time, TIME - 100.0)
    rows = [0, 1, 3, 4]
    np.testing.assert_array_equal(errors, [*NORTH[rows], *EAST[rows]])


def test_many_failed_runs_are_counted() -> None:
    many: Any = Result()
    many.failures = {k: f"reason {k}" for k in range(57)}
    html = page_of(ensemble.exhibits_of(many, NUMBERS))
    assert "and 7 more" in html
    assert ["49", "1049", "reason 49"] in cells(html)
    assert "reason 50" not in html
    many.failures = dict.fromkeys(range(1, 8), "It fell.") | {k: f"Reason {k}." for k in range(8, 14)}
    assert [one.text for one in ensemble._failures(many) if isinstance(one, Sentence)] == [
        "FAILED, runs 1, 2, 3, 4, 5 and 2 more: It fell.", "FAILED, run 8: Reason 8.", "FAILED, run 9: Reason 9.",
        "FAILED, run 10: Reason 10.", "FAILED, run 11: Reason 11.", "… and 2 other reasons; see the report.",
    ]  # fmt: skip


def test_the_regulation() -> None:
    assert ensemble.regulation(NUMBERS.part_121) == (
        "14 CFR Part 121: met, with 95 % confidence. Rate of all: 0.270 (0.220 … 0.330), limit 2.5; CEP: 1.50 (1.25 … "
        "1.75), limit 4."
    )
    for verdict, words in (
        ("not met", "not met, with 95 % confidence."),
        ("undecided", "undecided: the limit lies within the confidence interval; more runs narrow it."),
        ("does not apply", "it does not apply, because it is short."),
    ):
        part = Regulation("R", {}, verdict, "it is short")  # type: ignore[arg-type]
        assert ensemble.regulation(part) == f"R: {words}"


def test_what_the_ensemble_is_of() -> None:
    result: Any = Result()
    assert ensemble.opening(result, "interrupted") == (
        "Solution: aided. Seed 17. Each run lasts 300 s; its errors are kept at 3 epochs. Varied from run to run: "
        "imu.a, imu.b. R95 has no upper bound with fewer than 72 runs. 1 of 5 runs failed; their errors are treated as "
        "infinite. The ensemble was interrupted; the report shows the finished runs."
    )
    assert "The ensemble failed;" in ensemble.opening(result, "failed")
    result.failed[:] = False
    assert ensemble.opening(result, "finished").endswith("with fewer than 72 runs.")


def test_requirements_and_how_it_was_computed() -> None:
    text = read(page_of(exhibits(*ASKED)))
    assert "3 runs were computed in 12.3 s by this call." in text
    assert re.search(r"sinssim \S+, jsbsim \S+, .*, Python \S+, processor ", text)
    assert (
        "cep(60 s) &lt;= 30 m: met Radius of the circle that contains half of all runs, at 60 s, at most 30 m. It is "
        "met with 95 % confidence. In 5 runs it is 40.0 m at 60 s; the limit is 30 m."
    ) in text
    assert "r95(run) &lt;= 70 m: not met" in text
    assert "It is not met with 95 % confidence. In 5 runs the largest value is" in text
    assert "Percentiles are tested by the exact binomial interval" in text
    result: Any = Result(*ASKED)
    result.looks = (50, 100)
    section = next(ensemble._requirements(result))
    assert section.items[-1] == Sentence(ensemble._HOW + ensemble.looks_text(result), "note")
    assert "Tested after 50 and 100 runs." in ensemble.looks_text(result)
    assert "Requirements" not in read(page_of(exhibits()))


def test_the_console() -> None:
    """The table, the rule, the requirements, consistency, failures; the page's long parts are left out."""
    lines = printed(lambda console: show(exhibits(*ASKED[:1]), console))
    rule = ensemble.regulation(NUMBERS.part_121)
    result: Any = Result()
    assert lines == [
        "<trial>: 5 runs", ensemble.opening(result, "interrupted"), "Errors of the population",
        "CEP (95 % band) R95 (95 % band)",
        "horizontal error at 60 s, m 4.50 (3.00 … 8.50) 13.0 (10.0 … 17.0)",
        "horizontal error at the end, m 42.0 (35.0 … 60.0) 90.0 (75.0 … ∞)",
        "rate by the line Σ t r / Σ t², nmi/h 0.270 (0.220 … 0.330) 0.580 (0.480 … 0.730)",
        "rate at the end r(T) / T, nmi/h 0.370 (0.320 … 0.430) 0.680 (0.610 … 0.830)",
        "circle of a normal distribution with this covariance, m 44.0 95.5", rule,
        "cep(60 s) <= 30 m: met, with 95 % confidence. In 5 runs it is 40.0 m at 60 s; the limit is 30 m.",
        "The filter is consistent over 4 runs: the worst of 3 tests, NIS of gnss over all epochs, is 1.25, with the "
        "limit 1.75 for 1 % of false alarms in all tests together; p = 0.50 (χ², Bonferroni).",
        lines[12], "ANEES by block of states",
        "mean over all epochs at the last epoch 95 % band there epochs within the band",
        "attitude 1.25 0.750 0.500 … 1.75 88 %", "NIS by sensor",
        "mean over all epochs at the last epoch 95 % band there epochs within the band",
        "gnss 1.25 3.50 0.500 … 1.75 –", "FAILED, run 2: it <fell> over.",
    ]  # fmt: skip
    assert lines[12].startswith("Mean over the runs per degree of freedom")


def test_the_data_sheet() -> None:
    result: Any = Result(*ASKED[:1])
    rms = {
        "velocity_n_mps": 0.3, "velocity_e_mps": 0.4, "velocity_d_mps": 0.07, "attitude_n_rad": 180.0 * ARCMIN,
        "attitude_e_rad": 240.0 * ARCMIN, "attitude_d_rad": 15.0 * ARCMIN,
    }  # fmt: skip
    numbers = replace(NUMBERS, components={name: Component(0.0, 0.0, 0.0, value) for name, value in rms.items()})
    sheet = printed(lambda console: show(ensemble.sheet_of(result, numbers), console))
    assert sheet[0] == "Performance of tactical in <trial>, 5 runs"
    assert sheet[1:10] == [
        "quantity value definition",
        "position rate, CEP 0.270 (0.220 … 0.330) nmi/h Σ t r / Σ t², 50 % of the runs",
        "position rate, R95 0.580 (0.480 … 0.730) nmi/h Σ t r / Σ t², 95 % of the runs",
        "position rate, CEP 0.370 (0.320 … 0.430) nmi/h r(T) / T, 50 % of the runs",
        "position rate, R95 0.680 (0.610 … 0.830) nmi/h r(T) / T, 95 % of the runs",
        f"velocity, north and east {sqrt(0.125):.3f} m/s per axis, rms",
        "velocity, vertical 0.0700 m/s rms",
        f"roll and pitch {sqrt(12.5):.2f} ° tilt per axis, rms",
        "heading 0.250 ° rms",
    ]
    assert sheet[10] == ensemble.regulation(NUMBERS.part_121)
    assert sheet[11].startswith("cep(60 s) <= 30 m: met, with 95 % confidence.")
    assert sheet[12] == "Common terms: navigation grade 0.5 to 1 nmi/h CEP, tactical grade 10 to 20 nmi/h. Definitions:"
    assert sheet[13:] == [f"{name}: {text}." for name, text in DEFINITIONS.items()]
    assert DEFINITIONS["CEP, R95"].startswith("50th and 95th percentile of r over the runs")


def recorded(*verdicts: Any) -> Any:
    """Return what a recording has of the charts."""
    drawn: Any = Drawn()
    shown = exhibits(*verdicts)
    for charts in shown.charts():
        for chart in charts if "recording" in charts.on else ():
            if chart.x.label == "time":
                record_chart(drawn, f"ensemble/{chart.key}", chart, 100.0)
                drawn.texts[chart.key] = chart.unit(True)[0]
    return drawn


def test_growth_and_limits_in_a_recording() -> None:
    drawn = recorded(*ASKED)
    assert drawn.texts["growth"] == "m"
    values = [[0.0] * 6, [10.0, 17.0, 13.0, 3.0, 8.5, 4.5], [75.0, NONE, 90.0, 35.0, 60.0, 42.0]]
    names = ["R95, low", "R95, high", "R95", "CEP, low", "CEP, high", "CEP"]
    drawn.shows("ensemble/growth", names, TIME, values, [TINT_R95, TINT_R95, R95, TINT_CEP, TINT_CEP, CEP])
    # 60 s after the start at 100 s; 0.4 m/s over 300 s
    dots = {name: (one[0].tolist(), one[1].tolist(), one[2], one[3]) for name, one in drawn.dots.items()}
    assert dots.pop("ensemble/growth/limit_1") == ([160.0], [[30.0]], ["cep(60 s) <= 30 m: met"], MET)
    time, height, *_ = dots.pop("ensemble/growth/limit_2")
    np.testing.assert_allclose((time[0], height[0][0]), (400.0, 120.0))
    drawn.shows("ensemble/growth/limit_3", ["r95(run) <= 70 m: not met"], [100.0, 400.0], [[70.0], [70.0]], [NOT_MET])
    np.testing.assert_allclose(drawn.ranges["ensemble/growth"], (0.0, 120.0))


def test_sigma_by_component_and_consistency_in_a_recording() -> None:
    drawn = recorded(("position_east(end) <= 80 m", "met"), ("heading(60 s) <= 20 arcmin", "not met"))
    units = {key: text for key, text in drawn.texts.items() if key.startswith("sigma")}
    assert units == {"sigma_position": "m", "sigma_velocity": "mm/s", "sigma_attitude": "arcmin"}
    axes = ["north", "east", "down"]
    drawn.shows("ensemble/sigma_position", axes, TIME, [[0.0] * 3, [3.0, 7.0, 11.0], [30.0, 70.0, 110.0]])
    drawn.shows("ensemble/sigma_velocity", axes, TIME, [[NONE] * 3, [1.0, 2.0, 3.0], [10.0, 20.0, 40.0]])
    drawn.shows("ensemble/sigma_attitude", axes, TIME, [[0.5, 1.0, 9.0], [1.0, 2.0, 12.0], [2.0, 3.0, 15.0]])
    assert drawn.dots["ensemble/sigma_position/limit_1"][:2] == ([400.0], [[80.0]])
    time, height, names, color, *_ = drawn.dots["ensemble/sigma_attitude/limit_1"]
    np.testing.assert_allclose((time[0], height[0][0]), (160.0, 20.0))
    assert (names, color) == (["heading(60 s) <= 20 arcmin: not met"], NOT_MET)
    assert len(drawn.dots) == 2
    drawn.shows("ensemble/nees", ["attitude"], TIME, [[NONE], [1.25], [0.75]])
    drawn.shows("ensemble/nis", ["gnss"], TIME, [[2.0], [0.5], [1.5]])


def test_the_cloud_of_positions() -> None:
    """East to the right, north up, where the picture's y points down; failed runs are left out."""
    drawn: Any = Drawn()
    result: Any = Result()
    record_cloud(drawn, "ensemble/cloud", ensemble._cloud(result, fixed("halves", 0.5)), 100.0)
    time, parts = drawn.moving["ensemble/cloud/runs"]
    np.testing.assert_array_equal(time, TIME)
    frames = [np.array(frame).tolist() for frame in values_of(next(iter(parts)))]
    assert frames == [
        [[0.0, -0.0]] * 4, [[8.0, -6.0], [12.0, 8.0], [-24.0, -10.0]],
        [[-20.0, -60.0], [50.0, -40.0], [30.0, 100.0], [80.0, 20.0]],
    ]  # fmt: skip
    for key, radius in (("cep", [0.0, 9.0, 84.0]), ("r95", [0.0, 26.0, 180.0])):
        _, rings = drawn.moving[f"ensemble/cloud/{key}"]
        for ring, wanted in zip(values_of(next(iter(rings))), radius, strict=True):
            np.testing.assert_allclose(np.hypot(*np.squeeze(ring).T), wanted, rtol=1e-6, atol=1e-9)
    assert [values_of(drawn.fixed[f"ensemble/cloud/{key}"].colors)[0] >> 8 for key in ("cep", "r95", "runs")] == [
        0x009E73, 0x0072B2, 0x969696,
    ]  # fmt: skip
    radii = {key: values_of(drawn.fixed[f"ensemble/cloud/{key}"].radii) for key in ("runs", "cep", "r95", "axes")}
    points = {key: -value[0] for key, value in radii.items()}  # those in points of the screen are negative
    assert points == pytest.approx({"runs": 1.6, "cep": 1.2, "r95": 1.2, "axes": 0.5})
    words = drawn.fixed["ensemble/cloud/words"]
    assert values_of(words.labels) == ["east", "north"]
    np.testing.assert_allclose(values_of(words.positions), [[105.0, 0.0], [0.0, -105.0]], rtol=1e-6)
    cross = values_of(drawn.fixed["ensemble/cloud/axes"].strips)
    assert cross == [[[-100.0, 0.0], [100.0, 0.0]], [[0.0, -100.0], [0.0, 100.0]]]


def test_the_text_and_the_labels_of_a_recording() -> None:
    shown = exhibits()
    lines = markdown(shown).splitlines()
    assert lines[0] == "# <trial>: an ensemble of 5 runs"
    assert lines[2].startswith("Solution: aided. Seed 17.")
    at = lines.index("|  | CEP (95 % band) | R95 (95 % band) |")
    assert lines[at + 3] == "| horizontal error at the end, m | 42.0 (35.0 … 60.0) | 90.0 (75.0 … ∞) |"
    assert "| the <worst> | 3 | 0.75 | 52.2 | `sinssim run <3>` |" in lines
    assert "| 2 | 1002 | it <fell> over. |" in lines
    assert lines[-3:] == ["```", "name = 1", "```"]
    assert (shown.name, shown.kind, shown.span) == ("<trial> ensemble", "ensemble", (100.0, 400.0))
    assert shown.labels == {"runs": "5", "filter": "yes"}
    plain: Any = Result(filtered=False)
    assert ensemble.exhibits_of(plain, NUMBERS).labels["filter"] == ""


@pytest.mark.parametrize("status", ["finished", "interrupted"])
def test_the_files_of_an_ensemble(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: str) -> None:
    """The prediction is that of a finished ensemble alone; numbers that are not finite become null."""
    seen: list[Any] = []
    predicted = np.full((3, 9), 2.0)
    monkeypatch.setattr(files, "ensemble_numbers", lambda result, status: replace(NUMBERS, status=status))
    monkeypatch.setattr(files, "predicted_sigma", lambda plan: seen.append(plan) or predicted)
    result: Any = Result()
    names = files.write_ensemble(result, tmp_path, status)
    assert names == ["report.html", "summary.json", "recording.rrd", "ensemble.svg", "ensemble.png"]
    assert sorted(names) == sorted(file.name for file in tmp_path.iterdir())
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert ("σ predicted by the budget" in page, len(seen)) == ((True, 1) if status == "finished" else (False, 0))
    assert ("The ensemble was interrupted" in page) == (status == "interrupted")
    text = (tmp_path / "summary.json").read_text(encoding="utf-8")
    assert '"high": null' in text
    assert '"versions"' in text
