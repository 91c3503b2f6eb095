"""Every attitude algorithm against what theory says of it: its error per step, its drift, its defect, its order.

The laws come from the literature and from exact series worked out here in fractions; motions and their increments are
closed forms. Single steps run uncompiled (`py_func`), whole navigation compiled.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from math import atan2, factorial, prod

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.special import j1

from sinssim import ALGORITHMS, ImuData, InputError, NavState, navigate
from sinssim.strapdown import iteration_windows as windows
from sinssim.strapdown.attitude import REGISTRY, rotation_vector
from sinssim.strapdown.attitude import rotation_vector as coning_drift
from sinssim.strapdown.attitude.quaternion_picard import unit_k
from sinssim.strapdown.coning_sculling import BodyTurn, FrameTurn
from sinssim.strapdown.engine_assembly import parts
from tests.oracles.s_turn import Flight, STurn
from tests.slow import slow
from tests.strapdown.variants import VARIANTS, with_slow_variants

NO_TURN = FrameTurn(*[0.0] * 12)
AXIS = np.array([2.0, -3.0, 6.0]) / 7

# --- one step -----------------------------------------------------------------------------------------------


def body_turn(theta):
    return BodyTurn(*theta, *[0.0] * 9, *theta, *[0.0] * 6, *theta)


def part(algorithm, name):
    return parts(algorithm)[name].py_func


def turned(algorithm, theta, steps=1):
    """The unit quaternion and the defect after some steps by a rotation vector, from no turn at all."""
    attitude = part(algorithm, "start_k")(1.0, 0.0, 0.0, 0.0)
    for _ in range(steps):
        attitude = part(algorithm, "step_k")(attitude, body_turn(theta), NO_TURN)
    *q, defect = part(algorithm, "quaternion_k")(attitude)
    return np.array(q), defect


QUATERNION_STEP = {1: (-1 / 12, 2), 2: (1 / 24, 2), 3: (1 / 480, 4), 4: (-1 / 1920, 4)}
POISSON_STEP = {1: (-1 / 3, 2), 2: (1 / 6, 2), 3: (1 / 30, 4), 4: (-1 / 120, 4)}
STEPS = [
    *((f"quaternion-{n}{end}", *law) for n, law in QUATERNION_STEP.items() for end in ("", "-norm")),
    *((f"poisson-{n}{end}", *law) for n, law in POISSON_STEP.items() for end in ("", "-ortho")),
    ("two-quaternions", *QUATERNION_STEP[2]),
    ("poisson", *POISSON_STEP[4]),
]


@pytest.mark.parametrize(("algorithm", "coefficient", "power"), STEPS)
def test_constant_rate_error_of_a_step(algorithm, coefficient, power):
    theta = 0.1
    q, _ = turned(algorithm, theta * AXIS)
    angle = 2 * atan2(float(np.linalg.norm(q[1:])), q[0])
    assert angle / theta - 1 == pytest.approx(coefficient * theta**power, rel=0.01, abs=0)
    np.testing.assert_allclose(q[1:] / np.linalg.norm(q[1:]), AXIS, rtol=0, atol=1e-15)  # the axis is kept


@pytest.mark.parametrize("algorithm", ["quaternion", "rotation-vector-1", "rotation-vector-4"])
def test_exact_steps(algorithm):
    q, defect = turned(algorithm, 0.4 * AXIS)
    np.testing.assert_allclose(q, [np.cos(0.2), *np.sin(0.2) * AXIS], rtol=0, atol=1e-16)
    assert defect < 3e-16


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("kind", ["quaternion", "poisson"])
def test_defect_grows_as_the_truncated_series_stretches(kind, order):
    """The truncated exponential of iθ has a modulus that is not one; n steps raise it to the n-th power."""
    theta, steps = 0.2, 40
    x = theta / 2 if kind == "quaternion" else theta
    modulus = abs(sum((1j * x) ** k / factorial(k) for k in range(order + 1)))
    _, defect = turned(f"{kind}-{order}", theta * np.array([0.0, 0.0, 1.0]), steps)
    expected = modulus**steps - 1 if kind == "quaternion" else modulus ** (2 * steps) - 1
    assert defect == pytest.approx(abs(expected), rel=1e-6, abs=0)


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_restored_variables_keep_to_rounding(order):
    for algorithm in (f"quaternion-{order}-norm", f"poisson-{order}-ortho"):
        _, defect = turned(algorithm, 0.2 * AXIS, 40)
        assert defect < 1e-15


def test_poisson_output_is_the_nearest_rotation_however_far_the_matrix_grew():
    """First-order steps by θ about one axis turn by atan θ and stretch by √(1 + θ²): 400 of them by 50."""
    theta, steps = 0.14, 400
    q, defect = turned("poisson-1", theta * np.array([0.0, 0.0, 1.0]), steps)
    assert defect > 1000
    half = 0.5 * steps * np.arctan(theta)
    np.testing.assert_allclose(abs(q @ [np.cos(half), 0, 0, np.sin(half)]), 1, rtol=0, atol=1e-13)


def test_two_quaternions_in_the_chapters_axes():
    """(8.19) in X forward, Y up, Z right gives the components of the package's own axes, turned."""
    from sinssim.strapdown.attitude.two_quaternions import picard_step_k

    rng = np.random.default_rng(5)
    q, beta = rng.normal(size=4), 0.1 * rng.normal(size=3)

    def chapter(v):  # forward, right, down -> forward, up, right
        return [v[0], -v[2], v[1]]

    ours = np.array(picard_step_k.py_func(*q, *beta))
    theirs = picard_step_k.py_func(q[0], *chapter(q[1:]), *chapter(beta))
    np.testing.assert_allclose(theirs, [ours[0], *chapter(ours[1:])], rtol=0, atol=1e-15)


def test_two_quaternions_turn_with_the_frame():
    """Body and frame turning together leave the attitude; the frame alone turns it backwards."""
    step, quaternion = part("two-quaternions", "step_k"), part("two-quaternions", "quaternion_k")
    attitude = part("two-quaternions", "start_k")(1.0, 0.0, 0.0, 0.0)
    u = 1e-3 * AXIS
    frame = FrameTurn(*u, *u, *u, *u)
    assert quaternion(step(attitude, body_turn(u), frame))[:4] == pytest.approx([1, 0, 0, 0], abs=1e-16)
    q = quaternion(step(attitude, body_turn(0 * u), frame))[:4]
    assert q == pytest.approx([np.cos(5e-4), *-np.sin(5e-4) * AXIS], abs=1e-10)


# --- coefficients, derived here -----------------------------------------------------------------------------


def solve(rows, right):
    """Solve linear equations in fractions."""
    m = [[*row, value] for row, value in zip(rows, right, strict=True)]
    for i in range(len(m)):
        pivot = next(r for r in range(i, len(m)) if m[r][i])
        m[i], m[pivot] = m[pivot], m[i]
        m[i] = [v / m[i][i] for v in m[i]]
        m = [row if r == i else [a - row[i] * b for a, b in zip(row, m[i], strict=True)] for r, row in enumerate(m)]
    return [row[-1] for row in m]


def sine(k, power):
    """Coefficient of x^power in sin kx."""
    return Fraction(0) if power % 2 == 0 else Fraction((-1) ** (power // 2) * k**power, factorial(power))


def pair_series(s, power):
    """Coefficient of x^power in (2 − 2 cos x) sin sx = 2 sin sx − sin (s+1)x − sin (s−1)x.

    Under coning by α at Ω, this times α² is the mean of Δθᵢ × Δθᵢ₊ₛ about the cone's axis, x = Ωh.
    """
    return 2 * sine(s, power) - sine(s + 1, power) - sine(s - 1, power)


def coning_series(n, power):
    """Coefficient of x^power in ½ (nx − sin nx), what the increments of n samples miss of the rotation vector / α²."""
    return (Fraction(n, 2) if power == 1 else 0) - sine(n, power) / 2


def law(n):
    """n!/(2ⁿ⁺¹ (2n+1)!!)."""
    return Fraction(factorial(n), 2 ** (n + 1) * prod(range(1, 2 * n + 2, 2)))


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_coning_coefficients(n):
    powers = [2 * k + 1 for k in range(1, n)]
    total = solve(
        [[pair_series(s, power) for s in range(1, n)] for power in powers], [coning_series(n, p) for p in powers]
    )
    # n − s pairs lie at a distance s
    table = rotation_vector.COEFFICIENTS[n - 1]
    assert [(n - s) * table[s - 1] for s in range(1, n)] == pytest.approx([float(t) for t in total], rel=1e-15, abs=0)
    assert all(value == 0 for value in table[n - 1 :])
    # and the first term that is left is the published drift, per sample
    left = coning_series(n, 2 * n + 1) - sum(t * pair_series(s + 1, 2 * n + 1) for s, t in enumerate(total))
    assert abs(left) / n == law(n)


def test_coning_coefficient_with_the_previous_sample():
    assert Fraction(1, 12) == coning_series(1, 3) / pair_series(1, 3)
    assert pytest.approx(1 / 12, rel=1e-15, abs=0) == rotation_vector.PREVIOUS_COEFFICIENT
    assert abs(coning_series(1, 5) - Fraction(1, 12) * pair_series(1, 5)) == Fraction(1, 60)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_edge_weights(n):
    """The polynomial with the given integrals over n unit intervals, at its start, times n."""
    integrals = [[Fraction((i + 1) ** (m + 1) - i ** (m + 1), m + 1) for i in range(n)] for m in range(n)]
    weights = solve(integrals, [Fraction(n)] + [Fraction(0)] * (n - 1))
    assert list(rotation_vector.EDGE[n - 1][:n]) == pytest.approx([float(w) for w in weights], rel=1e-15, abs=0)


# --- coning and sculling ------------------------------------------------------------------------------------


def multiply(a, b):
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def exponential(phi):
    angle = np.linalg.norm(phi)
    return np.array([np.cos(angle / 2), *np.sinc(angle / 2 / np.pi) / 2 * phi])


def updates(algorithm, dtheta, dvel):
    """Rotation vectors and velocity increments of consecutive updates."""
    samples = REGISTRY[algorithm].samples
    turn = part(algorithm, "turn_k")
    for k in range(len(dtheta) // samples):
        body = turn(dtheta, dvel, np.empty((1, 10)), True, k)
        yield np.array(body[:3]), np.array(body[3:6])


CONING = [
    ("rotation-vector-1", 1.0, 60, float(law(1)), 2),
    ("rotation-vector-1p", 1.0, 60, 1 / 60, 4),
    ("rotation-vector-2", 1.0, 60, float(law(2)), 4),
    ("rotation-vector-3", 1.0, 36, float(law(3)), 6),
    # of four samples' drift, triple products leave a floor that falls with α² and with (Ωh)⁴ more slowly
    ("rotation-vector-4", 0.1, 20, float(law(4)), 8),
    ("rotation-vector-4", 0.02, 36, float(law(4)), 8),
]


# the ends of the range in which the leading term alone holds (`coning_drift`), as near as whole updates come to them
CONING_ENDS = [
    ("rotation-vector-1", 1.0, 9, float(law(1)), 2),  # Ωh = 0.70
    ("rotation-vector-1p", 1.0, 13, 1 / 60, 4),  # 0.48
    ("rotation-vector-2", 1.0, 13, float(law(2)), 4),
    ("rotation-vector-3", 1.0, 15, float(law(3)), 6),  # 0.42
    ("rotation-vector-3", 1.0, 57, float(law(3)), 6),  # 0.11
    ("rotation-vector-4", 0.1, 16, float(law(4)), 8),  # 0.39
    ("rotation-vector-4", 0.1, 22, float(law(4)), 8),  # 0.29
]


def measured_drift(algorithm, alpha, per_turn):
    """Drift over two turns of a cone at Ω = 1."""
    t = 2 * np.pi * np.arange(per_turn * 2 + 1) / per_turn
    # ω = (−sin α sin t, sin α cos t, cos α − 1)
    dtheta = np.diff(
        np.stack([np.sin(alpha) * np.cos(t), np.sin(alpha) * np.sin(t), -2 * np.sin(alpha / 2) ** 2 * t]).T, axis=0
    )
    q = np.array([1.0, 0, 0, 0])
    shift = int(algorithm.endswith("p"))  # the first update has no sample before it
    if shift:
        dtheta = np.concatenate([dtheta[-1:], dtheta])
    for phi, _ in list(updates(algorithm, dtheta, np.zeros_like(dtheta)))[shift:]:
        q = multiply(q, exponential(phi))
    # after whole turns the true attitude is where it was; the cone's axis is tilted by α in body axes
    return 2 * np.arcsin(np.linalg.norm(q[1:])) / t[-1]


@pytest.mark.parametrize(("algorithm", "degrees", "per_turn", "coefficient", "power"), [*CONING, *CONING_ENDS])
def test_coning_drift(algorithm, degrees, per_turn, coefficient, power):
    """ε = α²Ω (Ωh)²ⁿ n!/(2ⁿ⁺¹ (2n+1)!!); with the previous sample (Ωh)⁴/60; over whole turns of the cone, Ω = 1."""
    alpha, step = np.deg2rad(degrees), 2 * np.pi / per_turn
    drift = measured_drift(algorithm, alpha, per_turn)
    assert drift == pytest.approx(alpha**2 * step**power * coefficient, rel=0.03, abs=0)


CLOSED = [
    ("rotation-vector-1", 1, False), ("rotation-vector-1p", 1, True), ("rotation-vector-2", 2, False),
    ("rotation-vector-3", 3, False), ("rotation-vector-4", 4, False),
]  # fmt: skip


@pytest.mark.parametrize("per_turn", [6, 12, 36, 60])
@pytest.mark.parametrize("degrees", [0.1, 1.0, 10.0])
@pytest.mark.parametrize(("algorithm", "samples", "previous"), CLOSED)
def test_coning_drift_is_the_exact_one(algorithm, samples, previous, degrees, per_turn):
    """At any Ωh and α, floor and all; what two turns in double precision leave of it is 1e-17 rad."""
    alpha = np.deg2rad(degrees)
    exact = coning_drift.drift_under_coning(samples, alpha, 1.0, 2 * np.pi / per_turn, previous)
    assert measured_drift(algorithm, alpha, per_turn) == pytest.approx(abs(exact), rel=3e-6, abs=1e-19)


FLOORS = {"1p": (1 / 160, 1 / 576), "2": (1 / 60, 1 / 36), "3": (1 / 160, 71 / 320), "4": (1 / 140, 9341 / 7560)}
NEXT = {"1": 1 / 20, "1p": 5 / 42, "2": 5 / 42, "3": 7 / 36, "4": 3 / 11}


@pytest.mark.parametrize(("algorithm", "samples", "previous"), CLOSED)
def test_series_of_the_exact_coning_drift(algorithm, samples, previous):
    """Leading term, the next one, and the floor of triple products, apart from one another."""
    name, power = algorithm.rsplit("-", 1)[1], 4 if previous else 2 * samples
    coefficient = 1 / 60 if previous else float(law(samples))
    small, large = 1e-7, 1e-2

    def seen(alpha, x):
        return coning_drift.drift_under_coning(samples, alpha, 1.0, x, previous) / alpha**2

    assert coning_drift.leading_drift_under_coning(samples, 0.3, 2.0, 0.05, previous) == pytest.approx(
        0.3**2 * 2.0 * 0.1**power * coefficient, rel=1e-14, abs=0
    )
    x = 0.3  # the first term that is left out is x⁴ of the leading one, about b²
    expected = -coefficient * x**power * (1 - NEXT[name] * x**2)
    assert seen(small, x) == pytest.approx(expected, rel=NEXT[name] ** 2 * x**4, abs=0)
    x = 0.1
    floor = (seen(large, x) - seen(small, x)) / large**2
    if name == "1":  # sin²α in place of α²
        assert floor == pytest.approx(coefficient * x**2 / 3, rel=2e-3, abs=0)
    else:
        c, d = FLOORS[name]
        assert floor == pytest.approx(c * x**4 - d * x**6, rel=1e-3, abs=2 * x**8)


RANGES = [
    (1, 1.0, False, 0.02, 0.778), (1, 1.0, True, 0.02, 0.504), (2, 1.0, False, 0.02, 0.504),
    (3, 1.0, False, 0.108, 0.479), (4, 0.1, False, 0.279, 0.430),
]  # fmt: skip


@pytest.mark.parametrize(("samples", "degrees", "previous", "low", "high"), RANGES)
def test_where_the_leading_term_of_the_coning_drift_holds(samples, degrees, previous, low, high):
    """To 3 %, between the stated Ωh and not beyond."""

    def off(x):
        case = (samples, np.deg2rad(degrees), 1.0, x, previous)
        return abs(abs(coning_drift.drift_under_coning(*case)) / coning_drift.leading_drift_under_coning(*case) - 1)

    assert max(off(x) for x in np.geomspace(low, high, 200)) < 0.03
    assert off(1.02 * high) > 0.03
    assert low == 0.02 or off(0.98 * low) > 0.03


@pytest.mark.parametrize(("algorithm", "_", "per_turn", "coefficient", "power"), CONING)
def test_sculling_drift(algorithm, _, per_turn, coefficient, power):
    """Rocking a sin Ωt about x with a force b sin Ωt along y: b J₁(a) along z on the mean, ½ab to first order.

    By the equivalence of coning and sculling the error is that of coning with α² replaced by ab/Ω.
    """
    a, b = 1e-5, 1.0
    t = 2 * np.pi * np.arange(2 * per_turn + 1) / per_turn
    zero = np.zeros(len(t) - 1)
    dtheta = np.stack([np.diff(a * np.sin(t)), zero, zero]).T
    dvel = np.stack([zero, np.diff(-b * np.cos(t)), zero]).T
    shift = int(algorithm.endswith("p"))
    if shift:
        dtheta, dvel = np.concatenate([dtheta[-1:], dtheta]), np.concatenate([dvel[-1:], dvel])
    q, v = np.array([1.0, 0, 0, 0]), np.zeros(3)
    for phi, dv in list(updates(algorithm, dtheta, dvel))[shift:]:
        w = q[1:]
        v = v + dv + 2 * np.cross(w, np.cross(w, dv) + q[0] * dv)
        q = multiply(q, exponential(phi))
    error = v[2] / t[-1] - b * j1(a)
    step = 2 * np.pi / per_turn
    assert abs(error) == pytest.approx(a * b * step**power * coefficient, rel=0.03, abs=0)


@pytest.mark.parametrize("algorithm", ["rotation-vector-2", "rotation-vector-3", "rotation-vector-4"])
def test_constant_rate_and_force_in_the_body_is_exact(algorithm):
    """No coning, no sculling: what is left is the rotation of the velocity increment, compensated exactly."""
    omega, force = np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, -9.0])
    n = REGISTRY[algorithm].samples
    ((phi, dv),) = updates(algorithm, np.tile(omega * 0.1, (n, 1)), np.tile(force * 0.1, (n, 1)))
    np.testing.assert_allclose(phi, 0.1 * n * omega, rtol=1e-15)
    x, w = leggauss(20)
    t = 0.05 * n * (1 + x)
    axis, rate = omega / np.linalg.norm(omega), np.linalg.norm(omega)
    seen = [
        force
        + np.sin(rate * s) * np.cross(axis, force)
        + (1 - np.cos(rate * s)) * np.cross(axis, np.cross(axis, force))
        for s in t
    ]
    np.testing.assert_allclose(dv, 0.05 * n * w @ np.array(seen), rtol=1e-14)


# --- spin-cone and spin-rock --------------------------------------------------------------------------------


def spin_cone(t):
    """Rx(Ωt) Ry(β) Rx(st): attitude and rate in body axes."""
    beta, precession, spin = 0.2, 1.5, 0.7
    c, s, one = np.cos(beta / 2), np.sin(beta / 2), np.ones_like(t)
    plus, minus = (precession + spin) * t / 2, (precession - spin) * t / 2
    q = np.stack([c * np.cos(plus), c * np.sin(plus), s * np.cos(minus), s * np.sin(minus)], axis=-1)
    across = precession * np.sin(beta)
    rate = [(spin + precession * np.cos(beta)) * one, across * np.sin(spin * t), across * np.cos(spin * t)]
    return q, np.stack(rate, axis=-1)


def spin_rock(t):
    """A turn st + A sin Ωt about a fixed axis: attitude and rate."""
    spin, size, omega = 0.4, 0.3, 2.0
    angle, speed = spin * t + size * np.sin(omega * t), spin + size * omega * np.cos(omega * t)
    return np.concatenate([np.cos(angle / 2)[:, None], np.sin(angle / 2)[:, None] * AXIS], axis=1), speed[
        :, None
    ] * AXIS


ARM = np.array([0.4, 0.2, -0.3])


def rock_force(t):
    """What accelerometers on a lever arm feel of it: ω̇ × r + ω × (ω × r)."""
    growth = (-0.3 * 4.0 * np.sin(2.0 * t))[:, None] * AXIS
    rate = spin_rock(t)[1]
    return np.cross(growth, ARM) + np.cross(rate, np.cross(rate, ARM))


def integrals(function, edges):
    x, w = leggauss(12)
    h = np.diff(edges)
    t = edges[:-1, None] + 0.5 * h[:, None] * (1 + x)
    return 0.5 * h[:, None] * np.einsum("j,njk->nk", w, function(t.ravel()).reshape(len(h), 12, -1))


SAMPLE_ORDERS = {"1": 2.0, "1p": 3.0, "2": 4.0, "3": 4.0, "4": 4.0}


def orders_of(algorithm, miss):
    """Order between 48 and 96 intervals in three seconds; the one with the sample before begins with it."""
    found = []
    for count in (48, 96):
        edges = np.linspace(0.0, 3.0, count + 1)
        shift = int(algorithm.endswith("p"))
        if shift:
            edges = np.concatenate([[-edges[1]], edges])
        found.append(miss(edges, shift))
    return np.log2(found[0] / found[1])


@pytest.mark.parametrize("name", SAMPLE_ORDERS)
def test_order_on_spin_cone(name):
    """The attitude that is known in closed form."""

    def miss(edges, shift):
        dtheta = integrals(lambda t: spin_cone(t)[1], edges)
        q = spin_cone(np.zeros(1))[0][0]
        for phi, _ in list(updates(f"rotation-vector-{name}", dtheta, 0 * dtheta))[shift:]:
            q = multiply(q, exponential(phi))
        true = spin_cone(np.array([3.0]))[0][0]
        return 2 * np.linalg.norm(multiply(true * [1, -1, -1, -1], q)[1:])

    assert orders_of(f"rotation-vector-{name}", miss) == pytest.approx(SAMPLE_ORDERS[name], abs=0.1)


@pytest.mark.parametrize("name", SAMPLE_ORDERS)
def test_order_on_spin_rock(name):
    """The velocity of the lever arm's end, C(ω × r), known in closed form; about a fixed axis there is no coning."""

    def velocity(t):
        q, rate = (array[0] for array in spin_rock(np.array([t])))
        v = np.cross(rate, ARM)
        return v + 2 * np.cross(q[1:], np.cross(q[1:], v) + q[0] * v)

    def miss(edges, shift):
        dtheta, dvel = integrals(lambda t: spin_rock(t)[1], edges), integrals(rock_force, edges)
        q, v = np.array([1.0, 0, 0, 0]), velocity(0.0)
        for phi, dv in list(updates(f"rotation-vector-{name}", dtheta, dvel))[shift:]:
            w = q[1:]
            v = v + dv + 2 * np.cross(w, np.cross(w, dv) + q[0] * dv)
            q = multiply(q, exponential(phi))
        assert 2 * np.linalg.norm(multiply(spin_rock(np.array([3.0]))[0][0] * [1, -1, -1, -1], q)[1:]) < 1e-14
        return np.linalg.norm(v - velocity(3.0))

    # of one sample with the one before, a part of the fourth order is still as large as that of the third
    loose = 0.7 if name == "1p" else 0.1
    assert orders_of(f"rotation-vector-{name}", miss) == pytest.approx(SAMPLE_ORDERS[name], abs=loose)


# --- functional iteration -----------------------------------------------------------------------------------


def tumbling(t):
    """Attitude of three turns in a row, by sines of t, and its rate in body axes."""
    angles = np.stack([0.5 * np.sin(1.3 * t), 0.4 * np.cos(0.9 * t + 0.3), 0.7 * np.sin(0.6 * t + 1.0)])
    speeds = np.stack([0.65 * np.cos(1.3 * t), -0.36 * np.sin(0.9 * t + 0.3), 0.42 * np.cos(0.6 * t + 1.0)])
    (a, b, _), (da, db, dc) = angles, speeds
    rate = np.stack(
        [
            da - dc * np.sin(b),
            db * np.cos(a) + dc * np.cos(b) * np.sin(a),
            dc * np.cos(b) * np.cos(a) - db * np.sin(a),
        ],
        axis=-1,
    )
    return np.array(
        [
            multiply(
                multiply(
                    np.array([np.cos(z / 2), 0, 0, np.sin(z / 2)]), np.array([np.cos(y / 2), 0, np.sin(y / 2), 0])
                ),
                np.array([np.cos(x / 2), np.sin(x / 2), 0, 0]),
            )
            for x, y, z in np.reshape(angles, (3, -1)).T
        ]
    ), rate


def cone(t):
    alpha, speed = np.deg2rad(1.0), 2 * np.pi
    one = np.ones_like(t)
    q = np.stack(
        [np.cos(alpha / 2) * one, np.sin(alpha / 2) * np.cos(speed * t), np.sin(alpha / 2) * np.sin(speed * t)]
    )
    rate = [-np.sin(alpha) * np.sin(speed * t), np.sin(alpha) * np.cos(speed * t), (np.cos(alpha) - 1) * one]
    return np.concatenate([q, 0 * one[None]]).T, speed * np.stack(rate, axis=-1)


@pytest.mark.parametrize("motion", [tumbling, cone, spin_cone, spin_rock])
@pytest.mark.parametrize("uniform", [True, False])
def test_functional_iteration_of_the_attitude(motion, uniform):
    """At most 1e-13 rad a window, at 100 Hz, on equal and on unequal intervals."""
    count, nodes = 8 * 30 + 3, windows.NODES
    width = np.full(count, 0.01) if uniform else 0.008 + 0.004 * np.random.default_rng(3).random(count)
    time = np.concatenate([[0.0], np.cumsum(width)])
    x, w = leggauss(12)
    t = time[:-1, None] + 0.5 * width[:, None] * (1 + x)
    dtheta = 0.5 * width[:, None] * np.einsum("j,njk->nk", w, motion(t.ravel())[1].reshape(count, 12, 3))
    q_true = motion(time)[0]
    rate, work, q, force = (np.empty((rows, nodes)) for rows in (6, 4, 4, 3))
    worst, seen = 0.0, 0
    for block in windows.windows(time, uniform):
        for first, size, fit, table in zip(block.first, block.size, block.fit, block.table, strict=True):
            windows.body_k(dtheta, 0 * dtheta, fit, block.rate[table], block.integral, rate, work, q, force)
            for i in range(size):
                end = q @ block.edge[table, i]
                truth = multiply(q_true[first] * [1, -1, -1, -1], q_true[first + i + 1])
                worst = max(worst, 2 * np.linalg.norm(multiply(truth * [1, -1, -1, -1], end)[1:]))
                seen += 1
    assert seen == count
    assert worst < 1e-13


def test_functional_iteration_converges_for_fast_turns():
    """Half a turn within one window."""
    time = np.arange(9) / 100
    dtheta = np.tile(np.pi / 8 * AXIS, (8, 1))
    (block,) = windows.windows(time, True)
    rate, work, q, force = (np.empty((rows, windows.NODES)) for rows in (6, 4, 4, 3))
    dvel = np.tile([1.0, 0.0, 0.0], (8, 1))
    windows.body_k(dtheta, dvel, 0, block.rate[0], block.integral, rate, work, q, force)
    np.testing.assert_allclose(q[:, -1], [0.0, *AXIS], rtol=0, atol=1e-9)  # twelve points resolve (π/2)¹²/12! of a sine
    np.testing.assert_allclose(force[:, -1], 8 * (2 * AXIS[0] * AXIS - [1, 0, 0]), rtol=0, atol=1e-8)


# --- whole navigation ---------------------------------------------------------------------------------------


def rows_of(flight, time):
    """The truth at some of its times."""
    at = np.searchsorted(flight.time, time - 1e-9)
    fields = (flight.latitude, flight.longitude, flight.height, flight.velocity_ned, flight.q_nb)
    return Flight(flight.time[at], flight.dtheta, flight.dvel, *(field[at] for field in fields))


def run(flight, **options):
    first = NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])
    imu = ImuData(flight.time, flight.dtheta, flight.dvel)
    options = {"gravity": "somigliana", "vertical": "truth", "height": flight.height, **options}
    if options["vertical"] == "free":
        del options["height"]
    return navigate(imu, first, **options)


def attitude_error(flight, **options):
    solution = run(flight, **options)
    return np.max(rows_of(flight, solution.time).attitude_error(solution.q_nb))


@pytest.fixture(scope="module")
def fast_turns():
    """A fast S-turn (3 s) at 24, 48 and 96 Hz, whole updates of 1, 2, 3 and 4 samples."""
    return [STurn(duration=30, period=3.0).fly(rate) for rate in (24, 48, 96)]


ORDERS = {
    **{name: 2.0 for name in ALGORITHMS if name.startswith(("quaternion-", "poisson-"))},  # coning left out
    "two-quaternions": 2.0,
    "rotation-vector-1": 2.0,
    "rotation-vector-1p": 3.0,
    "rotation-vector-2": 4.0,
    "rotation-vector-3": 4.0,
    "rotation-vector-4": 4.0,
    "euler": 4.0,
    "poisson": 4.0,
    "quaternion": 6.0,
    "functional-iteration": 8.0,
}


@cache
def tumbled(rate):
    """Increments of a second, and the true attitudes."""
    time = np.arange(rate + 1) / rate
    x, w = leggauss(12)
    t = time[:-1, None] + (1 + x) / (2 * rate)
    dtheta = np.einsum("j,njk->nk", w, tumbling(t.ravel())[1].reshape(rate, 12, 3)) / (2 * rate)
    return dtheta, tumbling(time)[0]


@pytest.mark.parametrize("algorithm", VARIANTS)
def test_order_of_a_step(algorithm):
    """Order in the rate of sampling of the turn alone, uncompiled, on a motion with coning: the shared increments'."""
    found = []
    for rate in (40, 80, 160):
        dtheta, truth = tumbled(rate)
        attitude = part(algorithm, "start_k")(*truth[0])
        for increment in dtheta:
            attitude = part(algorithm, "step_k")(attitude, body_turn(increment), NO_TURN)
        q = np.array(part(algorithm, "quaternion_k")(attitude)[:4])
        found.append(2 * np.linalg.norm(multiply(truth[-1] * [1, -1, -1, -1], q)[1:]))
    assert np.log2(found[1] / found[2]) == pytest.approx(2.0, abs=0.02), found


@pytest.mark.parametrize("algorithm", with_slow_variants(ALGORITHMS))
def test_order_of_convergence(algorithm, fast_turns):
    found = [attitude_error(flight, algorithm=algorithm) for flight in fast_turns]
    orders = np.log2(np.array(found[:-1]) / np.array(found[1:]))
    assert orders[0] > ORDERS[algorithm] - 0.2, (found, orders)
    if ORDERS[algorithm] == 2.0:
        assert orders[-1] == pytest.approx(2.0, abs=0.02)


FRAMES = ("wander", "free-azimuth", "transverse", "inertial")
REPRESENTATIVES = ("poisson-2-ortho", "two-quaternions", "rotation-vector-3", "functional-iteration")


def check_frame(flight, algorithm, frame):
    """An algorithm is as far from the truth in one frame as in another, to the part that the frame's turn has in it."""
    level = attitude_error(flight, algorithm=algorithm)
    other = attitude_error(flight, algorithm=algorithm, frame=frame)
    assert other == pytest.approx(level, rel=0.02, abs=1e-12)


@pytest.mark.parametrize("algorithm", REPRESENTATIVES)
@pytest.mark.parametrize("frame", ["wander", *slow("inertial")])
def test_frames_alike(algorithm, frame, fast_turns):
    check_frame(fast_turns[1], algorithm, frame)


@pytest.mark.slow
@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_every_algorithm_in_every_frame(algorithm, frame, fast_turns):
    check_frame(fast_turns[1], algorithm, frame)


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["functional-iteration", "quaternion"])
def test_an_hour_of_the_best(algorithm):
    """Asked of the best algorithm: 0.01 m."""
    flight = STurn(duration=3600).fly(100)
    solution = run(flight, algorithm=algorithm, vertical="free")
    assert np.max(flight.horizontal_error(solution.latitude, solution.longitude)) < 1e-4


@pytest.mark.parametrize("algorithm", ["rotation-vector-4", "functional-iteration"])
@pytest.mark.parametrize("vertical", ["free", "baro-loop", "truth"])
@pytest.mark.parametrize("frame", ["level", "inertial"])
def test_vertical_channels_of_algorithms_with_windows(algorithm, vertical, frame):
    """A wrong initial height grows freely, is taken out by the loop, and never shows when held."""
    flight = STurn(duration=40, period=10.0).fly(40)
    first = NavState(
        flight.latitude[0],
        flight.longitude[0],
        np.float64(flight.height[0] + 10.0),
        flight.velocity_ned[0],
        flight.q_nb[0],
    )
    imu = ImuData(flight.time, flight.dtheta, flight.dvel)
    options = {"gravity": "somigliana", "algorithm": algorithm}
    if vertical != "free":
        options["height"] = flight.height
    if vertical == "baro-loop":
        options["baro_time_constant"] = 4.0
    error = navigate(imu, first, vertical=vertical, frame=frame, **options).height - 5000.0
    t = 40.0
    expected = {
        "free": 10 * np.cosh(np.sqrt(2 * 9.8 / 6.38e6) * t),  # 10.02
        "baro-loop": 10 * (1 - 2 * t / 4 + (t / 4) ** 2 / 2) * np.exp(-t / 4),  # the loop's triple pole: 0.014
        "truth": 0.0,
    }[vertical]
    assert error[-1] == pytest.approx(expected, abs=2e-3)


def test_rows_at_the_ends_of_updates():
    flight = STurn(duration=1).fly(50)
    for algorithm in ("rotation-vector-1", "rotation-vector-2", "rotation-vector-3", "rotation-vector-4"):
        n = REGISTRY[algorithm].samples
        solution = run(flight, algorithm=algorithm)
        # 50 samples: two are left over after whole updates of three or four
        np.testing.assert_array_equal(solution.time, flight.time[: 50 // n * n + 1 : n])
        assert rows_of(flight, solution.time).attitude_error(solution.q_nb)[-1] < 1e-5


def test_data_shorter_than_an_update():
    flight = STurn(duration=0.06).fly(50)
    assert len(run(flight, algorithm="rotation-vector-3").time) == 2
    with pytest.raises(InputError, match=r"3 samples.*rotation-vector-4"):
        run(flight, algorithm="rotation-vector-4")
    with pytest.raises(InputError, match=r"8 samples.*3"):
        run(flight, algorithm="functional-iteration")


@pytest.mark.parametrize("algorithm", ["rotation-vector-1p", "rotation-vector-2"])
def test_coefficients_hold_for_equal_intervals_only(algorithm):
    flight = STurn(duration=1).fly(50)
    uneven = flight.time.copy()
    uneven[20] += 0.001
    with pytest.raises(InputError, match=f"{algorithm} needs equal sampling intervals"):
        run(
            Flight(
                uneven,
                *(getattr(flight, n) for n in ("dtheta", "dvel", "latitude", "longitude", "height")),
                flight.velocity_ned,
                flight.q_nb,
            ),
            algorithm=algorithm,
        )


def test_the_defect_of_a_quaternion_is_its_distance_from_length_one():
    """(1.2, 0, 1.6, 0) has the length 2."""
    assert unit_k(1.2, 0.0, 1.6, 0.0) == pytest.approx((0.6, 0.0, 0.8, 0.0, 1.0), abs=1e-15)
    assert unit_k(0.3, 0.0, 0.0, -0.4)[4] == pytest.approx(0.5, abs=1e-15)


def test_rest_does_not_drift_by_rounding():
    """Turns of body and frame that cancel change nothing: 2e4 steps at 4 kHz, whose rounding added up to 1e-12 rad."""
    start = np.array([0.9, 0.1, -0.3, 0.3])
    q = start / np.linalg.norm(start)
    earth = np.array([4e-5, 0.0, -6e-5]) / 4000.0
    p, vector = q * [1.0, -1.0, -1.0, -1.0], np.array([0.0, *earth])
    body = multiply(multiply(p, vector), q)[1:]
    step, attitude = part("quaternion", "step_k"), tuple(q.tolist())
    for _ in range(20_000):
        attitude = step(attitude, body_turn(body), FrameTurn(*earth, *[0.0] * 9))
    assert 2.0 * np.abs(multiply(p, np.array(attitude))[1:]).max() < 1e-15
