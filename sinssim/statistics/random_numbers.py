"""Counter-based random numbers (Philox): each is a function of seed, term, axis and index, equal on all machines.

Philox4x32-10 (Salmon, Moraes, Dror and Shaw, Parallel random numbers: as easy as 1, 2, 3, SC11, 2011): the key is the
seed, and the counter holds half the number of the sample, the CRC-32 of the term's name and the axis. Of the 128 output
bits, 64 are for an even sample and 64 for the odd one that follows. They give two normal numbers by the Box-Muller
method, 40 bits the radius and 24 the direction: the first is for the gyro, the second for the accelerometer of the same
term and axis. Logarithm, sine and cosine are polynomials, and all operations keep their written order, so that the
numbers depend neither on a machine's library nor on vectorisation by the compiler. Their fused multiplications and
additions, which are rounded once, are written out for the same reason.

A first-order Gauss-Markov process of such numbers has values at instants, and means over intervals.
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
_1, _8, _24, _32 = np.uint64(1), np.uint64(8), np.uint64(24), np.uint64(32)
_LOW_24 = np.uint64(0xFFFFFF)
_ROUNDS = 10

_BITS = 2.0**-40
_LN2 = math.log(2.0)
_PLACE = 2.0**-22 * 0.5 * math.pi  # a quarter turn has 2²² places
_HALF_QUARTER = 1 << 21
_SQRT_HALF = 0x3FE6A09E667F3BCD  # the bits of √½
_INVERSE_ROOT = 0x5FE6EB50C7B537A9
"""Bits from which half the bits of x are taken for 1/√x within 3.5 %: exponent and mantissa are nearly lb x."""

# Polynomials in s² and x² of least relative error, 2e-16 and less (exchange algorithm of Remez): atanh(s)/s for
# |s| ≤ 3 − 2√2, sin(x)/x and cos(x) for |x| ≤ π/4
_ATANH = (
    1.0000000000000002, 0.3333333333327611, 0.20000000031008316, 0.1428570799060297, 0.11111718581874065,
    0.09060927690325578, 0.0841927778654968,
)  # fmt: skip
_SIN = (
    1.0, -0.16666666666666616, 0.008333333333320002, -0.0001984126982840214, 2.755731329901719e-06,
    -2.5050705846547712e-08, 1.5894136374921544e-10,
)  # fmt: skip
_COS = (
    0.9999999999999999, -0.4999999999999915, 0.041666666666453966, -0.0013888888868721792, 2.480157814838896e-05,
    -2.7555177979614077e-07, 2.062744744041737e-09,
)  # fmt: skip


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
def uniform_k(w0: np.uint64, w1: np.uint64) -> tuple[float, float]:
    """Return a uniform number u = 2^e m with √½ ≤ m < √2, from 40 bits of two words, as e and (m − 1)/(m + 1)."""
    # plus one half: neither 0 nor 1 occurs
    bits = np.float64((float(np.int64((w0 << _8) | (w1 >> _24))) + 0.5) * _BITS).view(np.int64)
    exponent = (bits - _SQRT_HALF) >> 52
    m = np.int64(bits - (exponent << 52)).view(np.float64)
    return float(exponent), (m - 1.0) / (m + 1.0)


@strict_inline
def square_k(exponent: float, s: float) -> float:
    """Return −2 ln u of what `uniform_k` gives: ln m = 2 atanh s."""
    z = s * s
    series = _ATANH[6]
    for n in range(5, -1, -1):
        series = fused(z, series, _ATANH[n])
    return -2.0 * fused(exponent, _LN2, 2.0 * s * series)  # type: ignore[no-any-return]


@strict_inline
def root_k(x: float) -> float:
    """Return √x of a normal positive number to the last bit or two: Newton's method for 1/√x, in multiplications."""
    inverse = np.int64(_INVERSE_ROOT - (np.float64(x).view(np.int64) >> 1)).view(np.float64)
    half = 0.5 * x
    for _ in range(3):  # relative errors 3.5e-2, 1.8e-3, 4.7e-6, 3.4e-11
        inverse = fused(inverse, fused(-half * inverse, inverse, 0.5), inverse)
    root = x * inverse
    return fused(0.5 * inverse, fused(-root, root, x), root)  # type: ignore[no-any-return]


@strict_inline
def normal_pair(
    key_0: np.uint64, key_1: np.uint64, number: np.int64, term: np.uint64, axis: np.uint64
) -> tuple[float, float]:
    """Return two independent normal numbers, for gyro and accelerometer, mean 0, variance 1, at most 7.6 in size."""
    block = np.uint64(number) >> _1
    w0, w1, w2, w3 = philox(key_0, key_1, block & _LOW, block >> _32, term, axis)
    odd = (np.uint64(number) & _1) == _1
    return pair_k(w2 if odd else w0, w3 if odd else w1)


@strict_inline
def pair_k(w0: np.uint64, w1: np.uint64) -> tuple[float, float]:
    """Return a pair of normal numbers from two words."""
    exponent, s = uniform_k(w0, w1)
    radius, (first, second) = root_k(square_k(exponent, s)), direction_k(w1)
    return radius * first, radius * second


@strict_inline
def direction_k(w1: np.uint64) -> tuple[float, float]:
    """Return cosine and sine of the direction of a pair, from 24 bits of its second word."""
    place = np.int64(w1 & _LOW_24)  # of 2²⁴ on the circle
    quadrant = (place + _HALF_QUARTER) >> 22
    x = (float(place - (quadrant << 22)) + 0.5) * _PLACE
    z = x * x
    sine, cosine = _SIN[6], _COS[6]
    for n in range(5, -1, -1):
        sine, cosine = fused(z, sine, _SIN[n]), fused(z, cosine, _COS[n])
    sine *= x
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
    count, odd = len(gyro), first & 1
    if odd and count:
        gyro[0], accel[0] = normal_pair(key_0, key_1, np.int64(first), term, axis)
    blocks = max(count - odd, 0) >> 1  # of no numbers at an odd place there are no blocks, not −1
    start = np.uint64(first + odd) >> _1
    for n in range(blocks):
        block = start + np.uint64(n)
        w0, w1, w2, w3 = philox(key_0, key_1, block & _LOW, block >> _32, term, axis)
        at = odd + 2 * n
        gyro[at], accel[at] = pair_k(w0, w1)
        gyro[at + 1], accel[at + 1] = pair_k(w2, w3)
    if odd + 2 * blocks < count:
        gyro[count - 1], accel[count - 1] = normal_pair(key_0, key_1, np.int64(first + count - 1), term, axis)


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


_SERIES = 0.02  # T/τ below which the truncated power series are exact to rounding


@strict_kernel
def gauss_markov(interval: Array, correlation_time: float, white: Array) -> Array:
    """Convert white noise, independent normal numbers with the process's standard deviation, (N+1,), to a stationary
    process of the same variance with an exponential autocorrelation of a time τ, s, at the edges of intervals of given
    lengths, (N,) s: (N+1,). The step is exact for any interval: b ← d b + √(1 − d²) w with d = exp(−T/τ) (Brown and
    Hwang, Introduction to Random Signals and Applied Kalman Filtering, section 5.3). The first value has the stationary
    variance."""
    process = np.empty_like(white)
    value = white[0]
    process[0] = value
    for k in range(len(interval)):
        decay = math.exp(-interval[k] / correlation_time)
        fresh = math.sqrt(-math.expm1(-2.0 * interval[k] / correlation_time))
        value = decay * value + fresh * white[k + 1]
        process[k + 1] = value
    return process


@strict_inline
def lost(x: float) -> float:
    """Return 1 − e^−x, x ≥ 0, to rounding without a library's exponential, by 1 − e^−2x = (1 − e^−x)(1 + e^−x)."""
    halvings = 0
    while x > _SERIES:
        x *= 0.5
        halvings += 1
    y = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0))))))
    for _ in range(halvings):
        y *= 2.0 - y
    return y


@strict_inline
def mean_step(x: float) -> tuple[float, float, float, float]:
    """Return the coefficients of a recursion whose outputs are distributed as the process's means over intervals.

    The means m_k of a process of variance 1 over equal intervals T = xτ have the variance V = 2(x − 1 + d)/x² and the
    covariances C d^(j−1) with C = (1 − d)²/x², d = e^−x. One normal number ν_k per step suffices for these:

        m_k = e s_(k−1) + g ν_k,   s_k = d s_(k−1) + q ν_k,   q = √(1 − d²),   s_0 normal of variance 1,

    if e² + g² = V and e (d e + q g) = C. With d = cos φ, q = sin φ, e = √V cos θ, g = √V sin θ the second condition
    reads cos φ + cos(2θ − φ) = 2C/V.

    Args:
        x: T/τ, length of the interval over correlation time.
    """
    fresh = lost(x)  # 1 − d
    d = 1.0 - fresh
    q = math.sqrt(fresh * (1.0 + d))
    if x < _SERIES:
        v = 1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0 * (1.0 - x / 8.0)))))
    else:
        v = 2.0 * (x - fresh) / (x * x)
    share = fresh / x  # C = share²
    delta = ((1.0 + d) * v - 2.0 * share * share) / v  # 1 − cos(2θ − φ)
    sine = math.sqrt(delta * (2.0 - delta))
    below = 0.5 * (fresh + d * delta + q * sine)  # sin²θ = (1 − cos 2θ)/2
    return d, q, math.sqrt(v * (1.0 - below)), math.sqrt(v * below)
