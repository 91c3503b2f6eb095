"""The ratios of the three rates of (8.20)-(8.28); apart from the schedule itself, so that a scenario can be checked."""

from __future__ import annotations

import math

from sinssim.algorithms import REGISTRY
from sinssim.errors import InputError

_WHOLE = 2e-6  # a ratio of rates this near to a whole number, relatively, is one: 33.3333 Hz divides 100 Hz
_NEAR = 0.01  # but no ratio that is farther from one


def whole_ratio(fast: float, slow: float) -> int | None:
    """Return how many times one rate goes into another.

    Args:
        fast: Hz.
        slow: Hz.

    Returns:
        A whole number, at least 1; None if it does not go a whole number of times, as nearly as rates are written.
    """
    ratio = fast / slow
    whole = round(ratio)
    return whole if whole >= 1 and abs(ratio - whole) <= min(_WHOLE * whole, _NEAR) else None


def schedule(rates_hz: tuple[float, float, float], data_hz: float) -> tuple[int, int, int]:
    """Return the whole ratios of the data's rate to the fast, the fast to the medium, the medium to the slow one.

    Args:
        rates_hz: fast, medium and slow rate.
        data_hz: rate of the data.

    Returns:
        Three whole numbers, at least 1.

    Raises:
        InputError: rates that do not divide, with the nearest that would.
    """
    if len(rates_hz) != 3:
        raise InputError(f"rates_hz = {rates_hz} must be three rates: fast, medium and slow, Hz.")
    ratios = []
    above, above_name = data_hz, "the data's rate"
    for name, rate in zip(("fast", "medium", "slow"), rates_hz, strict=True):
        if not (math.isfinite(rate) and rate > 0.0):
            raise InputError(f"rates_hz: the {name} rate, {rate} Hz, must be positive.")
        ratio, whole = above / rate, whole_ratio(above, rate)
        if whole is None:
            low = max(math.floor(ratio), 1)
            near = " or ".join(f"{above / n:.9g}" for n in dict.fromkeys((low, low + 1 if ratio > 1.0 else 1)))
            raise InputError(
                f"rates_hz: the {name} rate, {rate:g} Hz, does not divide {above_name}, {above:.6g} Hz, a whole number "
                f"of times; {near} Hz would."
            )
        ratios.append(whole)
        above, above_name = above / whole, f"the {name} rate"
    return ratios[0], ratios[1], ratios[2]


def check_parts(algorithm: str, frame: str) -> None:
    """Raise for an algorithm or a frame that cannot be run at three rates.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.
        frame: one of `sinssim.FRAMES`.

    Raises:
        InputError: the schedule works with the attitude algorithms that advance sample by sample, in the level frame.
    """
    if frame != "level":
        raise InputError(f"rates_hz: the three-rate schedule works in the frame level, not in {frame}.")
    if not REGISTRY[algorithm].sample_by_sample:
        raise InputError(
            f"rates_hz: the fast part advances the attitude sample by sample, {algorithm} by several at once; "
            "quaternion, poisson, euler and their like, or rotation-vector-1p, would do."
        )
