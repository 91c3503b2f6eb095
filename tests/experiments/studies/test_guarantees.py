"""What algorithms guarantee of norm and orthogonality, against the exact product of truncated exponential series."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim.data import ImuData, NavState
from sinssim.experiments.studies.attitude_claims import EXACTLY, ORDER, ROUNDING, guarantee
from sinssim.strapdown.attitude import ALGORITHMS, REGISTRY
from sinssim.strapdown.navigate import navigate
from tests.strapdown.variants import with_slow_variants

SECONDS, RATE_DEG_S = 4.0, 60.0


def defect(algorithm: str, rate_hz: float) -> float:
    """The defect after a constant turn about the forward axis."""
    count = round(SECONDS * rate_hz)
    turn = np.tile([math.radians(RATE_DEG_S) / rate_hz, 0.0, 0.0], (count, 1))
    imu = ImuData(np.arange(count + 1) / rate_hz, turn, np.zeros((count, 3)))
    zero = np.zeros(())
    start = NavState(zero, zero, zero + 1e5, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    return float(navigate(imu, start, algorithm=algorithm).defect[-1])


def by_theory(algorithm: str, rate_hz: float) -> float:
    """|T_p(iφ/2)|ᴺ − 1 of a quaternion, |T_p(iφ)|²ᴺ − 1 of a matrix, over N steps by φ."""
    is_matrix = algorithm.startswith("poisson")
    order = 2 if algorithm == "two-quaternions" else int(REGISTRY[algorithm].variant.get("ORDER", 4))
    angle = math.radians(RATE_DEG_S) / rate_hz * (1.0 if is_matrix else 0.5)
    magnitude = abs(sum((1j * angle) ** k / math.factorial(k) for k in range(order + 1)))
    return abs(magnitude ** ((2.0 if is_matrix else 1.0) * SECONDS * rate_hz) - 1.0)


@pytest.mark.parametrize("algorithm", with_slow_variants(name for name in ALGORITHMS if guarantee(name).kept == ORDER))
def test_defects_and_their_orders(algorithm):
    """A turn about one axis, 60 deg/s: the defect is that of the truncated series, and its order the stated one."""
    rates = (50.0, 100.0) if guarantee(algorithm).order == 1 else (10.0, 20.0)  # the defect stays small
    found = [defect(algorithm, rate) for rate in rates]
    # the local level turns, too: by 1e-5 of the body's turn
    assert found == pytest.approx([by_theory(algorithm, rate) for rate in rates], rel=1e-2)
    assert math.log2(found[0] / found[1]) == pytest.approx(guarantee(algorithm).order, abs=0.05)


@pytest.mark.parametrize(
    "algorithm", with_slow_variants(name for name in ALGORITHMS if guarantee(name).kept in (EXACTLY, ROUNDING))
)
def test_what_is_kept_is_kept(algorithm):
    most = 0.0 if guarantee(algorithm).kept == EXACTLY else 1e-13
    assert defect(algorithm, 20.0) <= most


def test_words():
    assert guarantee("quaternion-4").words == "to h⁵"
    assert guarantee("quaternion-4-norm").words == "to rounding"
    assert guarantee("euler").condition == "none"
