"""The generator against published vectors and numpy's, its normal numbers against the normal distribution."""

from __future__ import annotations

import hashlib
import math
import zlib

import numpy as np
import pytest
from scipy import stats

from sinssim.errors import InputError
from sinssim.jit import strict_kernel
from sinssim.statistics.random_numbers import key, normal_pair, normals, pairs, philox, term_number
from tests.oracles.philox import philox as by_definition


@strict_kernel
def _block(words: np.ndarray) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    return philox(words[0], words[1], words[2], words[3], words[4], words[5])


@strict_kernel
def _one(key_0: np.uint64, key_1: np.uint64, number: int, term: np.uint64, axis: np.uint64) -> tuple[float, float]:
    return normal_pair(key_0, key_1, number, term, axis)


# philox 4x32 10 of Random123's known answers: counter, key, words
KNOWN = [
    ("00000000 00000000 00000000 00000000", "00000000 00000000", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
]


def _words(text: str) -> list[int]:
    return [int(word, 16) for word in text.split()]


@pytest.mark.parametrize(("counter", "key_words", "expected"), KNOWN, ids=["zeros", "ones", "pi"])
def test_published_vectors(counter: str, key_words: str, expected: str) -> None:
    given = np.array(_words(key_words) + _words(counter), dtype=np.uint64)
    assert [int(word) for word in _block(given)] == _words(expected)
    assert list(by_definition(32, tuple(_words(key_words)), tuple(_words(counter)))) == _words(expected)


def test_the_definition_gives_numpys_generator_with_longer_words() -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        key_words = rng.integers(0, 1 << 64, 2, dtype=np.uint64)
        counter = rng.integers(0, 1 << 64, 4, dtype=np.uint64)
        words = np.random.Philox(key=key_words, counter=counter).random_raw(4)
        following = int(counter[0]) + 1, *(int(word) for word in counter[1:])  # numpy counts before it computes
        expected = by_definition(64, tuple(int(word) for word in key_words), following)
        assert [int(word) for word in words] == list(expected)


def test_the_kernel_gives_the_definition() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        given = rng.integers(0, 1 << 32, 6, dtype=np.uint64)
        numbers = [int(word) for word in given]
        assert [int(w) for w in _block(given)] == list(by_definition(32, tuple(numbers[:2]), tuple(numbers[2:])))


def test_normal_numbers_are_box_and_mullers_of_the_words() -> None:
    """Key, counter and bits as the module says; logarithm and sines by the library."""
    seed, term, axis = (7 << 32) + 5, "random walk", 2
    found = pairs(seed, term, axis, 1000, first=(1 << 34) + 5)
    for n in range(1000):
        block, odd = divmod(n + 5, 2)
        w = by_definition(32, (5, 7), (block, 2, zlib.crc32(term.encode()), axis))[2 * odd : 2 * odd + 2]
        u = ((w[0] << 8 | w[1] >> 24) + 0.5) / 2**40
        v = ((w[1] & 0xFFFFFF) + 0.5) / 2**24
        radius = math.sqrt(-2.0 * math.log(u))
        assert found[0, n] == pytest.approx(radius * math.cos(2 * math.pi * v), rel=1e-13, abs=4e-15)
        assert found[1, n] == pytest.approx(radius * math.sin(2 * math.pi * v), rel=1e-13, abs=4e-15)


def test_one_at_a_time_and_many_at_once_are_the_same_bits() -> None:
    """The compiler may compute eight numbers in one go; in any order and any block they are what they are alone."""
    whole = pairs(3, "flicker", 1, 1000)
    key_0, key_1 = key(3)
    term = term_number("flicker")
    alone = np.array([_one(key_0, key_1, n, term, np.uint64(1)) for n in range(1000)]).T
    assert np.array_equal(whole, alone)
    for first in (1, 5, 640):
        for count in (0, 1, 2, 17, 18):
            assert np.array_equal(pairs(3, "flicker", 1, count, first), whole[:, first : first + count])


def test_the_bits_are_the_same_on_every_machine() -> None:
    """No library's function is in them; if this digest changes, so does every result with noise in it."""
    digest = hashlib.sha256()
    for seed in (0, 1 << 63):
        for axis in (0, 2):
            digest.update(pairs(seed, "random walk", axis, 500).astype("<f8").tobytes())
    assert digest.hexdigest() == "3fc12d699616ba22c9f57715912e10022965aeaa4d5a111291d184af966fe398"


COUNT = 2_000_000


@pytest.fixture(scope="module")
def many() -> np.ndarray:
    return pairs(2026, "random walk", 0, COUNT // 2).ravel()


def test_the_distribution_is_normal(many: np.ndarray) -> None:
    # the largest distance of the two distribution functions, against Kolmogorov's limit law at 0.01 %
    x = np.sort(many)
    below = stats.norm.cdf(x)
    step = np.arange(COUNT + 1) / COUNT
    distance = max(np.max(step[1:] - below), np.max(below - step[:-1]))
    assert distance * math.sqrt(COUNT) < stats.kstwobign.ppf(1 - 1e-4)
    assert distance * math.sqrt(COUNT) > stats.kstwobign.ppf(1e-4)  # nor is it too good


def test_moments(many: np.ndarray) -> None:
    # the variance of the mean of xⁿ is (m_2n − m_n²)/N with m_n = 1, 3, 15, … for even n
    moments = {1: 0.0, 2: 1.0, 3: 0.0, 4: 3.0, 5: 0.0, 6: 15.0, 8: 105.0, 10: 945.0, 12: 10395.0}
    power = np.ones_like(many)
    for n in (1, 2, 3, 4, 5, 6):
        power *= many
        error = abs(np.mean(power) - moments[n])
        assert error < 4.5 * math.sqrt((moments[2 * n] - moments[n] ** 2) / COUNT)


@pytest.mark.parametrize("limit", [2.0, 3.0, 4.0, 4.5, 5.0])
@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["low", "high"])
def test_tails(many: np.ndarray, limit: float, side: float) -> None:
    expected = COUNT * stats.norm.sf(limit)
    count = np.count_nonzero(side * many > limit)
    assert stats.poisson.ppf(1e-5, expected) <= count <= stats.poisson.ppf(1 - 1e-5, expected)


def test_angles_and_radii_are_those_of_independent_pairs() -> None:
    first, second = pairs(9, "bias instability", 1, 1_000_000)
    turns = np.arctan2(second, first) / (2 * math.pi) + 0.5
    energy = np.exp(-0.5 * (first**2 + second**2))
    for uniform in (turns, energy):
        counts = np.histogram(uniform, 1000, (0.0, 1.0))[0]
        assert stats.chi2.ppf(1e-4, 999) < np.sum((counts - 1000.0) ** 2) / 1000.0 < stats.chi2.ppf(1 - 1e-4, 999)
    cells = np.histogram2d(turns, energy, 30, ((0, 1), (0, 1)))[0]
    expected = 1e6 / 900
    assert np.sum((cells - expected) ** 2) / expected < stats.chi2.ppf(1 - 1e-4, 899)


def test_the_two_halves_of_a_block_are_independent() -> None:
    first, second = pairs(11, "random walk", 2, 500_000).reshape(2, -1, 2).transpose(2, 0, 1).reshape(2, -1)
    for one, other in ((first, second), (first**2, second**2), (first**2, second), (first, second**2)):
        assert abs(np.corrcoef(one, other)[0, 1]) < 4.5 / math.sqrt(len(one))
    cells = np.histogram2d(stats.norm.cdf(first), stats.norm.cdf(second), 30, ((0, 1), (0, 1)))[0]
    expected = len(first) / 900
    assert stats.chi2.ppf(1e-4, 899) < np.sum((cells - expected) ** 2) / expected < stats.chi2.ppf(1 - 1e-4, 899)


def test_seeds_terms_axes_triads_and_neighbours_are_uncorrelated() -> None:
    count = 100_000
    rows = [
        row
        for seed in (0, 1, 2, 1 << 32, 1 << 40)
        for term in ("random walk", "bias instability", "flicker")
        for axis in range(3)
        for row in pairs(seed, term, axis, count)
    ]
    rows += [row[1:] for row in rows[:2]]  # one sample later
    table = np.array([row[: count - 1] for row in rows])
    correlation = np.corrcoef(table) - np.eye(len(table))
    # 4186 numbers of variance 1/N: the largest is beyond 5.5σ once in 6000 such tables
    assert np.max(np.abs(correlation)) < 5.5 / math.sqrt(count)
    squares = np.corrcoef(table**2) - np.eye(len(table))
    assert np.max(np.abs(squares)) < 5.5 / math.sqrt(count)


def test_numbers_of_one_sequence_are_uncorrelated_at_every_distance(many: np.ndarray) -> None:
    x = many[: 1 << 20]
    spectrum = np.abs(np.fft.rfft(x)[1:-1]) ** 2 / len(x)  # of white noise: exponential, mean 1
    distance = stats.kstest(spectrum[:200_000], "expon").statistic * math.sqrt(200_000)
    assert distance < stats.kstwobign.ppf(1 - 1e-4)


def test_names_of_terms_have_numbers_of_their_own() -> None:
    from sinssim.sensors.imu.error_term_table import TERMS

    names = {quantity.field for quantity in TERMS}
    names |= {"random walk", "bias instability", "rate random walk", "flicker", "flicker start", "time stamp jitter"}
    assert len({int(term_number(name)) for name in names}) == len(names)


@pytest.mark.parametrize("seed", [-1, 1 << 64, 1.5, "7", None, True])
def test_seeds_that_cannot_be(seed: object) -> None:
    with pytest.raises(InputError, match="whole number from 0 to 2⁶⁴ − 1"):
        normals(seed, "bias", 0, 1)  # type: ignore[arg-type]


def test_the_largest_seed() -> None:
    assert np.all(np.isfinite(normals((1 << 64) - 1, "bias", 0, 3)))
