"""Rotations against scipy's Rotation, central differences and hand-made hard cases."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim import jit, rotation
from sinssim.rotation.quaternions import half_angle_k, less_cross_k

ULP = np.finfo(float).eps


def random_quaternions(count, seed=1):
    return Rotation.random(count, random_state=seed).as_quat(scalar_first=True)


def same_rotation(q, expected, atol):
    """The two quaternions are one rotation: equal up to the common sign."""
    q, expected = np.asarray(q), np.asarray(expected)
    sign = np.sign(np.sum(q * expected, axis=-1, keepdims=True))
    assert np.all(np.abs(q * sign - expected) <= atol)


def hard_rotation_vectors():
    """Angles 0, tiny, around the switch from series to sines, near π and π itself, about awkward axes."""
    angles = [0.0, 1e-300, 1e-16, 1e-9, 1e-5, 1e-3, 0.2, 0.2449, 0.24495, 0.5, 1.0, 2.0, 3.0, np.pi - 1e-9, np.pi]
    axes = np.array([[1, 0, 0], [0, -1, 0], [0, 0, 1], [1, 1, 1], [1e-8, 1, -1e-8], [-3, 2, 0.1]], float)
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    return (np.array(angles)[:, None, None] * axes).reshape(-1, 3)


# --- against scipy ------------------------------------------------------------------------------------------


def test_multiply_is_scipys_composition():
    a, b = random_quaternions(500, 1), random_quaternions(500, 2)
    expected = Rotation.from_quat(a, scalar_first=True) * Rotation.from_quat(b, scalar_first=True)
    same_rotation(rotation.multiply(a, b), expected.as_quat(scalar_first=True), 4 * ULP)
    i, j, k = np.eye(4)[1:]  # Hamilton's: ij = k, not −k
    np.testing.assert_array_equal(rotation.multiply(i, j), k)
    np.testing.assert_array_equal(rotation.multiply(j, i), -k)


def test_conjugate_is_the_inverse():
    q = random_quaternions(50)
    expected = Rotation.from_quat(q, scalar_first=True).inv().as_quat(scalar_first=True)
    same_rotation(rotation.conjugate(q), expected, ULP)


def test_rotate_takes_b_into_a():
    q = random_quaternions(300)
    v = np.random.default_rng(3).normal(size=(300, 3)) * 10.0 ** np.arange(-3, 3).repeat(50)[:, None]
    expected = Rotation.from_quat(q, scalar_first=True).apply(v)
    np.testing.assert_allclose(
        rotation.rotate(q, v), expected, atol=0, rtol=1e-13 * np.linalg.norm(v, axis=1).max() / np.abs(expected).min()
    )
    scale = np.linalg.norm(v, axis=1, keepdims=True)
    np.testing.assert_allclose(rotation.rotate(q, v) / scale, expected / scale, atol=6 * ULP, rtol=0)
    # heading 90°: forward is east
    np.testing.assert_allclose(
        rotation.rotate(rotation.quaternion_from_euler(0, 0, np.pi / 2), [1, 0, 0]), [0, 1, 0], atol=ULP, rtol=0
    )


def test_dcm_is_scipys():
    q = random_quaternions(500)
    expected = Rotation.from_quat(q, scalar_first=True).as_matrix()
    np.testing.assert_allclose(rotation.dcm_from_quaternion(q), expected, atol=5 * ULP, rtol=0)
    hard = Rotation.from_rotvec(hard_rotation_vectors())
    got = rotation.dcm_from_quaternion(hard.as_quat(scalar_first=True))
    np.testing.assert_allclose(got, hard.as_matrix(), atol=5 * ULP, rtol=0)


def test_quaternion_from_dcm_in_every_branch():
    hard = Rotation.concatenate(
        [
            Rotation.from_rotvec(hard_rotation_vectors()),
            Rotation.random(500, random_state=5),
            Rotation.from_rotvec((np.pi - 10.0 ** -np.arange(1, 16))[:, None] * np.array([[0.6, -0.64, 0.48]])),
        ]
    )
    q = rotation.quaternion_from_dcm(hard.as_matrix())
    same_rotation(q, hard.as_quat(scalar_first=True), 5 * ULP)
    assert np.all(q[:, 0] >= 0)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1, atol=3 * ULP, rtol=0)
    half_turns = np.array([np.diag(d) for d in ([1, -1, -1], [-1, 1, -1], [-1, -1, 1])], float)
    np.testing.assert_allclose(np.abs(rotation.quaternion_from_dcm(half_turns)), np.eye(4)[1:], atol=ULP, rtol=0)


def test_quaternion_from_rotation_vector_is_scipys():
    v = np.concatenate([hard_rotation_vectors(), np.random.default_rng(4).normal(size=(300, 3)) * 3])
    expected = Rotation.from_rotvec(v).as_quat(scalar_first=True)
    # the angle itself is rounded, and sin and cos pass that on
    bar = ULP * (3 + np.linalg.norm(v, axis=1, keepdims=True))
    same_rotation(rotation.quaternion_from_rotation_vector(v), expected, bar)


def test_small_rotation_vectors_keep_their_relative_precision():
    """At 1e-9 rad the vector part is φ/2 to the last digit, where a sine of a rounded norm would do as well."""
    v = np.array([3e-10, -4e-10, 1.2e-9])
    q = rotation.quaternion_from_rotation_vector(v)
    assert q[0] == 1.0
    np.testing.assert_allclose(q[1:], v / 2, rtol=2 * ULP)
    np.testing.assert_allclose(rotation.rotation_vector_from_quaternion(q), v, rtol=2 * ULP)
    np.testing.assert_array_equal(rotation.quaternion_from_rotation_vector(np.zeros(3)), [1, 0, 0, 0])
    np.testing.assert_array_equal(rotation.rotation_vector_from_quaternion([1.0, 0, 0, 0]), [0, 0, 0])
    np.testing.assert_array_equal(rotation.rotation_vector_from_quaternion([-1.0, 0, 0, 0]), [0, 0, 0])


def test_rotation_vector_series_meets_the_closed_form():
    """Both sides of the switch between series and sines against extended precision."""
    x2 = np.concatenate([np.geomspace(1e-12, 0.0599, 50), np.geomspace(0.0601, 9.0, 50)])
    x = np.sqrt(x2.astype(np.longdouble))
    wanted = np.stack([np.sin(x) / x, (2 * np.sin(x / 2) ** 2) / x**2, _sine_remainder(x)], axis=1)
    half = np.stack([np.cos(x / 2), np.sin(x / 2) / x], axis=1)
    got = np.array([rotation.rotation_series_k(value) for value in x2])
    np.testing.assert_allclose(got[:, :2], np.float64(wanted[:, :2]), rtol=4 * ULP)
    # (1 − sin x/x)/x² loses up to 6/x² ulps just above the switch: 1e2 ulps of 1/6
    np.testing.assert_allclose(got[:, 2], np.float64(wanted[:, 2]), atol=25 * ULP, rtol=0)
    np.testing.assert_allclose(got[:50, 2], np.float64(wanted[:50, 2]), rtol=2 * ULP)
    got = np.array([rotation.half_angle_series_k(value) for value in x2])
    np.testing.assert_allclose(got, np.float64(half), atol=2 * ULP, rtol=0)


def test_half_angle_from_sine_and_cosine_all_around():
    """Against extended precision; at the quarter turns, where a sum or a difference of the cosine cancels, too."""
    small = np.geomspace(1e-12, 0.1, 12)
    quarters = np.pi * np.arange(-2, 3)[:, None] / 2
    angles = np.concatenate([np.linspace(-3.1, 3.1, 63), (quarters + small).ravel(), (quarters - small).ravel()])
    angles = angles[np.abs(angles) < np.pi].astype(np.longdouble)
    c, s = np.float64(np.cos(angles)), np.float64(np.sin(angles))
    got = np.array([half_angle_k(*pair) for pair in zip(c, s, strict=True)])
    wanted = np.float64(np.stack([np.cos(angles / 2), np.sin(angles / 2)], axis=1))
    np.testing.assert_allclose(got, wanted, rtol=3 * ULP, atol=0)
    assert half_angle_k(1.0, 0.0) == (1.0, 0.0)
    assert half_angle_k(-1.0, 0.0) == (0.0, 1.0)
    assert half_angle_k(-1.0, -1e-300)[1] == -1.0


def _sine_remainder(x):
    """(x − sin x)/x³ in extended precision without cancellation."""
    total, term = np.zeros_like(x), np.ones_like(x) / 6
    for n in range(1, 30):
        total = total + term
        term = -term * x * x / ((2 * n + 2) * (2 * n + 3))
    return total


def test_rotation_vector_from_quaternion_is_scipys():
    hard = Rotation.concatenate([Rotation.from_rotvec(hard_rotation_vectors()), Rotation.random(300, random_state=8)])
    q = hard.as_quat(scalar_first=True)
    for sign in (1, -1):
        got = rotation.rotation_vector_from_quaternion(sign * q)
        expected = hard.as_rotvec()
        straight = np.linalg.norm(got - expected, axis=1)
        around = np.linalg.norm(got + expected, axis=1)  # at π both vectors name the same rotation
        at_pi = np.linalg.norm(expected, axis=1) > np.pi - 1e-12
        assert np.max(np.where(at_pi, np.minimum(straight, around), straight)) < 8 * ULP
        assert np.max(np.linalg.norm(got, axis=1)) <= np.pi + 4 * ULP


# --- Euler angles -------------------------------------------------------------------------------------------


def test_euler_angles_are_scipys_zyx():
    rng = np.random.default_rng(6)
    roll, heading = rng.uniform(-np.pi, np.pi, (2, 400))
    pitch = rng.uniform(-1.57, 1.57, 400)
    expected = Rotation.from_euler("ZYX", np.stack([heading, pitch, roll], -1))
    q = rotation.quaternion_from_euler(roll, pitch, heading)
    same_rotation(q, expected.as_quat(scalar_first=True), 4 * ULP)
    psi, theta, phi = expected.as_euler("ZYX").T
    got = rotation.euler_from_quaternion(expected.as_quat(scalar_first=True))
    steep = 1 / np.cos(pitch)  # roll and heading are that ill-conditioned
    assert np.all(np.abs(got[0] - phi) < 8 * ULP * steep + 4 * ULP)
    np.testing.assert_allclose(got[1], theta, atol=8 * ULP, rtol=0)
    difference = np.abs(got[2] - np.mod(psi, 2 * np.pi))
    assert np.all(np.minimum(difference, 2 * np.pi - difference) < 8 * ULP * steep + 8 * ULP)


def test_signs_of_single_angles():
    """Roll: right wing down; pitch: nose up; heading: clockwise from north."""
    angle = 0.3
    down = rotation.rotate(rotation.quaternion_from_euler(angle, 0, 0), [0, 1, 0])
    np.testing.assert_allclose(down, [0, np.cos(angle), np.sin(angle)], atol=ULP, rtol=0)
    up = rotation.rotate(rotation.quaternion_from_euler(0, angle, 0), [1, 0, 0])
    np.testing.assert_allclose(up, [np.cos(angle), 0, -np.sin(angle)], atol=ULP, rtol=0)
    east = rotation.rotate(rotation.quaternion_from_euler(0, 0, angle), [1, 0, 0])
    np.testing.assert_allclose(east, [np.cos(angle), np.sin(angle), 0], atol=ULP, rtol=0)


def test_a_small_pitch_keeps_its_relative_precision():
    for pitch in (1e-9, -3e-5, 1e-3):
        got = rotation.euler_from_quaternion(rotation.quaternion_from_euler(0.0, pitch, 0.0))[1]
        assert got == pytest.approx(pitch, rel=4 * ULP, abs=0.0)


def test_euler_ranges():
    """Heading in [0, 2π), roll in (−π, π], pitch in [−π/2, π/2], at the seams and one ulp off them."""
    ends = [-np.pi, -np.pi + 1e-15, -1e-17, -0.0, 0.0, 1e-17, np.pi / 2, np.pi - 1e-15, np.pi, 2 * np.pi - 1e-15]
    roll, pitch, heading = np.meshgrid(ends, [-np.pi / 2, -1.5, -1e-17, 0, 1.0, np.pi / 2], ends)
    got = rotation.euler_from_quaternion(rotation.quaternion_from_euler(roll, pitch, heading))
    assert np.all((got[0] > -np.pi) & (got[0] <= np.pi))
    assert np.all(np.abs(got[1]) <= np.pi / 2)
    assert np.all((got[2] >= 0) & (got[2] < 2 * np.pi))
    assert rotation.euler_from_quaternion([0.0, 1.0, 0.0, 0.0])[0] == np.pi  # upside down is +180°
    assert rotation.euler_from_quaternion([0.0, -1.0, 0.0, 0.0])[0] == np.pi
    just_west_of_north = rotation.euler_from_quaternion([1.0, 0.0, 0.0, -1e-20])[2]
    assert just_west_of_north == 0.0  # not 2π


@pytest.mark.parametrize("sign", [1, -1])
def test_vertical_attitude(sign):
    """At ±90° of pitch only heading ∓ roll is defined; what comes back is the same rotation, with roll 0."""
    for roll, heading in ((0.0, 0.4), (0.3, 1.0), (-2.0, 5.0), (3.0, 0.0)):
        q = rotation.quaternion_from_euler(roll, sign * np.pi / 2, heading)
        matrix = Rotation.from_quat(q, scalar_first=True).as_matrix()
        got = rotation.euler_from_quaternion(q)
        assert got[1] == pytest.approx(sign * np.pi / 2, abs=4 * ULP)
        back = Rotation.from_euler("ZYX", [got[2], got[1], got[0]]).as_matrix()
        np.testing.assert_allclose(back, matrix, atol=10 * ULP, rtol=0)
    exact = [np.sqrt(0.5), 0.0, sign * np.sqrt(0.5), 0.0]  # nose straight up or down
    assert rotation.euler_from_quaternion(exact)[0] == 0.0
    np.testing.assert_allclose(rotation.euler_from_quaternion(exact), [0, sign * np.pi / 2, 0], atol=ULP, rtol=0)


@pytest.mark.parametrize("gap", [*10.0 ** -np.arange(1, 15.0, 1.5), 4e-16])
@pytest.mark.parametrize("sign", [1, -1])
def test_near_the_vertical_the_angles_still_give_the_attitude(gap, sign):
    q = rotation.quaternion_from_euler(0.7, sign * (np.pi / 2 - gap), 2.5)
    got = np.array(rotation.euler_from_quaternion(q))
    back = Rotation.from_euler("ZYX", got[::-1]).as_matrix()
    np.testing.assert_allclose(back, Rotation.from_quat(q, scalar_first=True).as_matrix(), atol=10 * ULP, rtol=0)
    assert got[1] == pytest.approx(sign * (np.pi / 2 - gap), abs=4 * ULP)


# --- rates --------------------------------------------------------------------------------------------------


def test_product_rule_of_attitude():
    """q̇ = ½ q ∘ ω and Ċ = C [ω×] with ω in the moving axes: the sign and side of every update in the package."""
    w0, w1 = np.array([0.3, -0.2, 0.5]), np.array([-0.1, 0.4, 0.2])

    def attitude(t):  # two successive turns, the second in the moving axes
        first = Rotation.from_rotvec(w0 * t)
        second = Rotation.from_rotvec(w1 * t)
        return first * second, second.inv().apply(w0) + w1

    t, h = 0.8, 1e-3
    states = [attitude(t + k * h)[0].as_matrix() for k in (-2, -1, 1, 2)]
    slope = (8 * (states[2] - states[1]) - (states[3] - states[0])) / (12 * h)
    now, omega = attitude(t)
    q = now.as_quat(scalar_first=True)
    q_dot = rotation.multiply(q, [0.0, *omega]) / 2
    matrices = [rotation.dcm_from_quaternion(rotation.normalize(q + k * h * q_dot)) for k in (-1, 1)]
    np.testing.assert_allclose((matrices[1] - matrices[0]) / (2 * h), slope, atol=2e-7, rtol=0)
    cross = np.stack([rotation.cross_k(*omega, *axis) for axis in np.eye(3)], axis=1)
    np.testing.assert_allclose(rotation.dcm_from_quaternion(q) @ cross, slope, atol=1e-11, rtol=0)


def test_a_step_about_the_moving_axes_is_a_product_on_the_right():
    q = random_quaternions(20)
    phi = np.random.default_rng(9).normal(size=(20, 3))
    stepped = rotation.multiply(q, rotation.quaternion_from_rotation_vector(phi))
    expected = Rotation.from_quat(q, scalar_first=True) * Rotation.from_rotvec(phi)
    same_rotation(stepped, expected.as_quat(scalar_first=True), 6 * ULP)


# --- shapes, kernels, errors --------------------------------------------------------------------------------


def test_shapes_broadcast():
    q = random_quaternions(6).reshape(2, 3, 4)
    assert rotation.multiply(q, q[0, 0]).shape == (2, 3, 4)
    assert rotation.multiply(q[:, :1], q[:1]).shape == (2, 3, 4)
    assert rotation.rotate(q[0, 0], np.zeros((5, 3))).shape == (5, 3)
    assert rotation.rotate(q, [1.0, 0, 0]).shape == (2, 3, 3)
    assert rotation.dcm_from_quaternion(q).shape == (2, 3, 3, 3)
    assert rotation.dcm_from_quaternion(q[0, 0]).shape == (3, 3)
    assert rotation.quaternion_from_dcm(np.eye(3)).shape == (4,)
    assert rotation.quaternion_from_euler(0.1, np.zeros(4), np.zeros((3, 1))).shape == (3, 4, 4)
    assert [angle.shape for angle in rotation.euler_from_quaternion(q)] == [(2, 3)] * 3
    assert rotation.quaternion_from_rotation_vector(np.empty((0, 3))).shape == (0, 4)
    assert rotation.normalize(3 * q).shape == q.shape
    np.testing.assert_allclose(rotation.normalize(3 * q), q, atol=2 * ULP, rtol=0)
    fortran = np.asfortranarray(random_quaternions(7))
    np.testing.assert_array_equal(rotation.conjugate(rotation.conjugate(fortran)), fortran)
    np.testing.assert_array_equal(
        rotation.dcm_from_quaternion(fortran), rotation.dcm_from_quaternion(np.ascontiguousarray(fortran))
    )
    np.testing.assert_array_equal(rotation.rotate([1, 0, 0, 0], [1, 2, 3]), [1.0, 2.0, 3.0])  # whole numbers too


@pytest.mark.parametrize(
    ("call", "wanted", "got"),
    [
        (lambda: rotation.multiply(np.zeros(3), np.zeros(4)), 4, r"\(3,\)"),
        (lambda: rotation.rotate(np.eye(4), np.zeros(2)), 3, r"\(2,\)"),
    ],
)
def test_wrong_shapes_are_refused(call, wanted, got):
    with pytest.raises(
        ValueError, match=rf"expected an array with {wanted} values in its last axis, got shape {got}\."
    ):
        call()


def test_kernels_are_the_array_functions():
    q, p = random_quaternions(2)
    v = np.array([0.3, -2.0, 1.1])
    angles = np.array([0.4, -0.9, 2.2])
    c = rotation.dcm_from_quaternion(q)
    pairs = [
        (rotation.multiply_k(*q, *p), rotation.multiply(q, p)),
        (rotation.rotate_k(*q, *v), rotation.rotate(q, v)),
        (rotation.dcm_from_quaternion_k(*q), c.ravel()),
        (rotation.quaternion_from_dcm_k(*c.ravel()), rotation.quaternion_from_dcm(c)),
        (rotation.quaternion_from_rotation_vector_k(*v), rotation.quaternion_from_rotation_vector(v)),
        (rotation.rotation_vector_from_quaternion_k(*q), rotation.rotation_vector_from_quaternion(q)),
        (rotation.quaternion_from_euler_k(*angles), rotation.quaternion_from_euler(*angles)),
        (rotation.euler_from_quaternion_k(*q), rotation.euler_from_quaternion(q)),
        (rotation.cross_k(*v, *angles), np.cross(v, angles)),
        (less_cross_k(1.0, 2.0, -3.0, *v, *angles), np.array([1.0, 2.0, -3.0]) - np.cross(v, angles)),
    ]
    for scalar, array in pairs:
        np.testing.assert_allclose(scalar, array, rtol=2 * ULP, atol=2 * ULP)


# --- sine and cosine ----------------------------------------------------------------------------------------


@jit.kernel
def _sincos_rows(x, s, c):
    """A caller with fastmath, which must not reorder the reduction of the argument."""
    for i in range(len(x)):
        s[i], c[i] = rotation.sincos_k(x[i])


def test_sincos_is_the_librarys_to_rounding():
    """Small and large angles, the seams between octants, and beyond the range of the reduction."""
    seams = np.arange(-1300, 1300) * np.pi / 4
    x = np.concatenate(
        [np.linspace(-1000, 1000, 100_001), np.linspace(-7, 7, 10_001), seams, [1e-300, 0.0, 1234.5, -1e6]]
    )
    s, c = np.empty_like(x), np.empty_like(x)
    _sincos_rows(x, s, c)
    np.testing.assert_allclose(s, np.sin(x), rtol=0, atol=2 * ULP)
    np.testing.assert_allclose(c, np.cos(x), rtol=0, atol=2 * ULP)
    small = np.abs(x) < 0.7
    np.testing.assert_allclose(s[small], np.sin(x[small]), rtol=2 * ULP, atol=0)
