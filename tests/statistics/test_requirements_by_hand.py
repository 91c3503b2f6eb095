"""Requirements and verdicts with every number written down from its definition."""

from __future__ import annotations

from math import inf, nan, pi

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.statistics.requirements import (
    CIRCLES,
    COMPONENTS,
    QUANTITIES,
    SHARES,
    Exceeded,
    Quantity,
    Requirement,
    Verdict,
    columns_of,
    errors_of,
    first_exceeded,
    parse_quantity,
    parse_requirement,
    parse_requirements,
    quantity_of,
    tally,
    verdict_of,
)
from tests.statistics.verdicts import verdict

RMS = "root mean square over all runs of the "


@pytest.mark.parametrize(
    ("name", "unit", "size", "column", "meaning", "places"),
    [
        ("cep", "m", 1.0, "m", "radius of the circle that contains half of all runs", (0, 1)),
        ("r95", "ft", 0.3048, "m", "radius of the circle that contains 95 % of all runs", (0, 1)),
        ("rate", "kt", 1852.0 / 3600.0, "nmi_h", "R95 divided by the time since the start", (0, 1)),
        ("position_north", "km", 1e3, "m", RMS + "position error to the north", (0,)),
        ("position_east", "nmi", 1852.0, "m", RMS + "position error to the east", (1,)),
        ("position_down", "NM", 1852.0, "m", RMS + "height error", (2,)),
        ("velocity_north", "km/h", 1.0 / 3.6, "mps", RMS + "velocity error to the north", (3,)),
        ("velocity_east", "ft/s", 0.3048, "mps", RMS + "velocity error to the east", (4,)),
        ("velocity_down", "m/h", 1.0 / 3600.0, "mps", RMS + "vertical velocity error", (5,)),
        ("tilt_north", "arcsec", pi / 648_000.0, "rad", RMS + "tilt about the north axis", (6,)),
        ("tilt_east", "mrad", 1e-3, "rad", RMS + "tilt about the east axis", (7,)),
        ("heading", "deg", pi / 180.0, "rad", RMS + "heading error", (8,)),
    ],
)
def test_each_quantity(name: str, unit: str, size: float, column: str, meaning: str, places: tuple[int, ...]) -> None:
    """At 90 s at most 2.5 of its unit."""
    found = parse_requirement(f"{name}(1.5 min) <= 2.5 {unit}")
    text = f"{name}(1.5 min) <= 2.5 {unit}"
    assert found == Requirement(text, name, "at", 90.0, pytest.approx(2.5 * size, rel=1e-15), unit)
    assert found.unit_size == pytest.approx(size, rel=1e-15)
    assert found.meaning == f"{meaning}, at 90 s, at most 2.5 {unit}"
    assert columns_of(found) == places
    assert quantity_of(found).column == f"{name}_90s_{column}"
    assert QUANTITIES[name][0] == quantity_of(found).dimension == {"m": "length", "rad": "angle"}.get(column, "speed")


def test_all_quantities() -> None:
    by_path = {"tse": 0.95, "nse": 0.95, "fte": 0.95, "tse_vertical": 0.95, "miss": 0.95}
    assert {"cep": 0.5, "r95": 0.95, "rate": 0.95, **by_path} == SHARES
    assert list(QUANTITIES) == ["cep", "r95", "rate", *COMPONENTS, *by_path]
    assert len(COMPONENTS) == 9
    assert CIRCLES == ("cep", "r95", "rate")


def test_by_the_planned_path() -> None:
    total = parse_requirement("TSE(2 h) <= 4 nmi")
    assert (total.quantity, total.time, total.limit) == ("tse", 7200.0, 4.0 * 1852.0)
    assert total.meaning == (
        "total system error across the planned path, which 95 % of all runs do not exceed, at 7200 s, at most 4 nmi"
    )
    miss = parse_requirement("miss( waypoint 3 ) <= 0.5 km")
    assert (miss.quantity, miss.when, miss.place, miss.limit) == ("miss", "end", "waypoint 3", 500.0)
    assert miss.instant == "at waypoint 3"
    quantity = parse_quantity("miss(waypoint 3)")
    assert quantity == quantity_of(miss)
    assert (quantity.column, quantity.text) == ("miss_waypoint_3_m", "miss(waypoint 3)")
    assert quantity.instant == "at waypoint 3"
    with pytest.raises(InputError, match="a miss is that of a waypoint"):
        parse_quantity("miss")


@pytest.mark.parametrize(
    ("text", "when", "of_requirement", "of_quantity"),
    [
        ("cep(2.5 h)", "at", "at 9000 s", "at 9000 s"),
        ("cep(end)", "end", "at the end", "at the end"),
        ("cep(run)", "run", "at every time of the run", "largest of the run"),
    ],
)
def test_instants_in_words(text: str, when: str, of_requirement: str, of_quantity: str) -> None:
    requirement = parse_requirement(f"{text} <= 3 m")
    assert (requirement.when, requirement.instant) == (when, of_requirement)
    quantity = parse_quantity(text)
    assert (quantity.when, quantity.instant) == (when, of_quantity)
    assert quantity == quantity_of(requirement)
    assert quantity.text == {"at": "cep(9000 s)"}.get(when, text)


def test_without_a_limit_it_is_that_at_the_end_and_with_one_that_of_the_run() -> None:
    assert parse_quantity("heading") == Quantity("heading", "end", 0.0)
    assert parse_requirement("heading <= 3 deg").when == "run"
    assert parse_requirement("rate <= 3 kt").when == "end"


def test_several_and_their_times() -> None:
    one = parse_requirement("cep(20 s) <= 3 m")
    assert parse_requirements(one) == parse_requirements("cep(20 s) <= 3 m") == (one,)
    assert [r.limit for r in parse_requirements(["r95 <= 5 m", one])] == [5.0, 3.0]
    one.check_within(20.0)
    parse_requirement("cep(end) <= 3 m").check_within(1.0)
    with pytest.raises(InputError, match=r"20 s lies outside the run, which lasts 19.9 s"):
        one.check_within(19.9)


TIME = np.array([100.0, 200.0, 400.0])


def test_what_is_counted() -> None:
    """Runs at 1, 2, 4 and 8 m; the last one fails, and the first has ended before the third instant."""
    errors = np.array([[1.0, -2.0, nan], [2.0, 3.0, -4.0], [4.0, -1.0, 8.0], [8.0, nan, inf]])
    counts = np.array([[True, True, False], [True] * 3, [True] * 3, [True] * 3])
    found = tally(parse_requirement("cep <= 4 m"), TIME, errors, counts)
    assert found.value.tolist() == [3.0, 2.5, 8.0]  # 8 of 4, 8, ∞: their middle
    assert (found.count.tolist(), found.inside.tolist(), found.runs) == ([4, 4, 3], [3, 3, 1], 4)
    mean = tally(parse_requirement("heading <= 4 rad"), TIME, errors[:3], counts[:3])
    assert mean.value == pytest.approx([7.0**0.5, (14.0 / 3.0) ** 0.5, 40.0**0.5], rel=1e-14)
    assert mean.inside.tolist() == [3, 3, 1]
    rate = tally(parse_requirement("rate(200 s) <= 0.01 m/s"), TIME, np.array([[5.0, 7.0, 9.0]]))
    assert rate.value == pytest.approx([0.05, 0.035, 0.0225])
    assert rate.inside.tolist() == [0, 0, 0]
    errors = np.arange(1.0, 41.0)[:, np.newaxis] ** 2
    r95 = tally(parse_requirement("r95 <= 1 m"), TIME[:1], errors)
    assert r95.value == pytest.approx([0.35 * 38.0**2 + 0.65 * 39.0**2])  # at (N + 1/3) p + 1/3 = 38.65
    assert errors_of([np.array([[3.0]]), np.array([[-4.0]])]).tolist() == [[5.0]]
    assert errors_of([np.array([[-4.0]])]).tolist() == [[-4.0]]


def inside(number: int, of: int) -> np.ndarray:
    """Return radii of runs, of which some lie within 1 m."""
    return np.where(np.arange(of) < number, 0.5, 2.0)[:, np.newaxis]


@pytest.mark.parametrize(
    ("number", "expected"),
    [(1, "not met"), (2, "undecided"), (8, "undecided"), (9, "met"), (0, "not met"), (10, "met")],
)
def test_the_binomial_interval_of_ten_runs(number: int, expected: str) -> None:
    """Clopper and Pearson's interval of 1 of 10 is 0.003…0.445, of 2 is 0.025…0.556; those of 9 and 8 mirror them."""
    found = verdict(parse_requirement("cep(end) <= 1 m"), TIME[-1:], inside(number, 10))
    assert found.verdict == expected
    assert (found.runs, found.time) == (10, 400.0)
    assert found.value == (2.0 if number < 5 else 0.5)


def test_how_many_more_runs_decide() -> None:
    """1.96² p (1 − p)/(p̂ − p)²: 97 of 100 within R95 need 456.2; 60 of 100 within CEP 96.04, which are fewer."""
    z2 = 1.959964**2
    assert z2 * 0.95 * 0.05 / 0.02**2 == pytest.approx(456.2, abs=0.1)
    found = verdict(parse_requirement("r95(end) <= 1 m"), TIME[-1:], inside(97, 100))
    assert (found.verdict, found.more_runs) == ("undecided", 457 - 100)
    assert z2 * 0.25 / 0.08**2 == pytest.approx(150.06, abs=0.01)
    assert verdict(parse_requirement("cep(end) <= 1 m"), TIME[-1:], inside(58, 100)).more_runs == 151 - 100
    assert verdict(parse_requirement("cep(end) <= 1 m"), TIME[-1:], inside(50, 100)).more_runs is None
    # all of 50 within R95: log 0.025/log 0.95 = 71.9 runs
    assert verdict(parse_requirement("r95(end) <= 1 m"), TIME[-1:], inside(50, 50)).more_runs == 72 - 50
    # only half of the runs count: twice as many are needed, 2 · 456.2
    errors, counts = inside(97, 200), np.arange(200)[:, np.newaxis] < 100
    found = verdict(parse_requirement("r95(end) <= 1 m"), TIME[-1:], errors, counts)
    assert (found.verdict, found.more_runs, found.runs) == ("undecided", 913 - 200, 200)


def test_a_root_mean_square_of_fifty_runs() -> None:
    """χ² with 50 degrees of freedom: 32.357 at 2.5 %, 71.420 at 97.5 %; 0.5 (1.96/0.1)² = 192.07 runs at 0.9."""
    errors = np.tile([[0.6], [-0.8]], (25, 1)) * 2.0**0.5  # rms 1
    high, low = (50.0 / 32.357) ** 0.5, (50.0 / 71.420) ** 0.5
    for limit, expected in ((1.0002 * high, "met"), (0.9998 * high, "undecided"), (1.0002 * low, "undecided"),
                            (0.9998 * low, "not met")):  # fmt: skip
        found = verdict(parse_requirement(f"heading(end) <= {limit} rad"), TIME[-1:], errors)
        assert (found.verdict, found.value) == (expected, pytest.approx(1.0)), limit
    found = verdict(parse_requirement(f"heading(end) <= {1.0 / 0.9} rad"), TIME[-1:], errors)
    assert found.more_runs == 193 - 50


def test_the_instant_that_is_hardest_to_decide_counts_for_further_runs() -> None:
    """0.95 of the limit needs 0.5 (1.96/0.05)² = 768.3 runs, 0.9 needs 192.1; 0.1 is met."""
    errors = np.tile([0.9, 0.95, 0.1], (50, 1))
    for order in ([0, 1, 2], [1, 2, 0]):
        found = verdict(parse_requirement("heading(run) <= 1 rad"), TIME, errors[:, order])
        assert (found.verdict, found.more_runs) == ("undecided", 769 - 50)


def test_several_looks_and_instants_share_the_probability_of_error() -> None:
    """CEP, 1 of 10 within: P = 11/1024 = 1.07 %; two-sided 2.15 %, so that it is not met at 5 % but not at 5 %/3."""
    one, ten = parse_requirement("cep(run) <= 1 m"), inside(1, 10)
    assert verdict(one, TIME[:1], ten).verdict == "not met"
    assert verdict(one, TIME[:2], np.tile(ten, 2)).verdict == "not met"
    assert verdict(one, TIME, np.tile(ten, 3)).verdict == "undecided"
    assert verdict(one, TIME[:1], ten, error=0.02).verdict == "undecided"
    # met needs every instant at the full 5 %, however many there are
    assert verdict(one, TIME, np.tile(inside(9, 10), 3)).verdict == "met"


def test_which_instant_is_named() -> None:
    """The largest value; of a refuted requirement the largest of the refuted ones; and since when."""
    one = parse_requirement("heading(run) <= 2.5 rad")
    errors = np.tile([0.5, 1.5, 1.0], (40, 1))
    assert verdict(one, TIME, errors) == Verdict(one, "met", 1.5, 200.0, 40, 0)
    found = verdict(one, TIME, np.tile([5.0, 7.5, 6.0], (40, 1)))
    assert found == Verdict(one, "not met", 7.5, 200.0, 40, 0, Exceeded(100.0))
    # one run alone reaches the last instant: 60 rad refute, 3 rad do not (σ is at least 3/√6.96 = 1.1 rad)
    errors, counts = np.tile([5.0, 2.0, 60.0], (40, 1)), np.ones((40, 3), bool)
    counts[1:, 2] = False
    found = verdict(one, TIME, errors, counts)
    assert (found.verdict, found.value, found.time) == ("not met", 60.0, 400.0)
    errors[0, 2] = 3.0
    found = verdict(one, TIME, errors, counts)
    assert (found.verdict, found.value, found.time) == ("not met", 5.0, 100.0)
    late = parse_requirement("heading(200 s) <= 2.5 rad")
    assert verdict(late, TIME, np.tile([5.0, 2.0, 7.0], (400, 1))) == Verdict(late, "met", 2.0, 200.0, 400, 0)
    last = parse_requirement("heading(end) <= 2.5 rad")
    found = verdict(last, TIME, np.tile([1.0, 2.0, 7.0], (400, 1)))
    assert found == Verdict(last, "not met", 7.0, 400.0, 400, 0)


def test_no_run_counts() -> None:
    one = parse_requirement("heading(run) <= 2.5 rad")
    found = verdict_of(one, TIME, tally(one, TIME, np.ones((4, 3)), np.zeros((4, 3), bool)))
    assert (found.verdict, found.runs, found.more_runs, found.exceeded) == ("undecided", 4, None, None)
    assert np.isnan(found.value)
    assert np.isnan(found.time)


def test_since_when_on_the_line_between_two_instants() -> None:
    """From 2 to 7 rad between 200 s and 400 s: 2.5 rad after a tenth of it; the outage began at 150 s."""
    one, values = parse_requirement("heading(run) <= 2.5 rad"), np.array([1.0, 2.0, 7.0])
    found = first_exceeded(one, TIME, values, ((150.0, 230.0), (10.0, 90.0), (240.0, 300.0)))
    assert found == Exceeded(pytest.approx(220.0), 150.0)
    tallied = tally(one, TIME, np.tile(values, (400, 1)))
    assert verdict_of(one, TIME, tallied, outages=((150.0, 230.0),)).exceeded == found
    assert found is not None
    assert found.text == "exceeded from 220 s, 70 s after the fixes end"
    assert (found.time, found.after_fixes_end) == (pytest.approx(220.0), pytest.approx(70.0))
    assert Exceeded(42.37, 40.0).text == "exceeded from 42.4 s, 2.4 s after the fixes end"
    assert (Exceeded(5.0).time, Exceeded(5.0).after_fixes_end) == (5.0, None)
    never = Verdict.certain(one, 1.0, 5.0, None).in_unit
    assert (never.exceeded_from_s, never.after_fixes_end_s) == (None, None)
