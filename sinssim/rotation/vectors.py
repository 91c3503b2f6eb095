"""Three-vectors in kernels: tuples of three numbers, which compile to the same machine code as numbers one by one."""

from __future__ import annotations

from sinssim.data import Array
from sinssim.jit import inline
from sinssim.rotation.quaternions import Matrix, Vector


@inline
def add(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inline
def sub(a: Vector, b: Vector) -> Vector:
    """a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inline
def mul(s: float, a: Vector) -> Vector:
    """s a."""
    return s * a[0], s * a[1], s * a[2]


@inline
def along(a: Vector, s: float, b: Vector) -> Vector:
    """a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@inline
def cross(a: Vector, b: Vector) -> Vector:
    """a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inline
def sub_cross(v: Vector, a: Vector, b: Vector) -> Vector:
    """v − a × b, the vector first: both products are fused with it."""
    return (
        v[0] - a[1] * b[2] + a[2] * b[1],
        v[1] - a[2] * b[0] + a[0] * b[2],
        v[2] - a[0] * b[1] + a[1] * b[0],
    )


@inline
def mean(a: Vector, b: Vector) -> Vector:
    """½ (a + b)."""
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])


@inline
def simpson(a: Vector, m: Vector, b: Vector) -> Vector:
    """Mean of an interval from the values at its start, middle and end (Simpson's rule)."""
    sixth, most = 1.0 / 6.0, 2.0 / 3.0  # the value in the middle is known last
    return (
        sixth * (a[0] + b[0]) + most * m[0], sixth * (a[1] + b[1]) + most * m[1], sixth * (a[2] + b[2]) + most * m[2],
    )  # fmt: skip


@inline
def resolved(c: Matrix, a: Vector) -> Vector:
    """Components of a vector in other axes: C a, the matrix row by row."""
    return (
        c[0] * a[0] + c[1] * a[1] + c[2] * a[2],
        c[3] * a[0] + c[4] * a[1] + c[5] * a[2],
        c[6] * a[0] + c[7] * a[1] + c[8] * a[2],
    )


@inline
def turned(a: Vector, r: Vector) -> Vector:
    """A vector fixed in space, in axes that turn by the small rotation vector r: exp(−[r×]) a to the third order."""
    return sub_cross(a, r, sub_cross(a, mul(0.5, r), a))


@inline
def column(y: Array, row: int, j: int) -> Vector:
    """Three rows of a column of an array, from `row` on."""
    return y[row, j], y[row + 1, j], y[row + 2, j]


@inline
def keep_column(y: Array, row: int, j: int, a: Vector) -> None:
    """Store a vector in three rows of a column."""
    y[row, j], y[row + 1, j], y[row + 2, j] = a
