"""The tables of a study's report from rows that are written down."""

from __future__ import annotations

from math import nan
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.experiments.studies import study_charts as laws
from sinssim.experiments.studies import study_exhibits as report
from sinssim.experiments.studies.attitude_cost import AttitudeCost
from sinssim.experiments.studies.step_cost import Operations
from sinssim.experiments.studies.study_results import ErrorGrowth, Heading, Order, Pick, Row
from sinssim.experiments.studies.study_schema import MotionFacts
from sinssim.recording.page import parts_of
from tests.recording.spies import cells, read


def page(*items: Any) -> str:
    """Return exhibits as HTML."""
    return "".join(parts_of(items, 3))


@pytest.fixture(autouse=True)
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Stand-in for what draws charts; it keeps them."""
    found: list[Any] = []
    monkeypatch.setattr("sinssim.recording.page.html_of", lambda charts: found.append(charts) or "")
    return found


def row(algorithm: str, rate: float, motion: str = "turn", **more: Any) -> Row:
    values = {"part": "p", "motion": motion, "variant": "", "sensors": "ideal", "frame": "level", "gravity": "normal",
              "curvature": "exact", "schedule_hz": (), "slow": "hold"}  # fmt: skip
    return Row(**{**values, "algorithm": algorithm, "rate_hz": rate, **more})


PAINT = {"poisson": "#111111", "euler": "#222222"}


def label(one: Row) -> str:
    return one.algorithm


def test_errors_over_rates() -> None:
    """The smallest value is the deepest green, 0.45; a decade of three above it has two thirds of that."""
    rows = [
        row("poisson", 100.0, max_attitude_error_arcsec=0.02), row("poisson", 25.0, max_attitude_error_arcsec=20.0),
        row("euler", 100.0, max_attitude_error_arcsec=0.2), row("euler", 50.0, max_attitude_error_arcsec=nan),
    ]  # fmt: skip
    html = page(report._against_rates(rows, "max_attitude_error_arcsec", label, PAINT))
    assert cells(html) == [
        ["", "25 Hz", "50 Hz", "100 Hz"], ["poisson", "20.0", "–", "0.0200"], ["euler", "–", "–", "0.200"],
    ]  # fmt: skip
    for alpha, text in (("0.45", "0.0200"), ("0.00", "20.0"), ("0.30", "0.200")):
        assert f'<td style="background:rgba(0,158,115,{alpha})">{text}</td>' in html
    assert html.index("#111111") < html.index("poisson") < html.index("#222222") < html.index("euler")


def test_orders_of_convergence(drawn: list[Any]) -> None:
    def order(algorithm: str, quantity: str, value: float, motion: str = "turn", part: str = "p") -> Order:
        return Order(part, motion, algorithm, quantity, value, 0.125, 4, 10.0, 80.0)

    attitude, position = report.ERRORS
    study: Any = SimpleNamespace(
        orders=[order("poisson", attitude, 4.25), order("poisson", position, 3.5), order("euler", attitude, 2.0),
                order("euler", position, 1.5, "coning"), order("euler", attitude, 9.0, part="other")],
        of_part=lambda title: [row("poisson", 10.0), row("euler", 10.0), row("poisson", 20.0)],
    )  # fmt: skip
    html = page(*report._orders(study, SimpleNamespace(title="p")))  # type: ignore[arg-type]
    assert cells(html) == [
        ["", "turn: attitude", "turn: position", "coning: attitude", "coning: position"],
        ["poisson", "4.25 ± 0.12", "3.50 ± 0.12", "–", "–"], ["euler", "2.00 ± 0.12", "–", "–", "1.50 ± 0.12"],
    ]  # fmt: skip
    assert [len(chart.marks[0].x) for charts in drawn for chart in charts] == [2]


def test_the_long_table() -> None:
    numbers = {
        "max_horizontal_error_m": 12.5, "final_horizontal_error_m": 7.5, "max_velocity_error_mps": 0.25,
        "max_attitude_error_arcsec": 3.5, "final_attitude_error_arcsec": 1.75, "max_defect": 2e-9,
    }  # fmt: skip
    rows = [row("poisson", 50.0, **numbers), row("euler", 25.0, "climb", status="failed")]
    heads, first, second = cells(page(report._cases(rows, ("page",))))
    assert heads == ["motion", "algorithm", "rate, Hz", "horizontal max, m", "final, m", "velocity max, m/s",
                     "attitude max, ″", "final, ″", "defect max"]  # fmt: skip
    assert first == ["turn", "poisson", "50", "12.5", "7.50", "0.250", "3.50", "1.75", "2.00e-09"]
    assert second == ["climb", "euler", "25", *["failed"] * 6]


def test_passages() -> None:
    passed = row("euler", 50.0, passages=3, max_damage_arcsec=90.0, max_horizontal_error_m=4.5, message="through <90>°")
    assert cells(page(*report._passages([passed, row("euler", 50.0)]))) == [
        ["", "motion", "rate, Hz", "passages", "largest damage, ′", "horizontal max, m", "event"],
        ["euler", "turn", "50", "3", "1.50", "4.50", "through &lt;90&gt;°"],
    ]


def test_costs_of_the_attitude() -> None:
    """A function counts as 24 operations: 10 + 20 + 3.25 + 4.5 + 24 · 5.75 = 175.75."""
    cost = AttitudeCost(
        "euler", True, 12.34, Operations(10.0, 20.0, 3.25, 4.5, 5.75), Operations(1.0, 2.0, 0.0, 0.0, 6.0)
    )
    study: Any = SimpleNamespace(attitude_costs=[cost], costs={})
    assert cells(page(list(report._costs(study))[1])) == [
        ["algorithm", "+ −", "×", "÷", "√", "sin, cos, …", "all", "of these, B", "sin, cos of B", "ns per step"],
        ["euler, B by sines and cosines", "10", "20", "3.2", "4.5", "5.8", "176", "147", "6", "12.3"],
    ]


def test_motions() -> None:
    facts = MotionFacts(600.0, 12_345.0, 1.2345, 74.07, 5.678, 33.33, 51.234)
    study: Any = SimpleNamespace(motions={("a", "turn"): facts, ("b", "turn"): facts})
    assert cells(page(report._motions(study))) == [
        ["", "duration, s", "distance, km", "mean ground speed, km/h", "largest rate, deg/s", "steepest pitch, deg",
         "latitude rate, deg/h", "largest latitude, deg"],
        ["turn", "600", "12.3", "74.1", "5.68", "33.3", "1.234", "51.23"],
    ]  # fmt: skip


def test_verdicts_and_picks() -> None:
    verdict: Any = SimpleNamespace(
        title="a <claim>", sentence="it <holds>.", verdict="partly", reason="Because.", measured="3 m", expected="",
        lines=(("one", "confirmed"), ("two & three", "")),
    )  # fmt: skip
    pick = Pick("p & q", "tactical", "platform", "", "None <qualifies>.")
    other = Pick("r", "ideal", "rate-gyros", "euler at 10 Hz", "It is cheap.")
    html = page(report._verdicts([verdict]))
    assert cells(html) == [
        ["claim", "verdict", "measured", "expected"], ["a &lt;claim&gt;", "partly", "3 m", "–"],
    ]  # fmt: skip
    assert '<h4>It &lt;holds&gt;.: <span class="partly">partly</span></h4><p>Because.</p>' in html
    assert '<li><span class="met">confirmed</span>: one</li><li>two &amp; three</li>' in html
    assert cells(page(report._picks([pick, other]))) == [
        ["part", "sensors", "recommended engine", "the numbers that decide"],
        ["p &amp; q", "tactical, platform", "None &lt;qualifies&gt;.", ""],
        ["r", "ideal", "euler at 10 Hz", "It is cheap."],
    ]


def heading(motion: str, rate: float, **more: Any) -> Heading:
    values = {"part": "p", "form": "two <args>", "turns": 2.25, "max_error_arcsec": 7200.0, "final_error_arcsec": -45.0,
              "jumps": 3, "wrong": 0.375, "least_hz": 0.0, "time": np.zeros(1), "heading": np.zeros(1),
              "truth": np.zeros(1)}  # fmt: skip
    return Heading(**{**values, "motion": motion, "rate_hz": rate, **more})


def test_headings_through_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """From a degree on, errors are in degrees; each motion is drawn at its highest rate."""
    shown: list[Any] = []
    monkeypatch.setattr(report.charts, "turning", lambda headings: shown.extend(headings) or SimpleNamespace(on=()))
    found = [heading("turn", 10.0), heading("turn", 50.0, least_hz=1.25), heading("climb", 20.0, part="other"),
             heading("loop", 5.0, wrong=0.0)]  # fmt: skip
    study: Any = SimpleNamespace(headings=found)
    part: Any = SimpleNamespace(title="p")
    html = page(*report._headings(study, part))
    own = ["2.25", "2.00°", "-45.0″", "3", "38 %"]
    assert cells(html) == [
        ["motion", "form", "rate, Hz", "turns", "error max", "final", "jumps", "wrong by &gt; 0.3′",
         "lowest rate of reading, Hz"],
        ["turn", "two &lt;args&gt;", "10", *own, "any"], ["turn", "two &lt;args&gt;", "50", *own, "1.2"],
        ["loop", "two &lt;args&gt;", "5", *own[:-1], "0 %", "any"],
    ]  # fmt: skip
    assert [(h.motion, h.rate_hz) for h in shown] == [("turn", 50.0), ("loop", 5.0)]
    assert not [*report._headings(study, SimpleNamespace(title="q"))]  # type: ignore[arg-type]
    assert (report._angle(3599.0), report._angle(-3600.0)) == ("3599″", "-1.00°")


def test_blocks_without_gyros() -> None:
    """The arm is the number in the variant's name; ideal sensors and other variants are left out."""
    growth = ErrorGrowth(np.zeros(2), np.zeros(2), np.zeros(2))
    rows = [
        row("poisson", 50.0, variant="six-accelerometers-0.25m", sensors="tactical"),
        row("poisson", 50.0, variant="six-accelerometers-2m", sensors="ideal"),
        row("poisson", 50.0, variant="gyros", sensors="tactical"),
    ]  # fmt: skip
    study: Any = SimpleNamespace(of_part=lambda title: rows, history_or_none=lambda one: growth)
    one: Any = SimpleNamespace(title="p", motions=("a",))
    assert laws.gyro_free_blocks(study, one) == {"tactical, arms of 0.25m": (growth, 0.25)}
    one.motions = ("a", "b")
    assert list(laws.gyro_free_blocks(study, one)) == ["turn, tactical, arms of 0.25m"]


def test_what_each_algorithm_keeps(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = SimpleNamespace(condition="|q| = 1", words="to <h³>", reason="why & how")
    monkeypatch.setattr(report, "guarantee", lambda algorithm: kept)
    orders = [Order("p", "turn", "poisson", report.DEFECT, 3.25, 0.5, 4, 1.0, 9.0),
              Order("p", "turn", "poisson", "other", 9.0, 0.5, 4, 1.0, 9.0),
              Order("q", "turn", "poisson", report.DEFECT, 8.0, 0.5, 4, 1.0, 9.0)]  # fmt: skip
    rows = [row("poisson", 10.0, max_defect=2.5e-7), row("poisson", 20.0, "loop", max_defect=1e-8),
            row("poisson", 30.0, max_defect=9.0, status="failed")]  # fmt: skip
    html = page(*report._guarantees(SimpleNamespace(orders=orders), SimpleNamespace(title="p"), rows))  # type: ignore[arg-type]
    assert cells(html) == [
        ["", "condition", "kept", "why", "order: turn", "order: loop", "largest defect"],
        ["poisson", "|q| = 1", "to &lt;h³&gt;", "why &amp; how", "3.25 ± 0.50", "–", "2.5e-07"],
    ]
    assert "largest defect" in read(html)
