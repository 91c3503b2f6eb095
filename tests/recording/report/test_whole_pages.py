"""Whole pages: their sections in order, from stand-ins for the sections, and the sentences that they add themselves."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.exhibits import Sentence
from sinssim.experiments.run import run_report
from sinssim.experiments.run.parts.recorded_sensors import Log, Outages
from sinssim.experiments.studies import study_exhibits
from sinssim.experiments.studies.step_cost import Cost, Operations
from sinssim.experiments.studies.study_results import Order, Row
from sinssim.simulation.truth_stage import RecordedMotion
from tests.recording.spies import cells


def body(html: str) -> list[str]:
    """Return the lines of a page's body."""
    return html.partition("<body>\n")[2].removesuffix("\n</body></html>\n").split("\n")


def stand_ins(monkeypatch: pytest.MonkeyPatch, module: Any, *names: str) -> None:
    """Replace functions by those that return their own name and arguments that are texts or numbers."""
    for name in names:

        def said(*given: Any, own: str = name, **further: Any) -> list[str]:
            plain = [one for one in (*given, *further.values()) if isinstance(one, str | float | tuple)]
            return [f"({own.strip('_')}{''.join(f' {one}' for one in plain)})"]

        monkeypatch.setattr(module, name, said)


class Bridged(Outages):
    """Outages with chosen words."""

    def brief(self, algorithms: Any) -> Any:
        yield Sentence("(outage_sentence)")

    def exhibits(self) -> Any:
        yield Sentence("(outage_section)")


def log_run(aided: Any) -> Any:
    scenario = SimpleNamespace(
        name="drive <1>", description="From A\n to B.", imu=SimpleNamespace(rate_hz=200.0, grade="x/own unit.toml"),
        navigation=SimpleNamespace(frame="wander"), to_toml=lambda about: f"{about} = 1 < 2\n",
    )  # fmt: skip
    prepared = SimpleNamespace(log=None)
    navigated: Any = SimpleNamespace(time=np.array([50.0, 60.0, 650.0]), errors={},
                                     truth=RecordedMotion(prepared, None))  # type: ignore[arg-type]  # fmt: skip
    parts: dict[str, Any] = {"log": Log(navigated, entry=LOG)}
    if aided is not None:
        parts["outages"] = Bridged(navigated)
    return SimpleNamespace(scenario=scenario, navigated=navigated, aided=aided, parts=parts, about_filter="about")


LOG = {"compared_with": "ref.csv", "reference_file": "ref.csv", "knows": ["velocity"], "notes": ["Read <it>."]}
LOG_PARTS = ("_recording", "error_tables", "error_plots", "_schuler", "singularity_table", "filter_section",
             "_uncertainty_of_reference", "_estimates", "made", "failure", "_known", "Compared")  # fmt: skip


def log_summary(**more: Any) -> dict[str, Any]:
    return {"status": "finished", "start_s": 50.0, "end_s": 650.0, "log": LOG, "failures": {"euler": "It fell."},
            "algorithms": {"euler": {}, "poisson": {}}, "singularities": [], "filter": {}, **more}  # fmt: skip


def test_a_run_on_recorded_sensors(monkeypatch: pytest.MonkeyPatch) -> None:
    stand_ins(monkeypatch, run_report, *LOG_PARTS)
    monkeypatch.setattr(run_report, "failure", lambda item: f"({item[0]}: {item[1]})")
    monkeypatch.setattr(run_report, "singularity_table", lambda events: f"({len(events)} events)")
    page = run_report.log_report(log_run(SimpleNamespace(estimate=None)), log_summary(outages={}))
    assert "<title>drive &lt;1&gt;: run</title>" in page
    said = [
        "<h1>drive &lt;1&gt;</h1>", '<p class="lead">From A to B.</p>',
        "<p>Recorded sensors, 600 s at 200 Hz; the filter assumes the grade own unit with the changes in [imu]. "
        "Navigation in the frame “wander”.</p>",
        "<p>Read &lt;it&gt;.</p>",
        "<p>Errors are differences from the reference ref.csv; it has no attitude.</p>",
        "<p>(outage_sentence)</p>",
        "<h2>The recording</h2>", "(recording (50.0, 650.0))",
        "<h2>Navigation errors</h2>", "(euler: It fell.)", "(error_tables ref.csv)", "(error_plots)",
        "<h2>Singular attitudes</h2>", "(0 events)",
        "<h2>The aided solution</h2>", "(filter_section (50.0, 650.0))",
        "(uncertainty_of_reference (50.0, 650.0))", "(estimates (50.0, 650.0))",
        "<h2>Outages</h2>", "<p>(outage_section)</p>",
        "<h2>How the run was computed</h2>", "(made)",
        "<h2>Scenario</h2>", "<pre>about = 1 &lt; 2</pre>",
    ]  # fmt: skip
    assert body(page) == said
    # Without a filter, and with every solution failed: neither its section nor plots; without outages no section.
    page = run_report.log_report(log_run(None), log_summary(failures={"euler": "a", "poisson": "b"}))
    left = [*said[:5], *said[6:9], "(euler: a)", "(poisson: b)", said[10], *said[12:14], *said[20:]]
    assert body(page) == left
    own = {"compared_with": "poisson", "reference_file": None, "knows": [], "notes": []}
    other = log_run(None)
    other.parts["log"].enter(own)
    page = run_report.log_report(other, log_summary(log=own, failures={}, status="failed", message="No <fuel>."))
    assert body(page)[2] == '<p class="broken"><strong>The run failed.</strong> No &lt;fuel&gt;.</p>'
    assert body(page)[6:10] == ["(recording (50.0, 650.0))", "<h2>Differences of the solutions</h2>",
                                "(error_tables poisson)", "(error_plots)"]  # fmt: skip
    other.parts["log"].enter(own | {"compared_with": None})
    page = run_report.log_report(other, log_summary(log=own | {"compared_with": None}, failures={}))
    assert body(page)[5:8] == ["(recording (50.0, 650.0))", "<h2>Differences of the solutions</h2>",
                               "<h2>Singular attitudes</h2>"]  # fmt: skip


def row(algorithm: str, rate: float = 10.0, status: str = "done", part: str = "one", **more: Any) -> Row:
    return Row(part, "cone", "rate-gyros", "ideal", algorithm, "level", "normal", "exact", rate, (), "hold",
               status=status, **more)  # fmt: skip


def study_part(title: str, rates: tuple[float, ...] = (10.0,), **more: Any) -> Any:
    return SimpleNamespace(**{"title": title, "text": "", "schedules_hz": (), "rates_hz": rates, "decides": (),
                              "sensors": ("ideal",), "variants": ("rate-gyros",), **more})  # fmt: skip


def study_result(rows: list[Row], *parts: Any, **more: Any) -> Any:
    own = SimpleNamespace(name="All <of> them", description="What is\nbest?", seed=17, parts=parts,
                          block=lambda name: None)  # fmt: skip
    return SimpleNamespace(
        **{"study": own, "rows": rows, "status": "finished", "seconds": 12.6, "verdicts": [], "picks": [],
           "orders": [], "headings": [], "of_part": lambda title: [r for r in rows if r.part == title], **more}
    )  # fmt: skip


def test_a_study(monkeypatch: pytest.MonkeyPatch) -> None:
    stand_ins(monkeypatch, study_exhibits, "_part", "_costs")
    for name in ("_verdicts", "_picks", "_motions", "_method"):
        monkeypatch.setattr(study_exhibits, name, lambda *_, own=name: f"({own.strip('_')})")
    monkeypatch.setattr(study_exhibits, "to_svg", lambda figure, name: f"({figure}: {name})")
    monkeypatch.setattr(study_exhibits, "three_rates", lambda: "three rates")
    monkeypatch.setattr(study_exhibits.figures, "palette", lambda comparison: {})
    monkeypatch.setattr(study_exhibits, "one_draw", lambda part, study: "One & draw." if part.title == "two" else "")
    rows = [row("poisson"), row("euler", part="two"), row("euler", 20.0, part="two")]
    parts = (study_part("one", text="See <it>."), study_part("two", schedules_hz=((1.0, 2.0, 4.0),)),
             study_part("three"))  # fmt: skip
    found = study_result(rows, *parts, verdicts=[1], picks=[2])
    page = study_exhibits.html_report(found, {})
    assert "<title>All &lt;of&gt; them: comparison</title>" in page
    said = [
        "<h1>All &lt;of&gt; them</h1>", '<p class="lead">What is best?</p>',
        '<p class="note">3 navigations in 13 s, seed 17.</p>',
        "<h2>Claims and verdicts</h2>", "(verdicts)", "<h2>Recommended engines</h2>", "(picks)",
        "<h2>1. one</h2>", "<p>See &lt;it&gt;.</p>", "(part)",
        "<h2>2. two</h2>", '<p class="note"><strong>One &amp; draw.</strong></p>', "(three rates: rates2)",
        "(part)",
        "<h2>3. three</h2>", "<p>Not reached.</p>",
        "<h2>Cost of a step</h2>", "(costs)", "<h2>Motions</h2>", "(motions)", "<h2>How it was measured</h2>",
        "(method)",
    ]  # fmt: skip
    assert body(page) == said
    for status, words in (("interrupted", "was interrupted"), ("failed", "failed")):
        found = study_result(rows[:1], study_part("one"), status=status)
        assert body(study_exhibits.html_report(found, {}))[2:4] == [
            f'<p class="note">1 navigation in 13 s, seed 17. <strong>The study {words}; the report shows the finished '
            "cases.</strong></p>", "<h2>1. one</h2>",
        ]  # fmt: skip


DRAWN = ("against_rate", "against_cost", "defect_against_rate", "bars", "growth", "orders")


def names_of(body: list[str]) -> list[str]:
    """Return pieces of HTML, each table by its first row, the paragraphs of notes left out."""
    return [
        "table " + ", ".join(cells(one)[0]) if one.startswith('<div class="wide">') else one
        for one in body
        if not one.startswith("<p class=note>")
    ]


def test_a_part_over_rates(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in DRAWN:
        monkeypatch.setattr(study_exhibits.figures, name, lambda rows, *_, own=name: f"{own} of {len(rows)}")
    monkeypatch.setattr(study_exhibits, "html_of", lambda charts: f"({charts})")
    stand_ins(monkeypatch, study_exhibits, "coordinate_tables")
    stand_ins(monkeypatch, study_exhibits.study_laws, "turning", "power_of_time")
    monkeypatch.setattr(study_exhibits.study_laws, "guarantees", lambda *_: "(guarantees)")
    rows = [row("euler", rate, max_attitude_error_arcsec=1.0, max_horizontal_error_m=2.0, max_defect=defect)
            for rate, defect in ((10.0, 0.0), (20.0, 1e-12), (40.0, 0.0))]  # fmt: skip
    rows.append(row("poisson", 40.0, status="failed", message="It <fell>."))
    rows.append(row("euler", 80.0, status="failed", message="It <fell>."))
    rows.append(row("dcm", 80.0, status="failed", message="Late.", passages=2))
    part = study_part("one", (10.0, 20.0, 40.0, 80.0))
    order = Order("one", "cone", "euler", "max_attitude_error_arcsec", 2.0, 0.25, 4, 10.0, 40.0)
    found = study_exhibits._part(study_result(rows, part, orders=[order]), part, rows, dict.fromkeys(
        ("euler", "poisson", "dcm"), "#123456"))  # fmt: skip
    pivot = "10 Hz, 20 Hz, 40 Hz, 80 Hz"
    assert names_of(found) == [
        "<h3>Accuracy against rate</h3>", "(against_rate of 6)",
        "<h3>Accuracy against cost</h3>", "(against_cost of 6)",
        "<details open><summary>Largest attitude error, ″: cone</summary>", "table , " + pivot,
        "<details><summary>Largest horizontal error, m: cone</summary>", "table , " + pivot,
        "<h3>Order of convergence</h3>", "(orders of 1)", "table , cone: attitude, cone: position",
        "<h3>Loss of norm or orthogonality</h3>", "(defect_against_rate of 6)", "(guarantees)",
        "(coordinate_tables)", "(turning)", "(power_of_time)",
        "<h3>Passages through the singular attitude</h3>",
        "table , motion, rate, Hz, passages, largest damage, ′, horizontal max, m, event",
        "<h3>Failed navigations</h3><ul>",
        "<li><strong>cone · poisson · 40 Hz; cone · euler · 80 Hz</strong>: It &lt;fell&gt;.</li>",
        "<li><strong>cone · dcm · 80 Hz</strong>: Late.</li>", "</ul>",
    ]  # fmt: skip


def test_costs(monkeypatch: pytest.MonkeyPatch) -> None:
    """2500 ns a step are 0.40 million steps a second; at 40 Hz 100 µs a second of motion."""
    monkeypatch.setattr(study_exhibits, "html_of", lambda charts: f"({charts})")
    monkeypatch.setattr(study_exhibits.figures, "costs", lambda comparison: "drawn")
    operations = Operations(10.0, 20.0, 3.25, 4.5, 5.75)
    costs = [Cost("euler", "level", 2500.0, operations, (40.0, 20.0, 5.0)), Cost("dcm", "ned", 312.5, operations)]
    found = study_exhibits._costs(study_result([], costs=dict(enumerate(costs)), attitude_costs=[]))
    assert found[2] == "(drawn)"
    counted = ["10", "20", "3.2", "4.5", "5.8", "176"]
    assert cells(found[3]) == [
        ["algorithm", "frame", "rates, Hz", "+ −", "×", "÷", "√", "sin, cos, …", "all", "ns per step",
         "million steps/s", "µs per s of motion"],
        ["euler", "level", "40/20/5", *counted, "2500", "0.40", "100.0"],
        ["dcm", "ned", "every sample", *counted, "312", "3.20", "–"],
    ]  # fmt: skip


def test_how_a_study_was_measured() -> None:
    said = study_exhibits._method(study_result([]), {"sinssim": "1.2", "processor": "a <b>"})
    assert said.endswith("<p class=note>sinssim 1.2, processor a &lt;b&gt;.</p>")
