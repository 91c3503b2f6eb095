"""Whole pages: their sections in order, from stand-ins for the sections, and the sentences that they add themselves."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.exhibits import Sentence
from sinssim.experiments.run import run_report
from sinssim.experiments.run.parts import motion_source
from sinssim.experiments.run.parts.judged_outages import Outages
from sinssim.experiments.run.parts.motion_source import Log
from sinssim.experiments.studies import study_exhibits
from sinssim.experiments.studies.step_cost import Cost, Operations
from sinssim.experiments.studies.study_results import ErrorGrowth, Order, Pick, Row
from sinssim.recording.page import page_of, parts_of
from sinssim.simulation.truth_and_sensors import RecordedMotion
from tests.recording.spies import cells


def body(html: str) -> list[str]:
    """Return the lines of a page's body, without those of a script."""
    inside = html.partition("<body><main>\n")[2].removesuffix("\n</main></body></html>\n")
    return re.sub(r"\n<script>.*</script>", "", inside, flags=re.DOTALL).split("\n")


def stand_ins(monkeypatch: pytest.MonkeyPatch, module: Any, *names: str) -> None:
    """Replace functions by those that return their own name and arguments that are texts or numbers."""
    for name in names:

        def said(*given: Any, own: str = name, **further: Any) -> list[str]:
            plain = [one for one in (*given, *further.values()) if isinstance(one, str | float | tuple)]
            return [f"({own.strip('_')}{''.join(f' {one}' for one in plain)})"]

        monkeypatch.setattr(module, name, said)


def stand_in_items(monkeypatch: pytest.MonkeyPatch, module: Any, *names: str) -> None:
    """Replace functions by those that return a sentence with their name and arguments that are texts or tuples."""
    for name in names:

        def said(*given: Any, own: str = name, **further: Any) -> Any:
            plain = [one for one in (*given, *further.values()) if isinstance(one, str | float | tuple)]
            text = Sentence(f"({own.strip('_')}{''.join(f' {one}' for one in plain)})")
            return text if own in ("error_table", "note_on_errors", "computed_with") else [text]

        monkeypatch.setattr(module, name, said)


class Bridged(Outages):
    """Outages with chosen words."""

    def brief(self, algorithms: Any) -> Any:
        yield Sentence("(outage_sentence)")

    def exhibits(self) -> Any:
        yield Sentence("(outage_section)")


class Recorded(Log):
    """A recording with chosen words."""

    def exhibits(self) -> Any:
        yield Sentence("(recording)")


def log_run(aided: Any) -> Any:
    scenario = SimpleNamespace(
        name="drive <1>", description="From A\n to B.", imu=SimpleNamespace(rate_hz=200.0, grade="x/own unit.toml"),
        navigation=SimpleNamespace(frame="wander"), to_toml=lambda about: f"{about} = 1 < 2\n",
    )  # fmt: skip
    prepared = SimpleNamespace(log=None)
    navigated: Any = SimpleNamespace(time=np.array([50.0, 60.0, 650.0]), errors={},
                                     truth=RecordedMotion(prepared, None))  # type: ignore[arg-type]  # fmt: skip
    parts: dict[str, Any] = {"log": Recorded(navigated, entry=LOG)}
    if aided is not None:
        parts["outages"] = Bridged(navigated)
    motion: Any = Motion(prepared, None)  # type: ignore[arg-type]
    return SimpleNamespace(scenario=scenario, navigated=navigated, truth=motion, aided=aided, parts=parts,
                           about_filter="about")  # type: ignore[arg-type]  # fmt: skip


class Motion(RecordedMotion):
    """A recorded motion with chosen instants."""

    time = np.array([50.0, 60.0, 650.0])  # type: ignore[assignment]


FELL = {"time_s": None, "text": "it fell."}
LOG = {"compared_with": "ref.csv", "reference_file": "ref.csv", "knows": ["velocity"], "notes": ["Read <it>."]}


def log_summary(**more: Any) -> Any:
    return {"status": "finished", "start_s": 50.0, "end_s": 650.0, "log": LOG, "failures": {"euler": FELL},
            "algorithms": {"euler": {}, "poisson": {}}, "singularities": {}, "filter": {}, "flagged_samples": {},
            "timing": {}, **more}  # fmt: skip


def log_page(monkeypatch: pytest.MonkeyPatch, run: Any, of: Any) -> list[str]:
    for name in ("earth_of_the_navigator", "torquer_taken", "coarse_rates", "defaults_taken"):
        monkeypatch.setattr(run_report, name, lambda *_: ())
    monkeypatch.setattr(run_report, "sentences", lambda numbers: ())
    stand_in_items(monkeypatch, run_report, "error_table", "filter_exhibits", "after_filter", "computed_with")
    stand_in_items(monkeypatch, motion_source, "error_table", "error_exhibits", "note_on_errors")
    monkeypatch.setattr(motion_source, "best_solution", lambda *_: ("poisson", None))
    monkeypatch.setattr(motion_source, "rows_of", lambda *_: None)
    monkeypatch.setattr(motion_source, "schuler_period", lambda *_: None)
    return body(page_of(run_report.run_exhibits(run, of)))


def test_a_run_on_recorded_sensors(monkeypatch: pytest.MonkeyPatch) -> None:
    page = log_page(monkeypatch, log_run(SimpleNamespace(estimate=None)), log_summary(outages={}))
    said = [
        "<h1>drive &lt;1&gt;</h1>", '<p class="lead">From A<br>to B.<br></p>',
        "<p>Recorded sensors, 600 s at 200 Hz; the filter assumes the grade own unit with the changes in [imu]. "
        "Navigation in the frame “wander”.</p>",
        "<p>Read &lt;it&gt;.</p>",
        "<p>Errors are differences from the reference ref.csv; it has no attitude.</p>",
        "<p>(outage_sentence)</p>",
        "<h2>The recording</h2>", "<p>(recording)</p>",
        "<h2>Navigation errors</h2>", '<p class="broken"><strong>euler has no result.</strong> It fell.</p>',
        "<p>(error_table)</p>", "<p>(note_on_errors ref.csv)</p>", "<p>(error_exhibits)</p>",
        "<h2>Singular attitudes</h2>", "<p>No algorithm passed through a singular attitude.</p>",
        "<h2>The aided solution</h2>", "<p>(filter_exhibits (50.0, 650.0))</p>", "<p>(after_filter (50.0, 650.0))</p>",
        "<h2>Outages</h2>", "<p>(outage_section)</p>",
        "<h2>How the run was computed</h2>", "<p>(computed_with)</p>",
        "<h2>Scenario</h2>", "<pre>about = 1 &lt; 2</pre>",
    ]  # fmt: skip
    assert page == said
    # Without a filter, and with every solution failed: neither its section nor plots; without outages no section.
    both = {name: {"text": "it fell."} for name in ("euler", "poisson")}
    page = log_page(monkeypatch, log_run(None), log_summary(failures=both))
    failed = [said[9], said[9].replace("euler", "poisson")]
    assert page == [*said[:5], *said[6:9], *failed, *said[10:12], *said[13:15], *said[20:]]
    own = {"compared_with": "poisson", "reference_file": None, "knows": [], "notes": []}
    other = log_run(None)
    other.parts["log"].enter(own)
    page = log_page(monkeypatch, other, log_summary(log=own, failures={}, status="failed", message="No <fuel>."))
    assert page[2] == '<p class="broken"><strong>The run failed.</strong> No &lt;fuel&gt;.</p>'
    assert page[7:11] == ["<h2>Differences of the solutions</h2>", "<p>(error_table)</p>",
                          "<p>(note_on_errors poisson)</p>", "<p>(error_exhibits)</p>"]  # fmt: skip
    other.parts["log"].enter(own | {"compared_with": None})
    page = log_page(monkeypatch, other, log_summary(log=own | {"compared_with": None}, failures={}))
    assert page[6:8] == ["<h2>Differences of the solutions</h2>", "<h2>Singular attitudes</h2>"]


def row(algorithm: str, rate: float = 10.0, status: str = "done", part: str = "one", **more: Any) -> Row:
    return Row(part, "cone", "rate-gyros", "ideal", algorithm, "level", "normal", "exact", rate, (), "hold",
               status=status, **more)  # fmt: skip


def study_part(title: str, rates: tuple[float, ...] = (10.0,), **more: Any) -> Any:
    return SimpleNamespace(
        **{"title": title, "text": "", "schedules_hz": (), "rates_hz": rates, "decides": (), "sensors": ("ideal",),
           "variants": ("rate-gyros",), "coordinates": (), **more}
    )  # fmt: skip


def study_result(rows: list[Row], *parts: Any, **more: Any) -> Any:
    own = SimpleNamespace(name="All <of> them", description="What is\nbest?", seed=17, parts=parts,
                          block=lambda name: None)  # fmt: skip
    growth = ErrorGrowth(np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    return SimpleNamespace(
        **{"study": own, "rows": rows, "status": "finished", "seconds": 12.6, "verdicts": [], "picks": [],
           "orders": [], "headings": [], "of_part": lambda title: [r for r in rows if r.part == title],
           "coordinate_errors": [], "costs": {}, "attitude_costs": [], "motions": {}, "histories": {},
           "history": lambda row: growth, **more}
    )  # fmt: skip


@pytest.fixture
def names(monkeypatch: pytest.MonkeyPatch) -> None:
    """Charts and drawings are shown by their names."""
    monkeypatch.setattr("sinssim.recording.page.html_of", lambda charts: f"({charts.key})")
    monkeypatch.setattr(study_exhibits, "three_rates", lambda: "(rates)")


def pieces(html: list[str]) -> list[str]:
    """Return pieces of HTML, each table by its first row, the paragraphs of notes left out."""
    return [
        "table " + ", ".join(cells(one)[0]) if one.startswith('<div class="wide">') else one
        for one in html
        if not one.startswith('<p class="note">')
    ]


def test_a_study(names: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        study_exhibits.charts, "one_draw", lambda part, study: "One & draw." if part.title == "two" else ""
    )
    rows = [row("poisson"), row("euler", part="two"), row("euler", 20.0, part="two")]
    parts = (study_part("one", text="See <it>."), study_part("two", schedules_hz=((1.0, 2.0, 4.0),)),
             study_part("three"))  # fmt: skip
    result = study_result(rows, *parts, picks=[Pick("one", "ideal", "rate-gyros", "poisson", "Why.")])
    monkeypatch.setattr(study_exhibits, "_cases", lambda rows, on: Sentence(f"(cases {len(rows)})"))
    page = page_of(study_exhibits.exhibits_of(result))
    assert "<title>All &lt;of&gt; them</title>" in page
    shown = body(page)
    assert shown[:3] == ["<h1>All &lt;of&gt; them</h1>", '<p class="lead">What is best?</p>',
                         '<p class="note">3 navigations in 13 s, seed 17.</p>']  # fmt: skip
    order = [line for line in shown if line.startswith(("<h", "<p>", "("))]
    assert order[1:] == [
        "<h2>Recommended engines</h2>",
        "<h2>1. one</h2>", "<p>See &lt;it&gt;.</p>", "(bars)", "<h3>Growth of the position error</h3>", "(grow)",
        "<p>(cases 1)</p>",
        "<h2>2. two</h2>", "(rates)", "(bars)", "<h3>Growth of the position error</h3>", "(grow)", "<p>(cases 2)</p>",
        "<p><strong>One &amp; draw.</strong></p>",
        "<h2>3. three</h2>", "<p>Not reached.</p>",
        "<h2>Cost of a step</h2>", "<h3>Whole navigation</h3>", "(costs)", "<h2>Motions</h2>",
        "<h2>How it was measured</h2>", f"<p>{study_exhibits._METHOD}</p>",
    ]  # fmt: skip
    for status, words in (("interrupted", "was interrupted"), ("failed", "failed")):
        result = study_result(rows[:1], study_part("one"), status=status)
        assert body(page_of(study_exhibits.exhibits_of(result)))[2:5] == [
            '<p class="note">1 navigation in 13 s, seed 17.</p>',
            f"<p><strong>The study {words}; the report shows the finished cases.</strong></p>", "<h2>1. one</h2>",
        ]  # fmt: skip


def test_a_part_over_rates(names: None) -> None:
    rows = [row("euler", rate, max_attitude_error_arcsec=1.0, max_horizontal_error_m=2.0, max_defect=defect,
                ns_per_step=100.0)
            for rate, defect in ((10.0, 0.0), (20.0, 1e-12), (40.0, 0.0))]  # fmt: skip
    rows.append(row("poisson", 40.0, status="failed", message="It <fell>."))
    rows.append(row("euler", 80.0, status="failed", message="It <fell>."))
    rows.append(row("dcm", 80.0, status="failed", message="Late.", passages=2))
    part = study_part("one", (10.0, 20.0, 40.0, 80.0))
    order = Order("one", "cone", "euler", "max_attitude_error_arcsec", 2.0, 0.25, 4, 10.0, 40.0)
    paint = dict.fromkeys(("euler", "poisson", "dcm"), "#123456")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_exhibits, "_guarantees", lambda *_: [Sentence("(guarantees)")])
        items = [*study_exhibits._part(study_result(rows, part, orders=[order]), part, paint)]
    shown = pieces([*parts_of(items, 3)])
    unfolded = [line.partition('<div class="wide">')[0] for line in shown]
    assert unfolded == [
        "<h3>Accuracy against rate</h3>", "(rate)",
        "<h3>Accuracy against cost</h3>", "(cost)",
        "<details open><summary>cone: largest attitude error, ″</summary>",
        "<details><summary>cone: largest horizontal error, m</summary>",
        "<h3>Order of convergence</h3>", "(orders)", "table , cone: attitude, cone: position",
        "<h3>Loss of norm or orthogonality</h3>", "(defect)", "<p>(guarantees)</p>",
        "<h3>Passages through the singular attitude</h3>",
        "table , motion, rate, Hz, passages, largest damage, ′, horizontal max, m, event",
        "<h3>Failed navigations</h3>",
        "<ul><li><strong>cone · poisson · 40 Hz; cone · euler · 80 Hz</strong>: It &lt;fell&gt;.</li>"
        "<li><strong>cone · dcm · 80 Hz</strong>: Late.</li></ul>",
    ]  # fmt: skip
    assert all(cells(line)[0] == ["", "10 Hz", "20 Hz", "40 Hz", "80 Hz"] for line in shown[4:6])


def test_costs(names: None) -> None:
    """2500 ns a step are 0.40 million steps a second; at 40 Hz 100 µs a second of motion."""
    operations = Operations(10.0, 20.0, 3.25, 4.5, 5.75)
    costs = [Cost("euler", "level", 2500.0, operations, (40.0, 20.0, 5.0)), Cost("dcm", "ned", 312.5, operations)]
    shown = [*parts_of(study_exhibits._costs(study_result([], costs=dict(enumerate(costs)))), 3)]
    assert shown[2] == "(costs)"
    counted = ["10", "20", "3.2", "4.5", "5.8", "176"]
    assert cells(shown[3]) == [
        ["algorithm", "frame", "rates, Hz", "+ −", "×", "÷", "√", "sin, cos, …", "all", "ns per step",
         "million steps/s", "µs per s of motion"],
        ["euler", "level", "40/20/5", *counted, "2500", "0.40", "100.0"],
        ["dcm", "ned", "every sample", *counted, "312", "3.20", "–"],
    ]  # fmt: skip


def test_how_a_study_was_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_exhibits, "software", lambda: "sinssim 1.2, processor a <b>")
    page = page_of(study_exhibits.exhibits_of(study_result([])))
    assert '<p class="note">sinssim 1.2, processor a &lt;b&gt;.</p>' in page
