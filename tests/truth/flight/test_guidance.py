"""What the autopilot sees of a navigator: its errors, late, held between solutions, and only what it is to see."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from sinssim.truth.flight.autopilot import AircraftState
from sinssim.truth.flight.guidance import AirData, Guidance, Navigator, Quantity, SolutionErrors, finite_rows

STEP = 1.0 / 30.0
ERROR = np.array([1e-5, 2e-5, 3.0, 0.4, -0.5, 0.6, 0.01, 0.02, 0.03, 1e-3, 2e-3, 3e-3])


def flown(steps: int, errors: np.ndarray | None = None, **keys: object) -> list[AircraftState]:
    """Return what is seen after each step of a climb to the north-east in which everything grows with time."""
    guidance = Guidance.model_validate(keys)
    given = np.tile(ERROR, (3, 1)) if errors is None else errors
    navigator, seen = Navigator(SolutionErrors(guidance, given), STEP), []
    for k in range(steps):
        t = k * STEP
        m = AircraftState(
            time=t, phi=0.1 * t, theta=0.2 * t, psi=0.3 * t, p=0.1, q=0.2, r=0.3, height=100.0 * t, climb=100.0
        )
        speed, track = 50.0, math.radians(45.0)
        navigator.fast(m, 1e-3 * t, 2e-3 * t, track, speed)
        navigator.slow(m)
        seen.append(m)
    return seen


def test_every_error_is_added_in_its_place() -> None:
    m = flown(31)[30]  # at 1 s
    north, east = 50.0 / math.sqrt(2.0) + 0.4, 50.0 / math.sqrt(2.0) - 0.5
    assert (m.latitude, m.longitude, m.height) == pytest.approx((1e-3 + 1e-5, 2e-3 + 2e-5, 103.0), rel=1e-12)
    assert (m.ground_speed, m.track) == pytest.approx((math.hypot(north, east), math.atan2(east, north)), rel=1e-12)
    assert m.climb == pytest.approx(100.0 - 0.6)  # up; the error is down
    assert (m.phi, m.theta, m.psi) == pytest.approx((0.11, 0.22, 0.33), rel=1e-12)
    assert (m.p, m.q, m.r) == pytest.approx((0.101, 0.202, 0.303), rel=1e-12)


@pytest.mark.parametrize(
    ("quantity", "attributes"),
    [("position", "latitude longitude"), ("height", "height"), ("velocity", "climb track ground_speed"),
     ("attitude", "phi theta psi p q r")],
)  # fmt: skip
def test_only_what_it_gives_is_seen(quantity: Quantity, attributes: str) -> None:
    names = ["latitude", "longitude", "height", "climb", "track", "ground_speed", "phi", "theta", "psi", "p", "q", "r"]
    true, seen = flown(20, np.zeros((1, 12)))[-1], flown(20, quantities=(quantity,), latency_s=0.2)[-1]
    different = [name for name in names if abs(getattr(true, name) - getattr(seen, name)) > 1e-12]
    assert different == attributes.split()


def test_a_late_solution_is_that_of_its_instant() -> None:
    """At 1 s the solution of 0.5 s is known, with the true state of then; before 0.5 s that of the start."""
    errors = np.zeros((60, 12))
    errors[:, 2] = np.arange(60)  # metres of height, the number of the solution
    seen = flown(31, errors, latency_s=0.5)
    assert seen[30].height == pytest.approx(50.0 + 15.0, abs=1e-6)
    assert seen[30].latitude == pytest.approx(0.5e-3, rel=1e-9)
    assert seen[14].height == pytest.approx(0.0, abs=1e-9)


def test_a_slow_navigator_is_held() -> None:
    """Four solutions a second, which lie between the steps of the autopilot."""
    errors = np.zeros((60, 12))
    seen = flown(31, errors, rate_hz=4.0)
    for k, instant in ((29, 0.75), (30, 1.0), (15, 0.5), (8, 0.25), (7, 0.0)):
        assert seen[k].height == pytest.approx(100.0 * instant, abs=1e-6)
        assert seen[k].longitude == pytest.approx(2e-3 * instant, abs=1e-12)


def test_the_last_reading_that_has_arrived_is_seen() -> None:
    """Readings at 0.25 and 0.5 s, 0.2 s late, of an airspeed that grows by 9 m/s² and a height by 100 m/s: the value of
    their instant with their error, and before them the truth. The calibrated airspeed is in the same ratio."""
    of = AirData(np.array([0.25, 0.5]), np.array([0.45, 0.7]), np.array([2.0, 3.0]))
    errors = SolutionErrors(Guidance(quantities=("position",)), np.tile(ERROR, (3, 1)), of, of)
    navigator, seen = Navigator(errors, STEP), []
    for k in range(31):
        t = k * STEP
        m = AircraftState(time=t, height=100.0 * t, tas=100.0 + 9.0 * t, cas=0.8 * (100.0 + 9.0 * t))
        navigator.fast(m, 0.0, 0.0, 0.0, 50.0)
        if k == 10:  # the first has been taken by then
            navigator.believe(replace(errors, airspeed=of._replace(errors=np.array([50.0, 4.0]))))
        seen.append((m.tas, m.cas / m.tas, m.height))
    for k, airspeed, height in ((13, 100.0 + 9.0 * 13 * STEP, 100.0 * 13 * STEP), (14, 104.25, 27.0),
                                (20, 104.25, 27.0), (21, 108.5, 53.0), (30, 108.5, 53.0)):  # fmt: skip
        assert seen[k] == pytest.approx((airspeed, 0.8, height), rel=1e-12)


def test_angles_stay_in_their_range() -> None:
    errors = np.zeros((1, 12))
    errors[0, [6, 8]] = 3.1, -0.1
    first, later = flown(31, errors)[0], flown(31, errors)[30]
    assert first.psi == pytest.approx(2.0 * math.pi - 0.1)  # a heading is not negative
    assert later.phi == pytest.approx(3.2 - 2.0 * math.pi)


def test_errors_stay_after_the_end_and_where_they_are_not_finite() -> None:
    errors = np.zeros((4, 12))
    errors[:, 2] = 1.0, np.nan, 3.0, np.inf
    assert finite_rows(errors)[:, 2].tolist() == [1.0, 1.0, 3.0, 3.0]
    assert flown(31, finite_rows(errors))[30].height == pytest.approx(103.0)


def test_between_two_steps_a_heading_passes_north_by_the_short_way() -> None:
    """From 359° to 1° of heading, and from 179° to −179° of roll, half of the way is north and upside down."""
    navigator = Navigator(SolutionErrors(Guidance(), np.zeros((3, 12))), STEP)
    before, after = np.zeros(12), np.ones(12)
    before[[6, 8]], after[[6, 8]] = np.radians([179.0, 359.0]), np.radians([-179.0, 1.0])
    navigator._past.extend([(1.0, tuple(before)), (2.0, tuple(after))])
    middle = np.array(navigator._at(1.5))
    assert np.degrees(middle[[6, 8]]) == pytest.approx([180.0, 360.0])
    assert middle[[0, 7, 9, 11]] == pytest.approx(0.5)


def test_the_solution_before_an_instant_has_its_own_row() -> None:
    """At 10.75 s with a latency of 0.25 s and two solutions a second: that of 10.5 s, the twenty-first, and its state.

    50 m/s on a course of 306.87° are 30 m/s north and 40 m/s west; a roll to the left has no end at 360°.
    """
    errors = np.outer(np.arange(30.0), ERROR)
    navigator = Navigator(SolutionErrors(Guidance(rate_hz=2.0, latency_s=0.25), errors), 0.25)
    course = 2.0 * math.pi - math.atan2(4.0, 3.0)
    for t in (10.0, 10.25, 10.5, 10.75):
        m = AircraftState(
            time=t, phi=-0.1 * t, theta=0.01 * t, psi=0.3, p=0.1 * t, q=-0.2, r=0.3, height=100.0 * t, climb=-7.0
        )
        navigator.fast(m, 0.02 * t, -0.1 * t, course, 50.0)
        navigator.slow(m)
    assert (m.latitude, m.longitude) == pytest.approx((0.21 + 21e-5, -1.05 + 42e-5), rel=1e-12)
    assert (m.height, m.climb) == pytest.approx((1050.0 + 63.0, -7.0 - 12.6), rel=1e-12)
    north, east = 30.0 + 8.4, -40.0 - 10.5
    assert m.ground_speed == pytest.approx(math.hypot(north, east), rel=1e-12)
    assert m.track == pytest.approx(math.atan2(east, north) + 2.0 * math.pi, rel=1e-12)
    assert (m.phi, m.theta, m.psi) == pytest.approx((-1.05 + 0.21, 0.105 + 0.42, 0.3 + 0.63), rel=1e-12)
    assert (m.p, m.q, m.r) == pytest.approx((1.05 + 0.021, -0.2 + 0.042, 0.3 + 0.063), rel=1e-12)


def test_a_quarter_of_the_way_between_two_steps() -> None:
    """Of three steps the two about the instant count; at a step it is the step's own state."""
    navigator = Navigator(SolutionErrors(Guidance(rate_hz=1.0), np.zeros((3, 12))), 0.5)
    states = [np.arange(12.0) * factor for factor in (9.0, 1.0, 3.0)]
    navigator._past.extend((at, tuple(0.01 * state)) for at, state in zip((9.0, 10.0, 12.0), states, strict=True))
    np.testing.assert_allclose(navigator._at(10.5), 0.015 * np.arange(12.0), rtol=1e-12)
    np.testing.assert_allclose(navigator._at(10.0), 0.01 * np.arange(12.0), rtol=1e-12)
    np.testing.assert_allclose(navigator._at(12.0), 0.03 * np.arange(12.0), rtol=1e-12)


def test_a_row_that_is_not_finite_is_replaced_whole() -> None:
    rows = np.array([[np.nan, 1.0], [2.0, 3.0], [4.0, np.inf], [5.0, 6.0]])
    assert finite_rows(rows).tolist() == [[0.0, 0.0], [2.0, 3.0], [2.0, 3.0], [5.0, 6.0]]
