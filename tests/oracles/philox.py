"""Philox of any word length, straight from its definition with Python's integers (Salmon et al., SC11, 2011)."""

from __future__ import annotations

MULTIPLIERS = {32: (0xD2511F53, 0xCD9E8D57), 64: (0xD2E7470EE14C6C93, 0xCA5A826395121157)}
WEYL = {32: (0x9E3779B9, 0xBB67AE85), 64: (0x9E3779B97F4A7C15, 0xBB67AE8584CAA73B)}


def philox(bits: int, key: tuple[int, int], counter: tuple[int, int, int, int], rounds: int = 10) -> tuple[int, ...]:
    """Return one block of Philox4x32 or Philox4x64.

    Args:
        bits: length of a word, 32 or 64.
        key: two words.
        counter: four words.
        rounds: how many.

    Returns:
        Four words.
    """
    (m0, m1), (w0, w1), low = MULTIPLIERS[bits], WEYL[bits], (1 << bits) - 1
    k0, k1 = key
    x0, x1, x2, x3 = counter
    for _ in range(rounds):
        high0, low0 = divmod(m0 * x0, 1 << bits)
        high1, low1 = divmod(m1 * x2, 1 << bits)
        x0, x1, x2, x3 = high1 ^ x1 ^ k0, low1, high0 ^ x3 ^ k1, low0
        k0, k1 = (k0 + w0) & low, (k1 + w1) & low
    return x0, x1, x2, x3
