"""Every algorithm, and every frame, through four seconds of an S-turn in closed form.

Two hundred steps are enough to see a wrong sign or factor of nearly any term: one that is wrong by 1e-6 m/s² moves the
end by 8 µm, one that is wrong by 1e-9 rad/s turns it by 4 nrad. The small terms that need longer have tests elsewhere.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from sinssim import ALGORITHMS, FRAMES, ImuData, NavSolution, NavState, navigate
from tests.oracles.gravity import WGS84
from tests.oracles.integrator import geodetic_to_ecef, matrix, ned_axes
from tests.oracles.s_turn import OMEGA_IE, Flight, STurn
from tests.strapdown.variants import with_slow_variants

Array = NDArray[np.float64]

MOUNT = Rotation.from_euler("ZYX", [0.5, 0.4, 0.3])
"""Of the block in the vehicle: askew, so that rates and forces vary along all its axes."""


def askew(flight: Flight) -> Flight:
    """Return the flight as a block sees it that is mounted askew."""
    block = Rotation.from_quat(flight.q_nb, scalar_first=True) * MOUNT
    return replace(
        flight,
        dtheta=MOUNT.apply(flight.dtheta, inverse=True),
        dvel=MOUNT.apply(flight.dvel, inverse=True),
        q_nb=block.as_quat(scalar_first=True),
    )


TURN = STurn(duration=4.0, period=10.0, heading=1.0)
FLIGHT = askew(TURN.fly(48))
"""192 intervals of a turn, a whole number of updates of two, three and four samples; 45° of bank at 200 m/s."""

# Bounds of the largest errors of position, m, attitude, rad, and velocity, m/s, half as much again as measured; but of
# positions never less than what 192 roundings of a latitude by half its last digit, 3.5e-10 m, can add up to.
# With the fitted increments that is rounding, (0.5 rad/s · 21 ms)⁴ in the fourth-order steps, and what the fit lacks.
# The steps in the plain increment have the error of their order, from the third on that of the increment itself.
ROUNDING = (7e-8, 1e-13, 1.2e-10)
PLAIN = (9e-5, 3.3e-6, 6e-5)
BOUNDS = {
    "quaternion": ROUNDING,
    "functional-iteration": ROUNDING,
    "poisson": (7e-8, 1.3e-10, 4.5e-9),
    "euler": (7e-8, 1.1e-10, 1.4e-9),
    "poisson-1": (0.23, 3.9e-5, 0.15),
    "poisson-2": (1.2e-3, 2e-5, 6.6e-4),
    "poisson-1-ortho": (2.4e-3, 3.9e-5, 1.3e-3),
    "poisson-2-ortho": (1.2e-3, 2e-5, 6.6e-4),
    "quaternion-1": (0.12, 1e-5, 0.075),
    "quaternion-2": (3e-4, 5.4e-6, 1.7e-4),
    "quaternion-1-norm": (6e-4, 1e-5, 3.3e-4),
    "quaternion-2-norm": (3e-4, 5.4e-6, 1.7e-4),
    "two-quaternions": (3e-4, 5.4e-6, 1.7e-4),
    "rotation-vector-1": (1.3e-3, 3.3e-6, 6.2e-4),
    "rotation-vector-1p": (9.2e-6, 1.1e-8, 2.6e-6),
    "rotation-vector-2": (1.2e-7, 4.1e-10, 4.7e-8),
    "rotation-vector-3": (4.7e-7, 1.7e-9, 2e-7),
    "rotation-vector-4": (1.4e-6, 4.8e-9, 5.6e-7),
}


START = NavState(FLIGHT.latitude[0], FLIGHT.longitude[0], FLIGHT.height[0], FLIGHT.velocity_ned[0], FLIGHT.q_nb[0])


def navigated(first: NavState = START, push: Array | float = 0.0, **options: Any) -> NavSolution:
    """Navigate along the flight, or along another: from another start, and with a force more throughout."""
    imu = ImuData(FLIGHT.time, FLIGHT.dtheta, FLIGHT.dvel + push * np.diff(FLIGHT.time)[:, None])
    height = None if options.get("vertical", "free") == "free" else FLIGHT.height
    return navigate(imu, first, **{"gravity": "somigliana", "height": height, **options})


def check(bounds: tuple[float, float, float], **options: Any) -> None:
    """Navigate and compare with the truth at the rows that there are."""
    found = navigated(**options)
    rows = np.searchsorted(FLIGHT.time, found.time - 1e-9)
    north = 6.37e6 * (found.latitude - FLIGHT.latitude[rows])
    east = 6.37e6 * np.cos(found.latitude) * (found.longitude - FLIGHT.longitude[rows])
    up = found.height - FLIGHT.height[rows]
    q, p = found.q_nb, FLIGHT.q_nb[rows]
    turn = p[:, :1] * q[:, 1:] - q[:, :1] * p[:, 1:] - np.cross(p[:, 1:], q[:, 1:])
    assert np.sqrt(north**2 + east**2 + up**2).max() < bounds[0]
    assert 2.0 * np.linalg.norm(turn, axis=1).max() < bounds[1]
    assert np.abs(found.velocity_ned - FLIGHT.velocity_ned[rows]).max() < bounds[2]


@pytest.mark.parametrize("vertical", ["free", "baro-loop", "truth"])
@pytest.mark.parametrize("frame", FRAMES)
def test_every_frame(frame: str, vertical: str) -> None:
    check(ROUNDING, frame=frame, vertical=vertical)


@pytest.mark.parametrize("vertical", ["free", "baro-loop", "truth"])
@pytest.mark.parametrize("frame", FRAMES)
def test_three_rates_in_every_frame(frame: str, vertical: str) -> None:
    """The errors are those of second order in the medium and the slow interval, half as much again as measured."""
    bounds = (4.7e-3, 8.2e-9, 2.5e-3)
    check(bounds, frame=frame, vertical=vertical, rates_hz=(48.0, 24.0, 12.0), slow_quantities="extrapolate")


def test_the_transverse_frame_off_its_route() -> None:
    """Nearer to the pole of its equator than to it, the frame turns about the vertical as the vehicle swings."""
    check(ROUNDING, frame="transverse", route=(0.0, 0.5, 0.1, 2.0))


@pytest.mark.parametrize("algorithm", with_slow_variants(ALGORITHMS))
def test_every_algorithm(algorithm: str) -> None:
    check(BOUNDS.get(algorithm, PLAIN), algorithm=algorithm, vertical="truth")


def test_euler_angles_in_the_inertial_frame() -> None:
    """The one algorithm that takes the frame's rate within the interval, in the frame that has none."""
    check(BOUNDS["euler"], algorithm="euler", frame="inertial", vertical="truth")


@pytest.mark.parametrize("frame", ["wander", "free-azimuth", "transverse"])
def test_simplified_curvature_is_the_same_in_every_frame(frame: str) -> None:
    """Its radii are wrong by the square of the flattening, 1e-5: over 800 m some millimetres, in all frames alike."""
    level, exact = navigated(curvature="simplified", vertical="truth"), navigated(vertical="truth")
    found = navigated(curvature="simplified", vertical="truth", frame=frame)
    off = 6.37e6 * np.hypot(level.latitude - exact.latitude, level.longitude - exact.longitude).max()
    assert 1e-4 < off < 0.02
    np.testing.assert_allclose(found.latitude, level.latitude, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.longitude, level.longitude, rtol=0, atol=2e-14)
    np.testing.assert_allclose(found.velocity_ned, level.velocity_ned, rtol=0, atol=1e-9)


@pytest.mark.parametrize("vertical", ["baro-loop", "truth"])
@pytest.mark.parametrize("frame", [frame for frame in FRAMES if frame != "level"])
def test_every_frame_follows_a_wrong_height_alike(frame: str, vertical: str) -> None:
    """A reference that swings by 30 m within 3 s pulls height and velocity along: the same in every frame."""
    height = FLIGHT.height + 30.0 * np.sin(2.0 * FLIGHT.time + 0.3)
    level = navigated(vertical=vertical, height=height)
    found = navigated(vertical=vertical, height=height, frame=frame)
    assert np.abs(level.height - FLIGHT.height).max() > 1.0
    np.testing.assert_allclose(found.height, level.height, rtol=0, atol=2e-8)
    np.testing.assert_allclose(found.latitude, level.latitude, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.longitude, level.longitude, rtol=0, atol=2e-14)
    np.testing.assert_allclose(found.velocity_ned, level.velocity_ned, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.q_nb, level.q_nb, rtol=0, atol=1e-13)


@pytest.mark.parametrize("frame", FRAMES)
def test_the_first_attitude_goes_on(frame: str) -> None:
    """Of q and −q, one attitude, each row has that which is nearer to the row before, whatever the first one is."""
    imu = ImuData(FLIGHT.time[:2], FLIGHT.dtheta[:1], FLIGHT.dvel[:1])
    for large in range(4):
        for small in set(range(4)) - {large}:
            q = np.zeros(4)
            q[large], q[small] = np.cos(np.pi / 8.0), -np.sin(np.pi / 8.0)
            found = navigate(imu, replace(START, q_nb=q), frame=frame, gravity="somigliana").q_nb
            np.testing.assert_allclose(found[1], q, rtol=0, atol=0.01)  # half of 0.5 rad/s · 21 ms


@pytest.mark.parametrize(("heading", "side"), [(1.0, 1.0), (4.0, -1.0)])
def test_across_the_antimeridian(heading: float, side: float) -> None:
    """Eastwards and westwards; longitudes stay in (−π, π]."""
    flight = askew(STurn(duration=2.0, period=10.0, heading=heading, longitude=side * (np.pi - 1e-5)).fly(48))
    first = NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])
    found = navigate(ImuData(flight.time, flight.dtheta, flight.dvel), first, gravity="somigliana").longitude
    assert np.all(np.abs(found) <= np.pi)
    assert found[0] * found[-1] < 0.0
    np.testing.assert_allclose(found, np.mod(flight.longitude + np.pi, 2.0 * np.pi) - np.pi, rtol=0, atol=2e-14)


CLIMB = replace(START, height=29.9e3, velocity_ned=START.velocity_ned + np.array([0.0, 0.0, -60.0]))
PUSH = np.array([2.0, -4.0, -6.0])
"""Specific force in the block's axes, m/s², beyond that of the turn."""


@pytest.fixture(scope="module")
def climb() -> tuple[Array, Array, Array]:
    """Return position, velocity and C_eb, Earth-fixed, at the end of a flight with a steep and accelerated climb.

    r̈ = C f + g − 2Ω × v in Earth-fixed axes, by an integrator of the eighth order, in the normal field, whose gravity
    has a part to the north. The engines compute it by polynomials up to 30 km and in closed form above.
    """
    spin = np.array([0.0, 0.0, OMEGA_IE])

    def slope(t: float, y: Array) -> Array:
        r, v, q = y[:3], y[3:6], y[6:]
        rate, force = (MOUNT.apply(value, inverse=True) for value in TURN.rates(np.array(t)))
        rho = np.hypot(r[0], r[1])
        outward, along = (
            float(g[0]) for g in WGS84.gravity(np.array([rho], np.longdouble), r[2:].astype(np.longdouble))
        )
        c = matrix(q) / (q @ q)
        gravity = np.array([outward * r[0] / rho, outward * r[1] / rho, along])
        turn = rate - c.T @ spin
        q_dot = 0.5 * np.array([-q[1:] @ turn, *(q[0] * turn + np.cross(q[1:], turn))])
        return np.concatenate([v, c @ (force + PUSH) + gravity - 2.0 * np.cross(spin, v), q_dot])

    c_en = ned_axes(CLIMB.latitude, CLIMB.longitude).T
    q_eb = Rotation.from_matrix(c_en) * Rotation.from_quat(CLIMB.q_nb, scalar_first=True)
    place = geodetic_to_ecef(CLIMB.latitude, CLIMB.longitude, CLIMB.height)
    start = np.concatenate([place, c_en @ CLIMB.velocity_ned, q_eb.as_quat(scalar_first=True)])
    end = solve_ivp(slope, (0.0, FLIGHT.time[-1]), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return end[:3], end[3:6], matrix(end[6:]) / (end[6:] @ end[6:])


@pytest.mark.parametrize("frame", FRAMES)
def test_every_frame_climbs(frame: str, climb: tuple[Array, Array, Array]) -> None:
    """Height, and with it the Earth's curvature and gravity, changes by metres in every interval."""
    end = navigated(frame=frame, gravity="normal", first=CLIMB, push=PUSH).state(-1)
    c_en = ned_axes(end.latitude, end.longitude).T
    position, velocity, c_eb = climb
    np.testing.assert_allclose(geodetic_to_ecef(end.latitude, end.longitude, end.height), position, rtol=0, atol=1.2e-7)
    np.testing.assert_allclose(c_en @ end.velocity_ned, velocity, rtol=0, atol=1.2e-10)
    np.testing.assert_allclose(c_en @ matrix(end.q_nb), c_eb, rtol=0, atol=1e-13)


@pytest.mark.parametrize("frame", ["level", "wander", "inertial"])
def test_the_defect_at_every_edge(frame: str) -> None:
    """First-order steps of a matrix stretch it, C ← C (I + [Δθ×]); the frame's own turn is 4e-4 rad in all."""
    c = Rotation.from_quat(FLIGHT.q_nb[0], scalar_first=True).as_matrix()
    if frame == "inertial":
        c = ned_axes(FLIGHT.latitude[0], FLIGHT.longitude[0]).T @ c
    expected = [0.0]
    for step in FLIGHT.dtheta:
        c = c @ (np.eye(3) + np.cross(step, np.eye(3)).T)
        expected.append(np.abs(c @ c.T - np.eye(3)).max())
    found = navigated(frame=frame, algorithm="poisson-1", vertical="truth").defect
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 if frame == "inertial" else 4e-4 * expected[-1])


@pytest.mark.parametrize("frame", FRAMES)
def test_every_row_is_written(frame: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The arrays of a solution come with whatever the memory held; with NaN there, nothing of it may remain."""
    real = np.empty

    def spoilt(*args: Any, **options: Any) -> Any:
        array = real(*args, **options)
        if array.dtype.kind == "f":
            array.fill(np.nan)
        return array

    navigated(frame=frame)  # compiles outside the patch
    monkeypatch.setattr(np, "empty", spoilt)
    found = navigated(frame=frame)
    for values in (found.latitude, found.longitude, found.height, found.velocity_ned, found.q_nb, found.defect):
        assert np.isfinite(values).all()
