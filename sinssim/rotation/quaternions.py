"""Rotations as quaternion, direction cosine matrix, Euler angles and rotation vector: scalar kernels, and arrays.

Quaternions are Hamilton's, scalar first; `q_ab` and `C_ab` convert b-coordinates to a-coordinates. Euler angles are
roll φ, pitch θ, heading ψ in ZYX order. Kernels end in `_k` and take tuples; the other functions take arrays of any
leading shape.
"""

from __future__ import annotations

from collections.abc import Callable
from math import asin, atan2, cos, floor, pi, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.errors import InputError, check_name
from sinssim.jit import inline, kernel, strict_inline

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]  # row by row

SERIES = 0.06
"""Squared angle [rad²] below which trigonometric ratios are summed as series, with a truncation error below 1e-17."""


@inline
def cross_k(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> Vector:
    """Vector product a × b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@inline
def less_cross_k(
    x: float, y: float, z: float, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> Vector:
    """v − a × b."""
    return x - ay * bz + az * by, y - az * bx + ax * bz, z - ax * by + ay * bx


@inline
def multiply_k(a0: float, a1: float, a2: float, a3: float, b0: float, b1: float, b2: float, b3: float) -> Quaternion:
    """Hamilton product a ∘ b."""
    return (
        a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3,
        a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
        a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1,
        a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
    )


@strict_inline
def half_angle_k(c: float, s: float) -> tuple[float, float]:
    """Cosine and sine of half an angle in [−π, π] from those of the angle, to rounding."""
    if c > 0.0:
        h = sqrt(0.5 + 0.5 * c)
        return h, 0.5 * s / h
    h = sqrt(0.5 - 0.5 * c)
    if s < 0.0:
        h = -h
    return 0.5 * s / h, h


@strict_inline
def sincos_k(x: float) -> tuple[float, float]:
    """sin(x) and cos(x) to rounding, without a call to the mathematical library.

    Reduction to |r| ≤ π/4 by π/2 in two parts (Cody and Waite 1980) and the polynomials of Sun's fdlibm
    (k_sin.c, k_cos.c). Beyond 1000 rad the library's functions are used.
    """
    if abs(x) > 1000.0:
        return sin(x), cos(x)
    turns = floor(x * 0.6366197723675814 + 0.5)  # 2/π
    # π/2: its first 33 bits, whose product with a count below 2²⁰ is exact, and the rest
    r = (x - turns * 1.5707963267341256) - turns * 6.077100506506192e-11
    y = r * r
    s = r + r * y * (
        -1.66666666666666324348e-01
        + y
        * (
            8.33333333332248946124e-03
            + y
            * (
                -1.98412698298579493134e-04
                + y * (2.75573137070700676789e-06 + y * (-2.50507602534068634195e-08 + y * 1.58969099521155010221e-10))
            )
        )
    )
    c = (
        1.0
        - 0.5 * y
        + y
        * y
        * (
            4.16666666666666019037e-02
            + y
            * (
                -1.38888888888741095749e-03
                + y
                * (
                    2.48015872894767294178e-05
                    + y
                    * (-2.75573143513906633035e-07 + y * (2.08757232129817482790e-09 - y * 1.13596475577881948265e-11))
                )
            )
        )
    )
    quadrant = int(turns) & 3
    if quadrant & 1:
        s, c = c, s
    if quadrant & 2:
        s = -s
    if quadrant == 1 or quadrant == 2:
        c = -c
    return s, c


@inline
def small_half_angle_series_k(x2: float) -> tuple[float, float]:
    """cos(x/2) and sin(x/2)/x from x²; exact to rounding below `SERIES`."""
    y = 0.25 * x2
    y2 = y * y
    c = (1.0 - y / 2) + y2 * ((1 / 24 - y / 720) + y2 * (1 / 40320 - y / 3628800))
    s = (1 / 2 - y / 12) + y2 * ((1 / 240 - y / 10080) + y2 * (1 / 725760 - y / 79833600))
    return c, s


@inline
def small_half_angle_change_k(x2: float) -> tuple[float, float]:
    """cos(x/2) − 1 and sin(x/2)/x from x²; exact to rounding below `SERIES`."""
    y = 0.25 * x2
    y2 = y * y
    c = y2 * ((1 / 24 - y / 720) + y2 * (1 / 40320 - y / 3628800)) - y / 2
    s = (1 / 2 - y / 12) + y2 * ((1 / 240 - y / 10080) + y2 * (1 / 725760 - y / 79833600))
    return c, s


@inline
def half_angle_series_k(x2: float) -> tuple[float, float]:
    """cos(x/2) and sin(x/2)/x from x²; exact to rounding for every x."""
    if x2 < SERIES:
        return small_half_angle_series_k(x2)
    x = sqrt(x2)
    return cos(0.5 * x), sin(0.5 * x) / x


@inline
def half_angle_change_k(x2: float) -> tuple[float, float]:
    """cos(x/2) − 1 and sin(x/2)/x from x²; exact to rounding for every x."""
    if x2 < SERIES:
        return small_half_angle_change_k(x2)
    x = sqrt(x2)
    return -2.0 * sin(0.25 * x) ** 2, sin(0.5 * x) / x


@inline
def small_rotation_series_k(x2: float) -> tuple[float, float, float]:
    """sin(x)/x, (1 − cos x)/x² and (x − sin x)/x³ from x²; exact to rounding below `SERIES`."""
    a = 1.0 - x2 * (
        1 / 6 - x2 * (1 / 120 - x2 * (1 / 5040 - x2 * (1 / 362880 - x2 * (1 / 39916800 - x2 / 6227020800))))
    )
    b = 1 / 2 - x2 * (1 / 24 - x2 * (1 / 720 - x2 * (1 / 40320 - x2 * (1 / 3628800 - x2 * (1 / 479001600)))))
    c = 1 / 6 - x2 * (1 / 120 - x2 * (1 / 5040 - x2 * (1 / 362880 - x2 * (1 / 39916800 - x2 * (1 / 6227020800)))))
    return a, b, c


@inline
def rotation_series_k(x2: float) -> tuple[float, float, float]:
    """sin(x)/x, (1 − cos x)/x² and (x − sin x)/x³ from x²; exact to rounding for every x."""
    if x2 < SERIES:
        return small_rotation_series_k(x2)
    x = sqrt(x2)
    half_sine = sin(0.5 * x)
    a = sin(x) / x
    return a, 2.0 * half_sine * half_sine / x2, (1.0 - a) / x2


@inline
def quaternion_from_rotation_vector_k(x: float, y: float, z: float) -> Quaternion:
    """Quaternion of a rotation by |φ| about φ."""
    c, s = half_angle_series_k(x * x + y * y + z * z)
    return c, s * x, s * y, s * z


@inline
def rotation_vector_from_quaternion_k(q0: float, q1: float, q2: float, q3: float) -> Vector:
    """Rotation vector of a unit quaternion, with length in [0, π]."""
    if q0 < 0.0:
        q0, q1, q2, q3 = -q0, -q1, -q2, -q3
    s2 = q1 * q1 + q2 * q2 + q3 * q3
    if s2 < 1e-16:
        factor = 2.0
    else:
        s = sqrt(s2)
        factor = 2.0 * atan2(s, q0) / s
    return factor * q1, factor * q2, factor * q3


@inline
def dcm_from_quaternion_k(q0: float, q1: float, q2: float, q3: float) -> Matrix:
    """Direction cosine matrix of a unit quaternion."""
    return (
        q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3,
        2.0 * (q1 * q2 - q0 * q3),
        2.0 * (q1 * q3 + q0 * q2),
        2.0 * (q1 * q2 + q0 * q3),
        q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3,
        2.0 * (q2 * q3 - q0 * q1),
        2.0 * (q1 * q3 - q0 * q2),
        2.0 * (q2 * q3 + q0 * q1),
        q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3,
    )


@inline
def quaternion_from_dcm_k(
    c11: float, c12: float, c13: float, c21: float, c22: float, c23: float, c31: float, c32: float, c33: float
) -> Quaternion:
    """Unit quaternion, scalar part not negative, of a direction cosine matrix (Shepperd 1978: largest divisor)."""
    trace = c11 + c22 + c33
    if trace >= c11 and trace >= c22 and trace >= c33:
        q0, q1, q2, q3 = 1.0 + trace, c32 - c23, c13 - c31, c21 - c12
    elif c11 >= c22 and c11 >= c33:
        q0, q1, q2, q3 = c32 - c23, 1.0 + 2.0 * c11 - trace, c12 + c21, c13 + c31
    elif c22 >= c33:
        q0, q1, q2, q3 = c13 - c31, c12 + c21, 1.0 + 2.0 * c22 - trace, c23 + c32
    else:
        q0, q1, q2, q3 = c21 - c12, c13 + c31, c23 + c32, 1.0 + 2.0 * c33 - trace
    scale = 1.0 / sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    if q0 < 0.0:
        scale = -scale
    return scale * q0, scale * q1, scale * q2, scale * q3


@inline
def quaternion_from_euler_k(roll: float, pitch: float, heading: float) -> Quaternion:
    """Quaternion q_nb of roll, pitch and heading."""
    cr, sr = cos(0.5 * roll), sin(0.5 * roll)
    cp, sp = cos(0.5 * pitch), sin(0.5 * pitch)
    ch, sh = cos(0.5 * heading), sin(0.5 * heading)
    return (
        cr * cp * ch + sr * sp * sh,
        sr * cp * ch - cr * sp * sh,
        cr * sp * ch + sr * cp * sh,
        cr * cp * sh - sr * sp * ch,
    )


@inline
def euler_from_quaternion_k(q0: float, q1: float, q2: float, q3: float) -> Vector:
    """Roll in (−π, π], pitch in [−π/2, π/2], heading in [0, 2π) of a unit quaternion q_nb.

    The method uses half the sum and half the difference of heading and roll (Bernardes and Viollet 2022): near a pitch
    of ±90° one of them loses its precision, but the other, and with it the attitude, keeps it. At exactly ±90° only
    heading ∓ roll is determined; the roll returned there is 0.
    """
    # √2 cos(π/4 + θ/2) at angle (ψ + φ)/2, and √2 sin(π/4 + θ/2) at angle (ψ − φ)/2
    sum_cos, sum_sin = q0 - q2, q1 + q3
    dif_cos, dif_sin = q0 + q2, q3 - q1
    sum_size = sqrt(sum_cos * sum_cos + sum_sin * sum_sin)
    dif_size = sqrt(dif_cos * dif_cos + dif_sin * dif_sin)
    sin_pitch = 2.0 * (q0 * q2 - q1 * q3)
    if abs(sin_pitch) < 0.7:
        pitch = asin(sin_pitch)
    elif sin_pitch > 0.0:  # asin is imprecise near ±90°
        pitch = 0.5 * pi - 2.0 * atan2(sum_size, dif_size)
    else:
        pitch = 2.0 * atan2(dif_size, sum_size) - 0.5 * pi
    half_sum = atan2(sum_sin, sum_cos)
    half_dif = atan2(dif_sin, dif_cos)
    if sum_size < 1e-15:
        half_sum = half_dif
    elif dif_size < 1e-15:
        half_dif = half_sum
    roll = half_sum - half_dif
    heading = half_sum + half_dif
    if roll > pi:
        roll -= 2.0 * pi
    elif roll <= -pi:
        roll += 2.0 * pi
    if heading < 0.0:
        heading += 2.0 * pi
    if heading >= 2.0 * pi:  # also a tiny negative angle, whose sum with 2π rounds to 2π
        heading -= 2.0 * pi
    return roll, pitch, heading


@inline
def rotate_k(q0: float, q1: float, q2: float, q3: float, x: float, y: float, z: float) -> Vector:
    """v_a = C_ab v_b for a unit quaternion q_ab."""
    tx, ty, tz = cross_k(q1, q2, q3, x, y, z)
    tx, ty, tz = tx + q0 * x, ty + q0 * y, tz + q0 * z
    ux, uy, uz = cross_k(q1, q2, q3, tx, ty, tz)
    return x + 2.0 * ux, y + 2.0 * uy, z + 2.0 * uz


def _rows(*arrays: tuple[ArrayLike, int]) -> tuple[tuple[int, ...], list[Array]]:
    """Broadcast the leading shapes of arrays with k columns and lay each out as (n, k) contiguous rows."""
    values = [(numbers("the array", array), columns) for array, columns in arrays]
    for value, columns in values:
        if value.shape[-1:] != (columns,):
            raise InputError(f"expected an array with {columns} values in its last axis, got shape {value.shape}.")
    shape = _common_shape(*(value.shape[:-1] for value, _ in values))
    return shape, [
        # a broadcast view is read-only, and a kernel would be compiled again for it
        (value if value.shape[:-1] == shape else np.broadcast_to(value, (*shape, columns)).copy()).reshape(-1, columns)
        for value, columns in values
    ]


def _common_shape(*shapes: tuple[int, ...]) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError as error:
        raise InputError(f"arrays of the leading shapes {', '.join(map(str, shapes))} do not fit together.") from error


@kernel
def _multiply_rows(a: Array, b: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = multiply_k(a[i, 0], a[i, 1], a[i, 2], a[i, 3], b[i, 0], b[i, 1], b[i, 2], b[i, 3])


@kernel
def _rotate_rows(q: Array, v: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = rotate_k(q[i, 0], q[i, 1], q[i, 2], q[i, 3], v[i, 0], v[i, 1], v[i, 2])


@kernel
def _from_rotation_vector_rows(v: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = quaternion_from_rotation_vector_k(v[i, 0], v[i, 1], v[i, 2])


@kernel
def _to_rotation_vector_rows(q: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = rotation_vector_from_quaternion_k(q[i, 0], q[i, 1], q[i, 2], q[i, 3])


@kernel
def _to_dcm_rows(q: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = dcm_from_quaternion_k(q[i, 0], q[i, 1], q[i, 2], q[i, 3])


@kernel
def _from_dcm_rows(c: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = quaternion_from_dcm_k(c[i, 0], c[i, 1], c[i, 2], c[i, 3], c[i, 4], c[i, 5], c[i, 6], c[i, 7], c[i, 8])


@kernel
def _from_euler_rows(angles: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = quaternion_from_euler_k(angles[i, 0], angles[i, 1], angles[i, 2])


@kernel
def _to_euler_rows(q: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = euler_from_quaternion_k(q[i, 0], q[i, 1], q[i, 2], q[i, 3])


def _map(rows: Callable[..., None], columns: int, *arrays: tuple[ArrayLike, int]) -> Array:
    shape, values = _rows(*arrays)
    out = np.empty((len(values[0]), columns))
    rows(*values, out)
    return np.reshape(out, (*shape, columns))


def multiply(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the Hamilton product q_ac = q_ab ∘ q_bc.

    Args:
        a: quaternions, (..., 4).
        b: quaternions, (..., 4); the leading shapes broadcast.

    Returns:
        Products, (..., 4).
    """
    return _map(_multiply_rows, 4, (a, 4), (b, 4))


def conjugate(q: ArrayLike) -> Array:
    """Return the conjugate, for a unit quaternion its inverse: q_ba from q_ab.

    Args:
        q: quaternions, (..., 4).

    Returns:
        Conjugates, (..., 4).
    """
    conjugated: Array = numbers("the quaternion", q) * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugated


def normalize(q: ArrayLike) -> Array:
    """Return quaternions scaled to unit norm.

    Args:
        q: quaternions, (..., 4), none of them zero.

    Returns:
        Unit quaternions, (..., 4).
    """
    q = numbers("the quaternion", q)
    if q.shape[-1:] != (4,):
        raise InputError(f"a quaternion needs 4 values in its last axis, not the shape {q.shape}.")
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True))


def rotate(q_ab: ArrayLike, v_b: ArrayLike) -> Array:
    """Return v_a = C_ab v_b.

    Args:
        q_ab: unit quaternions, (..., 4).
        v_b: vectors, (..., 3); the leading shapes broadcast.

    Returns:
        Rotated vectors, (..., 3).
    """
    return _map(_rotate_rows, 3, (q_ab, 4), (v_b, 3))


def quaternion_from_rotation_vector(phi: ArrayLike) -> Array:
    """Return the unit quaternion of a rotation by |φ| about φ.

    Args:
        phi: rotation vectors, (..., 3) rad.

    Returns:
        Unit quaternions, (..., 4).
    """
    return _map(_from_rotation_vector_rows, 4, (phi, 3))


def rotation_vector_from_quaternion(q: ArrayLike) -> Array:
    """Return the rotation vector, of length at most π, of a unit quaternion.

    Args:
        q: unit quaternions, (..., 4).

    Returns:
        Rotation vectors, (..., 3) rad.
    """
    return _map(_to_rotation_vector_rows, 3, (q, 4))


def dcm_from_quaternion(q_ab: ArrayLike) -> Array:
    """Return the direction cosine matrix C_ab.

    Args:
        q_ab: unit quaternions, (..., 4).

    Returns:
        Matrices, (..., 3, 3).
    """
    flat = _map(_to_dcm_rows, 9, (q_ab, 4))
    return flat.reshape(*flat.shape[:-1], 3, 3)


def quaternion_from_dcm(c_ab: ArrayLike) -> Array:
    """Return the unit quaternion, scalar part not negative, of a direction cosine matrix (Shepperd 1978).

    Args:
        c_ab: matrices, (..., 3, 3).

    Returns:
        Unit quaternions, (..., 4).
    """
    c = numbers("the matrix", c_ab)
    if c.shape[-2:] != (3, 3):
        raise InputError(f"a direction cosine matrix needs the shape (3, 3) in its last axes, not {c.shape}.")
    return _map(_from_dcm_rows, 4, (c.reshape(*c.shape[:-2], 9), 9))


def quaternion_from_euler(roll: ArrayLike, pitch: ArrayLike, heading: ArrayLike) -> Array:
    """Return q_nb of Euler angles in ZYX order.

    Args:
        roll, pitch, heading: angles that broadcast, (...) rad.

    Returns:
        Unit quaternions, (..., 4).
    """
    given = [numbers(n, a) for n, a in (("roll", roll), ("pitch", pitch), ("heading", heading))]
    _common_shape(*(array.shape for array in given))
    angles = np.stack(np.broadcast_arrays(*given), axis=-1)
    return _map(_from_euler_rows, 4, (angles, 3))


def euler_from_quaternion(q_nb: ArrayLike) -> tuple[Array, Array, Array]:
    """Return roll in (−π, π], pitch in [−π/2, π/2] and heading in [0, 2π).

    These are the angles (8.17) of chapter 8, in the axes of this package. At pitch ±90° only heading ∓ roll is
    determined; the roll returned there is 0.

    Args:
        q_nb: unit quaternions, (..., 4).

    Returns:
        Roll, pitch, heading, each (...) rad.
    """
    angles = _map(_to_euler_rows, 3, (q_nb, 4))
    return angles[..., 0], angles[..., 1], angles[..., 2]


HEADING_RANGES: dict[str, float] = {"0..360": 0.0, "-180..180": -np.pi, "-90..270": -0.5 * np.pi}
"""Least heading of each range, rad."""


def heading_in(range_: str, heading: ArrayLike) -> Array:
    """Return headings in a range of 360°.

    Args:
        range_: one of `HEADING_RANGES`; the last is that of the formulas for a parked vehicle.
        heading: (...) rad.

    Returns:
        (...) rad, in [least, least + 2π).

    Raises:
        InputError: the range is unknown, or a heading is not a number.
    """
    check_name("range of the heading", range_, HEADING_RANGES)
    least = HEADING_RANGES[range_]
    turned = np.mod(numbers("the heading", heading) - least, 2.0 * np.pi)
    turned = np.where(turned >= 2.0 * np.pi, 0.0, turned)  # a tiny negative angle plus 2π rounds to 2π
    return np.asarray(turned + least)


def shown_heading(choice: str | None, heading: ArrayLike) -> Array:
    """Return consecutive headings in the range that a scenario requests.

    Args:
        choice: one of `HEADING_RANGES`, "continuous" for headings that count full turns, None for 0…360°.
        heading: (N,) rad; for "continuous", consecutive ones differ by less than 180°.

    Returns:
        (N,) rad.
    """
    if choice == "continuous":
        return np.asarray(np.unwrap(numbers("the heading", heading)))
    return heading_in(choice or "0..360", heading)


def continuous_angles(q_nb: ArrayLike) -> tuple[Array, Array, Array]:
    """Return Euler angles that count full turns of roll and heading.

    Consecutive attitudes must differ by less than 180°. Pitch stays within ±90°. A passage through pitch ±90° changes
    roll and heading by 180° at once, because these are the same attitudes; angles integrated through it, as those of
    the Euler equations, would take pitch beyond 90° instead.

    Args:
        q_nb: consecutive attitudes, (N, 4).

    Returns:
        Roll, pitch, heading, (N,) rad each; the first roll lies in (−π, π], the first heading in [0, 2π).

    Raises:
        InputError: the attitudes are not quaternions.
    """
    roll, pitch, heading = euler_from_quaternion(q_nb)
    return np.unwrap(roll), pitch, np.unwrap(heading)
