"""The motion of the one-component system against Newton's law in space and against adaptive quadrature."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from sinssim.errors import InputError
from sinssim.truth.one_component import OneComponent, PlaneMotion

G, R = 9.81, 6371000.0
ROWS: dict[str, Any] = {
    "velocity_mps": ((0.0, 20.0), (30.3, 90.0), (100.0, 200.0), (200.0, 150.0)),
    "height_m": ((0.0, 0.0), (50.0, 400.0), (200.0, 3000.0)),
    "pitch_deg": ((0.0, 0.0), (20.0, 8.0), (120.0, 5.0), (200.0, -3.0)),
}


def motion(interpolation: str = "spline", **more: Any) -> PlaneMotion:
    values = {"variant": "one-integral", "gyro": {}, "duration_s": 200.0, **more}
    return PlaneMotion(OneComponent(motion={**ROWS, "interpolation": interpolation}, **values))


def test_forces_with_altitude_are_newtons() -> None:
    """Specific force = acceleration in space less gravitation, by differences of the velocity as a vector."""
    true = motion(altitude_effects=True, coordinate_deg=40.0)
    step, at = 1e-3, np.array([3.0, 25.0, 77.0, 150.0])
    angle = {t: np.radians(40.0) + quad(lambda x: turn(true, x), 0.0, t, epsabs=1e-15)[0] for t in at}

    def axes(t: float, now: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the horizontal and the vertical direction in space."""
        y = angle[now] + quad(lambda x: turn(true, x), now, t, epsabs=1e-17)[0]
        return np.array([np.cos(y), -np.sin(y)]), np.array([np.sin(y), np.cos(y)])

    def velocity(t: float, now: float) -> np.ndarray:
        along, up = axes(t, now)
        state = true.state(np.array([t - 1e-3, t, t + 1e-3]))
        climb = (state.height[2] - state.height[0]) / 2e-3
        return state.velocity[1] * along + climb * up

    for now in at:
        acceleration = (velocity(now + step, now) - velocity(now - step, now)) / (2.0 * step)
        along, up = axes(now, now)
        state = true.state(np.array([now]))
        felt = acceleration + G * (R / (R + state.height[0])) ** 2 * up
        assert felt @ along == pytest.approx(state.horizontal[0], abs=2e-6)
        assert felt @ up == pytest.approx(state.vertical[0], abs=2e-6)


def turn(true: PlaneMotion, t: float) -> float:
    state = true.state(np.array([t]))
    return float(state.velocity[0] / (R + state.height[0]))


def test_chapter_forces_neglect_the_height() -> None:
    state = motion().state(np.linspace(0.0, 200.0, 20001))
    rise = np.gradient(np.gradient(state.height, state.time), state.time)[5:-5]
    assert np.abs(state.vertical[5:-5] - (G + rise - state.velocity[5:-5] ** 2 / R)).max() < 2e-5
    assert np.abs(state.horizontal - np.gradient(state.velocity, state.time))[5:-5].max() < 1e-3


@pytest.mark.parametrize("interpolation", ["spline", "monotone"])
@pytest.mark.parametrize("altitude", [False, True])
def test_increments_are_integrals(interpolation: str, altitude: bool) -> None:
    """Also of intervals that hold rows, where the curves of "monotone" bend."""
    true = motion(interpolation, altitude_effects=altitude, mounting_angle_deg=2.0)
    found = true.increments(0.1)

    def felt(t: float, axis: int) -> float:
        s = true.state(np.array([t]))
        c, n = np.cos(s.pitch[0]), np.sin(s.pitch[0])
        return float((s.horizontal[0] * c + s.vertical[0] * n, s.vertical[0] * c - s.horizontal[0] * n)[axis])

    rows = [20.0, 30.3, 50.0, 100.0, 120.0]
    for k in (0, 2, 3, 5, 11, 19):
        a, b = found.time[k], found.time[k + 1]
        bends = [a, *(t for t in rows if a < t < b), b]
        for axis in (0, 1):
            parts = [quad(felt, p, q, (axis,), epsabs=1e-13)[0] for p, q in pairwise(bends)]
            assert found.dvel[k, axis] == pytest.approx(sum(parts), abs=1e-9)
        state = true.state(np.array([a, b]))
        assert found.drate[k] == pytest.approx(state.rate[1] - state.rate[0], abs=1e-18)
        swept = found.coordinate[k + 1] - found.coordinate[k]
        assert found.dtheta[k] == pytest.approx(state.body_pitch[1] - state.body_pitch[0] - swept, abs=1e-15)
    whole = quad(lambda t: true.state(np.array([t])).velocity[0] / (R + altitude * true.state(np.array([t])).height[0]),
                 0.0, 200.0, points=[30.3, 50.0, 100.0], limit=200)[0]  # fmt: skip
    assert found.coordinate[-1] - found.coordinate[0] == pytest.approx(whole, rel=1e-11)
    assert np.all(true.state(found.time).pitch - true.state(found.time).body_pitch == pytest.approx(np.radians(2.0)))


def test_monotone_does_not_overshoot() -> None:
    state = motion("monotone").state(np.linspace(0.0, 200.0, 5001))
    assert state.velocity.min() >= 20.0
    assert state.velocity.max() <= 200.0
    assert motion("spline").state(np.linspace(0.0, 200.0, 5001)).velocity.max() > 200.5


def test_a_number_is_a_steady_motion() -> None:
    section = OneComponent(
        variant="one-integral", gyro={}, duration_s=10.0, motion={"velocity_mps": 250.0, "pitch_deg": 3}
    )
    found = PlaneMotion(section).increments(1.0)
    assert np.allclose(found.dtheta, -250.0 / R, rtol=1e-14)
    assert np.allclose(found.dvel[:, 0], (G - 250.0**2 / R) * np.sin(np.radians(3.0)), rtol=1e-13)


def straight(**more: Any) -> PlaneMotion:
    """Return V = 100 + 2t m/s, H = 1000 + 5t m, ϑ = 3° + 0.1°/s t, which two rows give in either interpolation."""
    rows = {"velocity_mps": ((0.0, 100.0), (200.0, 500.0)), "height_m": ((0.0, 1000.0), (200.0, 2000.0)),
            "pitch_deg": ((0.0, 3.0), (200.0, 23.0))}  # fmt: skip
    return PlaneMotion(OneComponent(
        variant="one-integral", gyro={}, duration_s=200.0, motion={**rows, "interpolation": "spline"},
        radius_m=6.3e6, gravity_mps2=9.7, mounting_angle_deg=4.0, coordinate_deg=-20.0, **more,
    ))  # fmt: skip


def test_the_state_at_half_a_minute() -> None:
    """V = 160 m/s, H = 1150 m, ϑ = 6°."""
    plain, high = (straight(altitude_effects=on).state(np.array([30.0])) for on in (False, True))
    for state, turn, along, up in (
        (plain, 160.0 / 6.3e6, 2.0, 9.7 - 160.0**2 / 6.3e6),
        (high, 160.0 / 6_301_150.0, 2.0 + 160.0 * 5.0 / 6_301_150.0,
         9.7 * (6.3e6 / 6_301_150.0) ** 2 - 160.0**2 / 6_301_150.0),
    ):  # fmt: skip
        assert (state.time[0], state.velocity[0], state.height[0]) == pytest.approx((30.0, 160.0, 1150.0))
        assert np.degrees([state.body_pitch[0], state.pitch[0]]) == pytest.approx([6.0, 10.0])
        assert state.rate[0] == pytest.approx(np.radians(0.1) - turn, rel=1e-13)
        assert (state.horizontal[0], state.vertical[0]) == pytest.approx((along, up), rel=1e-14)


def test_increments_of_the_straight_motion() -> None:
    """Over 30 … 40 s the vehicle goes 1700 m; the pitch grows by 1°; it began at −20°."""
    found = straight().increments(0.1)
    assert found.time.tolist() == list(range(0, 201, 10))
    assert found.coordinate[[0, 3, 4]] == pytest.approx(np.radians(-20.0) + np.array([0.0, 3900.0, 5600.0]) / 6.3e6)
    assert found.dtheta[3] == pytest.approx(np.radians(1.0) - 1700.0 / 6.3e6, rel=1e-12)
    assert found.drate[3] == pytest.approx(-20.0 / 6.3e6, rel=1e-9)
    x = quad(lambda t: 2.0 * np.cos(np.radians(7.0 + 0.1 * t)) + (9.7 - (100.0 + 2.0 * t) ** 2 / 6.3e6)
             * np.sin(np.radians(7.0 + 0.1 * t)), 30.0, 40.0)[0]  # fmt: skip
    y = quad(lambda t: (9.7 - (100.0 + 2.0 * t) ** 2 / 6.3e6) * np.cos(np.radians(7.0 + 0.1 * t))
             - 2.0 * np.sin(np.radians(7.0 + 0.1 * t)), 30.0, 40.0)[0]  # fmt: skip
    assert found.dvel[3] == pytest.approx([x, y], rel=1e-12)


def test_a_height_near_the_centre_of_the_earth_is_refused() -> None:
    """Half the radius of 100 km is the limit, wherever in the motion."""
    common = {"variant": "one-integral", "gyro": {}, "duration_s": 10.0, "radius_m": 1e5}
    deep = {"height_m": ((0.0, 0.0), (5.0, -60_000.0), (10.0, -200.0))}
    with pytest.raises(InputError) as error:
        PlaneMotion(OneComponent(**common, altitude_effects=True, motion=deep))
    assert str(error.value) == (
        "one_component.motion.height_m reaches -60000 m; with altitude_effects it must stay above half the radius, "
        "-50000 m."
    )
    PlaneMotion(OneComponent(**common, altitude_effects=True, motion={"height_m": -49_900.0}))
    PlaneMotion(OneComponent(**common, motion=deep))
