"""Counter-based random numbers (Philox): each is a function of seed, term, axis and index, equal on all machines.

Philox4x32-10 (Salmon, Moraes, Dror and Shaw, Parallel random numbers: as easy as 1, 2, 3, SC11, 2011): the key is the
seed, and the counter holds the number of the sample, the CRC-32 of the term's name and the axis. The 128 output bits
give two normal numbers by the Box-Muller method: the first is for the gyro, the second for the accelerometer of the
same term and axis. Logarithm, sine and cosine are polynomials, and all operations keep their written order, so that the
numbers depend neither on a machine's library nor on vectorisation by the compiler. Their fused multiplications and
additions, which are rounded once, are written out for the same reason.
"""

from __future__ import annotations

import math
import zlib

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.jit import fused, strict_inline, strict_kernel

Words = NDArray[np.uint64]

_MULTIPLY_0, _MULTIPLY_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_LOW = np.uint64(0xFFFFFFFF)
_32, _20, _12 = np.uint64(32), np.uint64(20), np.uint64(12)
_ROUNDS = 10

_BITS = 2.0**-52
_LN2 = math.log(2.0)
_PLACE = 2.0**-50 * 0.5 * math.pi  # a quarter turn has 2⁵⁰ places
_HALF_QUARTER = 1 << 49
_SQRT_HALF = 0x3FE6A09E667F3BCD  # the bits of √½

# atanh(s)/s for s² ≤ (3 − 2√2)², sin(x)/x and cos(x) for |x| ≤ π/4, all to rounding (series in s² and x²)
_ATANH = tuple(1.0 / (2 * n + 1) for n in range(11))
_SIN = tuple((-1) ** n / math.factorial(2 * n + 1) for n in range(8))
_COS = tuple((-1) ** n / math.factorial(2 * n) for n in range(9))


@strict_inline
def philox(
    key_0: np.uint64, key_1: np.uint64, c0: np.uint64, c1: np.uint64, c2: np.uint64, c3: np.uint64
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return the four words of one block; every argument and every word has 32 bits."""
    for _ in range(_ROUNDS):
        # words are cut to 32 bits where they are multiplied: there the processor does it at no cost
        product_0, product_1 = _MULTIPLY_0 * (c0 & _LOW), _MULTIPLY_1 * (c2 & _LOW)
        c0 = (product_1 >> _32) ^ c1 ^ key_0
        c2 = (product_0 >> _32) ^ c3 ^ key_1
        c1, c3 = product_1, product_0
        key_0, key_1 = key_0 + _WEYL_0, key_1 + _WEYL_1
    return c0 & _LOW, c1 & _LOW, c2 & _LOW, c3 & _LOW


@strict_inline
def _log(x: float) -> float:
    """Return ln x of a normal positive number: x = 2^e m with √½ ≤ m < √2, ln m = 2 atanh((m − 1)/(m + 1))."""
    bits = np.float64(x).view(np.int64)
    exponent = (bits - _SQRT_HALF) >> 52
    m = np.int64(bits - (exponent << 52)).view(np.float64)
    s = (m - 1.0) / (m + 1.0)
    z = s * s
    series = _ATANH[10]
    for n in range(9, -1, -1):
        series = fused(z, series, _ATANH[n])
    logarithm: float = fused(float(exponent), _LN2, 2.0 * s * series)
    return logarithm


@strict_inline
def normal_pair(
    key_0: np.uint64, key_1: np.uint64, number: np.int64, term: np.uint64, axis: np.uint64
) -> tuple[float, float]:
    """Return two independent normal numbers, for gyro and accelerometer, mean 0, variance 1, at most 8.6 in size."""
    sample = np.uint64(number)
    w0, w1, w2, w3 = philox(key_0, key_1, sample & _LOW, sample >> _32, term, axis)
    radius, (first, second) = radius_k(w0, w1), direction_k(w2, w3)
    return radius * first, radius * second


@strict_inline
def radius_k(w0: np.uint64, w1: np.uint64) -> float:
    """Return the radius √(−2 ln u) of a pair, from two words."""
    # 52 bits plus one half: neither 0 nor 1 occurs
    return math.sqrt(-2.0 * _log((float(np.int64((w0 << _20) | (w1 >> _12))) + 0.5) * _BITS))


@strict_inline
def direction_k(w2: np.uint64, w3: np.uint64) -> tuple[float, float]:
    """Return cosine and sine of the direction of a pair, from two words."""
    place = np.int64((w2 << _20) | (w3 >> _12))  # of 2⁵² on the circle
    quadrant = (place + _HALF_QUARTER) >> 50
    x = (float(place - (quadrant << 50)) + 0.5) * _PLACE
    z = x * x
    sine, cosine = _SIN[7], _COS[8]
    for n in range(6, -1, -1):
        sine = fused(z, sine, _SIN[n])
    sine *= x
    for n in range(7, -1, -1):
        cosine = fused(z, cosine, _COS[n])
    swapped = (quadrant & 1) == 1
    first = sine if swapped else cosine
    second = cosine if swapped else sine
    first = -first if ((quadrant + 1) & 2) == 2 else first
    second = -second if (quadrant & 2) == 2 else second
    return first, second


@strict_kernel
def normal_pairs(
    gyro: Array, accel: Array, key_0: np.uint64, key_1: np.uint64, first: int, term: np.uint64, axis: np.uint64
) -> None:
    """Write consecutive pairs of normal numbers, (N,) each, several at a time where the processor has vector units."""
    for n in range(len(gyro)):
        gyro[n], accel[n] = normal_pair(key_0, key_1, np.int64(first + n), term, axis)


@strict_kernel
def normal_pairs_of_runs(
    gyro: Array, accel: Array, key_0: Words, key_1: Words, number: int, term: np.uint64, axis: np.uint64
) -> None:
    """Write the pairs of one sample of R runs, with the keys of their seeds, as `normal_pairs`."""
    for run in range(len(gyro)):
        gyro[run], accel[run] = normal_pair(key_0[run], key_1[run], np.int64(number), term, axis)


def term_number(term: str) -> np.uint64:
    """Return the generator's number of a term: the CRC-32 of its name, such as "random walk"."""
    return np.uint64(zlib.crc32(term.encode()))


def key(seed: int) -> tuple[np.uint64, np.uint64]:
    """Return the generator's key of a run's seed."""
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < 1 << 64:
        raise InputError(
            f"the seed {shortened(repr(seed))} cannot be used; it must be a whole number from 0 to 2⁶⁴ − 1."
        )
    return np.uint64(int(seed) & 0xFFFFFFFF), np.uint64(int(seed) >> 32)


def pairs(seed: int, term: str, axis: int, count: int, first: int = 0) -> Array:
    """Return the numbers of gyro and accelerometer, (2, count), of one axis of an error term, mean 0, variance 1."""
    out = np.empty((2, count))
    key_0, key_1 = key(seed)
    normal_pairs(out[0], out[1], key_0, key_1, first, term_number(term), np.uint64(axis))
    return out


def normals(seed: int, term: str, axis: int, count: int) -> Array:
    """Return the numbers of one axis of a term without partner, "gnss position", mean 0, variance 1, (count,)."""
    numbers: Array = pairs(seed, term, axis, count)[0]
    return numbers
