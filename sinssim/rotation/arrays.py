"""Rotations over arrays of any leading shape: quaternion, direction cosine matrix, Euler angles, rotation vector."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.jit import kernel
from sinssim.rotation.kernels import (
    dcm_from_quaternion_k,
    euler_from_quaternion_k,
    multiply_k,
    quaternion_from_dcm_k,
    quaternion_from_euler_k,
    quaternion_from_rotation_vector_k,
    rotate_k,
    rotation_vector_from_quaternion_k,
)


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
