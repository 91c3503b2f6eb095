"""The truth curve against closed forms, finite differences, scipy, and rigid-body kinematics written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation, RotationSpline

from sinssim.errors import InputError
from sinssim.truth.curve import Curve
from tests.oracles import integrator as oracle
from tests.truth.motions import Array, ecef, synthetic_flight

LEVER = np.array([3.0, -1.0, 0.5])
MOUNTING = Rotation.from_euler("ZYX", [30.0, -10.0, 5.0], degrees=True)  # C_bs
SPIN = np.array([0.0, 0.0, oracle.OMEGA])
KNOT_HZ = 30.0


def flight_curve(duration: float, knot_hz: float = KNOT_HZ, **options: object) -> tuple[Array, Curve]:
    time = np.arange(round(duration * knot_hz) + 1) / knot_hz
    return time, Curve(time, *synthetic_flight(time), **options)  # type: ignore[arg-type]


def test_goes_through_the_knots() -> None:
    time, curve = flight_curve(600.0)
    position, q_eb = synthetic_flight(time)
    r, _, c_es = ecef(curve, time)
    assert np.abs(r - position).max() < 1e-8  # m; an ulp of the coordinates is 1e-9
    assert np.abs(c_es - oracle.matrix(q_eb)).max() < 5e-15


def test_no_jumps_at_the_knots() -> None:
    """Velocity is continuous to rounding of its own size: the reason for re-integrating."""
    time, curve = flight_curve(600.0)
    knots = time[1:-1]
    step = 1e-7
    _, before, _ = ecef(curve, knots - step)
    _, after, _ = ecef(curve, knots + step)
    middle = ecef(curve, knots)[1]
    # second difference of a velocity whose second derivative is below 1 m/s³, plus a few ulps of 300 m/s
    assert np.abs(before + after - 2.0 * middle).max() < 1e-12


def test_converges_to_the_motion_between_knots() -> None:
    """Error at the middles of the panels falls with the sixth power of the knot spacing, position and attitude."""
    errors = []
    for hz in (2.0, 4.0):
        _, curve = flight_curve(120.0, hz)
        t = 20.0 + (np.arange(80 * hz) + 0.5) / hz
        position, q_eb = synthetic_flight(t)
        r, _, c_es = ecef(curve, t)
        errors.append((np.abs(r - position).max(), np.abs(c_es - oracle.matrix(q_eb)).max()))
    order = np.log2(np.array(errors[0]) / np.array(errors[1]))
    assert np.all(order > 5.5)
    assert np.all(order < 7.0)


def test_order_against_rotation_spline() -> None:
    """On a smooth known rotation: order 6 here against 4 for scipy's spline of rotation vectors."""
    position = np.array([oracle.A, 0.0, 0.0])

    def attitude(t: Array) -> Rotation:
        return Rotation.from_euler("ZYX", np.stack([0.9 * np.sin(t), 0.5 * np.cos(1.3 * t), 0.7 * t], axis=-1))

    ours, scipys = [], []
    for hz in (8.0, 16.0):
        time = np.arange(round(20 * hz) + 1) / hz
        t = 5.0 + (np.arange(10 * hz) + 0.5) / hz
        curve = Curve(time, np.tile(position, (len(time), 1)), attitude(time).as_quat(scalar_first=True))
        c_es = ecef(curve, t)[2]
        ours.append((Rotation.from_matrix(c_es) * attitude(t).inv()).magnitude().max())
        spline = RotationSpline(time, attitude(time))
        scipys.append((spline(t) * attitude(t).inv()).magnitude().max())
    assert 5.5 < np.log2(ours[0] / ours[1]) < 6.5
    assert 3.5 < np.log2(scipys[0] / scipys[1]) < 4.5
    assert ours[1] < 0.05 * scipys[1]


@pytest.mark.parametrize("mounted", [False, True])
def test_velocity_is_the_derivative_of_position(mounted: bool) -> None:
    options = {"lever_arm": LEVER, "q_bs": MOUNTING.as_quat(scalar_first=True)} if mounted else {}
    _, curve = flight_curve(60.0, **options)
    t, h = np.linspace(1.0, 59.0, 500), 0.02
    p = [ecef(curve, t + k * h)[0] for k in (-3, -2, -1, 1, 2, 3)]
    derivative = (45.0 * (p[3] - p[2]) - 9.0 * (p[4] - p[1]) + (p[5] - p[0])) / (60.0 * h)
    # the formula's own error: truncation far below, positions of one ulp (1e-9 m) over the step
    assert np.abs(derivative - ecef(curve, t)[1]).max() < 3e-7


def test_rates_are_the_derivative_of_attitude() -> None:
    _, curve = flight_curve(60.0, q_bs=MOUNTING.as_quat(scalar_first=True))
    t, h = np.linspace(1.0, 59.0, 500), 0.02
    c_es = ecef(curve, t)[2]

    def turn(k: int) -> Array:
        return (Rotation.from_matrix(c_es).inv() * Rotation.from_matrix(ecef(curve, t + k * h)[2])).as_rotvec()

    p = [turn(k) for k in (-3, -2, -1, 1, 2, 3)]
    omega_eb = (45.0 * (p[3] - p[2]) - 9.0 * (p[4] - p[1]) + (p[5] - p[0])) / (60.0 * h)
    expected = omega_eb + np.einsum("nji,j->ni", c_es, SPIN)
    # a rotation vector's rate is the angular rate at the angle 0; the spline's fifth derivative jumps at knots
    assert np.abs(curve.rates(t)[0] - expected).max() < 1e-9


def test_specific_force_from_the_velocity() -> None:
    """f = C_be [dv_e/dt + 2 ω_ie × v + ω_ie × (ω_ie × r) − gravitation], the derivative by differences."""
    _, curve = flight_curve(60.0, lever_arm=LEVER, q_bs=MOUNTING.as_quat(scalar_first=True))
    t, h = np.linspace(1.0, 59.0, 500), 0.001
    r, v, c_es = ecef(curve, t)
    p = [ecef(curve, t + k * h)[1] for k in (-2, -1, 1, 2)]
    acceleration = (8.0 * (p[2] - p[1]) - (p[3] - p[0])) / (12.0 * h)
    gravitation = np.array([oracle.gravitation(*row, oracle.ZONAL) for row in r])
    force = acceleration + 2.0 * np.cross(SPIN, v) + np.cross(SPIN, np.cross(SPIN, r)) - gravitation
    expected = np.einsum("nji,nj->ni", c_es, force)
    # the acceleration's third derivative jumps at the knots, by their rounding: 0.02 m/s⁵ h³ is 2e-11 m/s²; the
    # velocity's rounding of 1e-13 m/s over the step is 2e-10
    assert np.abs(curve.rates(t)[1] - expected).max() < 1e-9


def test_lever_arm_is_rigid_body_kinematics() -> None:
    """Position and velocity of the block from those of the body's point, its attitude and its rate."""
    t = np.linspace(0.0, 60.0, 301)
    _, bare = flight_curve(60.0)
    _, armed = flight_curve(60.0, lever_arm=LEVER, q_bs=MOUNTING.as_quat(scalar_first=True))
    r, v, c_eb = ecef(bare, t)
    omega_eb = bare.rates(t)[0] - np.einsum("nji,j->ni", c_eb, SPIN)
    rs, vs, c_es = ecef(armed, t)
    assert np.abs(rs - (r + c_eb @ LEVER)).max() < 1e-8
    assert np.abs(vs - (v + np.einsum("nij,nj->ni", c_eb, np.cross(omega_eb, LEVER)))).max() < 1e-11
    assert np.abs(c_es - c_eb @ MOUNTING.as_matrix()).max() < 1e-14
    # an ulp of a quaternion at a knot is 7e-15 rad/s over the panel, several times that at the ends of the spline
    assert np.abs(armed.rates(t)[0] - bare.rates(t)[0] @ MOUNTING.as_matrix()).max() < 1e-13


def test_increments_against_adaptive_quadrature() -> None:
    """Gauss-Legendre between knots against scipy's adaptive quadrature, on intervals with and without knots."""
    _, curve = flight_curve(30.0, lever_arm=LEVER)
    imu = curve.increments(100.0)
    for k in (0, 3, 1003, 1533, 2999):
        a, b = imu.time[k], imu.time[k + 1]
        knots = np.arange(0, 30 * KNOT_HZ) / KNOT_HZ
        inside = knots[(knots > a + 1e-9) & (knots < b - 1e-9)]
        integral, _ = quad_vec(
            lambda t: np.concatenate(curve.rates(np.clip(t, 0.0, 30.0))), a, b, points=inside, epsabs=1e-16
        )
        assert np.abs(imu.dtheta[k] - integral[:3]).max() < 1e-16
        assert np.abs(imu.dvel[k] - integral[3:]).max() < 5e-16


def test_increments_do_not_depend_on_the_rate() -> None:
    """Samples of 20 Hz are sums of those of 400 Hz: quadrature is converged."""
    _, curve = flight_curve(60.0, lever_arm=LEVER)
    fast, slow = curve.increments(400.0), curve.increments(20.0)
    assert np.abs(fast.dtheta.reshape(-1, 20, 3).sum(axis=1) - slow.dtheta).max() < 1e-16
    assert np.abs(fast.dvel.reshape(-1, 20, 3).sum(axis=1) - slow.dvel).max() < 3e-15


@pytest.mark.parametrize("rate_hz", [20.0, 100.0])  # six points on a piece, and four
def test_quadrature_is_converged_in_violent_motion(rate_hz: float) -> None:
    """4 rad/s of roll with knots at 20 Hz and a 10 m arm: more points change nothing but rounding."""
    t = np.arange(1201) / 20.0
    position = oracle.geodetic_to_ecef(0.7 + 3e-5 * t, 0.3 + 1e-6 * np.cos(3.0 * t), 3000.0 + 20.0 * np.sin(1.5 * t))
    turn = np.stack([np.cos(1.7 * t), 0.5 * np.sin(2.0 * t), 4.0 * t + 0.3 * np.sin(8.0 * t)], axis=-1)
    q_eb = Rotation.from_euler("ZYX", turn).as_quat(scalar_first=True)
    curve = Curve(t, position, q_eb, (10.0, -3.0, 1.0))
    imu = curve.increments(rate_hz)
    for value, reference in zip((imu.dtheta, imu.dvel), curve._integrals(imu.time, 16), strict=True):
        assert np.abs(value - reference).max() < 2e-15 * np.abs(reference).max()


def test_turntable_at_the_pole() -> None:
    """A block 2 m from the axis of a table that turns at the pole: constant rate and force, in closed form."""
    rate, arm, height = 0.5, 2.0, 100.0
    time = np.arange(30 * 120 + 1) / 30.0
    b = oracle.A * (1.0 - oracle.F)
    position = np.tile([0.0, 0.0, b + height], (len(time), 1))
    # down is −z; forward at longitude `angle`, turning clockwise seen from above (positive about down)
    c_eb = Rotation.from_euler("z", -rate * time[:, None]) * Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
    curve = Curve(time, position, c_eb.as_quat(scalar_first=True), (arm, 0.0, 0.0))
    imu = curve.increments(100.0)
    inertial = rate - oracle.OMEGA
    gx, _, gz = oracle.gravitation(arm, 0.0, b + height, oracle.ZONAL)
    # half the turn between knots is 0.008 rad; its sixth power leaves a smooth spline no visible error
    inner = slice(1000, -1000)
    assert np.abs(imu.dtheta[inner] - np.array([0.0, 0.0, inertial]) / 100.0).max() < 1e-14
    expected = np.array([-(inertial**2) * arm - gx, 0.0, gz]) / 100.0
    assert np.abs(imu.dvel[inner] - expected).max() < 1e-11
    s = curve.state(30.0)
    # away from the ends the block moves east or west only, at rate·arm relative to the Earth
    assert abs(np.linalg.norm(s.velocity_ned) - rate * arm) < 1e-10
    assert abs(np.degrees(s.latitude) - 90.0) < 1e-4


def test_curve_is_a_quintic_spline() -> None:
    """Between the knots the re-integrated curve is scipy's quintic spline to the knots' own rounding."""
    time, curve = flight_curve(600.0)
    position, _ = synthetic_flight(time)
    t = np.linspace(0.0, 600.0, 4321)
    spline = make_interp_spline(time, position - position[0], k=5)
    assert np.abs(ecef(curve, t)[0] - position[0] - spline(t)).max() < 1e-8


def test_same_numbers_on_one_thread_and_two(monkeypatch: pytest.MonkeyPatch) -> None:
    _, curve = flight_curve(120.0, lever_arm=LEVER)
    two, state_two = curve.increments(100.0), curve.state(np.linspace(0.0, 120.0, 12001))
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    one, state_one = curve.increments(100.0), curve.state(np.linspace(0.0, 120.0, 12001))
    assert np.array_equal(one.dvel, two.dvel)
    assert np.array_equal(one.dtheta, two.dtheta)
    assert np.array_equal(state_one.q_nb, state_two.q_nb)
    assert np.array_equal(state_one.latitude, state_two.latitude)


def test_shapes_and_edges() -> None:
    _, curve = flight_curve(10.0)
    assert curve.state(3.0).latitude.shape == ()
    assert curve.state(3.0).q_nb.shape == (4,)
    assert curve.rates([1.0, 2.0])[0].shape == (2, 3)
    imu = curve.increments(30.0)
    assert np.array_equal(imu.time, np.arange(301) / 30.0)
    assert curve.increments(0.3).time[-1] == 3 / 0.3
    assert len(curve.increments(0.3)) == 3
    curve.state(imu.time)


def test_a_state_is_the_same_alone_and_among_many() -> None:
    _, curve = flight_curve(10.0)
    t = np.linspace(0.0, 10.0, 57)
    many = curve.state(t)
    for k in (0, 1, 31, 56):
        one = curve.state(t[k])
        assert one.latitude == many.latitude[k]
        assert np.array_equal(one.q_nb, many.q_nb[k])


@pytest.mark.parametrize("t", [-0.001, 10.001, np.nan, [1.0, 11.0]])
def test_instants_outside(t: float | list[float]) -> None:
    _, curve = flight_curve(10.0)
    with pytest.raises(InputError, match="outside the trajectory"):
        curve.state(t)
    with pytest.raises(InputError, match="outside the trajectory"):
        curve.rates(t)


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf])
def test_bad_rates(rate: float) -> None:
    _, curve = flight_curve(10.0)
    with pytest.raises(InputError, match="must be one positive number"):
        curve.increments(rate)


def test_interval_longer_than_the_curve() -> None:
    _, curve = flight_curve(10.0)
    with pytest.raises(InputError, match="less than one sample interval of 20 s"):
        curve.increments(0.05)


def test_bad_knots() -> None:
    time = np.arange(100) / 30.0
    position, q = synthetic_flight(time)
    with pytest.raises(InputError, match="at least 6 knots, got 5"):
        Curve(time[:5], position[:5], q[:5])
    with pytest.raises(InputError, match="shapes"):
        Curve(time, position[1:], q)
    broken = position.copy()
    broken[7, 1] = np.nan
    with pytest.raises(InputError, match="knot 7: its position is not a finite number"):
        Curve(time, broken, q)
    late = time.copy()
    late[5] = late[4]
    with pytest.raises(InputError, match=r"knot 5 at 0\.1333.* is not later than"):
        Curve(late, position, q)
    with pytest.raises(InputError, match="norm 2, it must be 1"):
        Curve(time, position, 2.0 * q)
    turned = q.copy()
    turned[50:] = q[50:, [1, 0, 3, 2]] * np.array([-1.0, 1.0, 1.0, -1.0])  # half a turn about forward
    with pytest.raises(InputError, match=r"knots at 1\.63333\d* s and 1\.66666\d* s the attitude turns by 1[78]\d°"):
        Curve(time, position, turned)
    with pytest.raises(InputError, match="gravity model"):
        Curve(time, position, q, gravity="flat")


def test_quaternion_signs_do_not_matter() -> None:
    time = np.arange(100) / 30.0
    position, q = synthetic_flight(time)
    flipped = q * np.where(np.arange(100) % 3 == 0, 1.0, -1.0)[:, None]
    a, b = Curve(time, position, q).increments(50.0), Curve(time, position, flipped).increments(50.0)
    assert np.array_equal(a.dtheta, b.dtheta)
