"""Summary of a platform beside the same sensors strapped down: numbers for `summary.json`, and sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.algorithms import PLATFORM
from sinssim.data import ImuData
from sinssim.formatting import number_text
from sinssim.recording.store.summary import error_numbers

if TYPE_CHECKING:
    from sinssim.platform.error_equations import ErrorsByCause
    from sinssim.platform.navigate import PlatformSolution
    from sinssim.sensors.sets.platform import PlatformErrors
    from sinssim.strapdown.nav_error import NavError

_TURNING = 10.0 * units.DEG / 60.0  # rate above which the vehicle is said to turn, rad/s


def platform_numbers(
    solution: PlatformSolution,
    errors: PlatformErrors,
    ideal: ImuData,
    strapdown: tuple[str, NavError] | None,
    without: NavError | None,
    by_cause: ErrorsByCause | None,
    simulated: NavError,
) -> dict[str, Any]:
    """Return the results of a platform.

    Args:
        solution: of its navigator.
        errors: of its torquers and pick-offs.
        ideal: ideal increments of the same sensors strapped down.
        strapdown: the first strapdown algorithm and its errors, None without one.
        without: errors of that algorithm if its gyros had no errors that act in turns only.
        by_cause: errors of the platform by cause.
        simulated: its errors in the simulation.

    Returns:
        Numbers for `summary.json`.
    """
    rate = ideal.dtheta / np.diff(ideal.time)[:, np.newaxis]
    speed = np.linalg.norm(rate, axis=1)
    turning = speed > _TURNING
    numbers: dict[str, Any] = {
        "torquer_scale_ppm": (errors.torquer_scale / units.PPM).tolist(),
        "pickoff_arcsec": (errors.pickoff / units.ARCSEC).tolist(),
        "max_commanded_rate_deg_h": float(np.linalg.norm(solution.commanded, axis=1).max() / units.DEG_H),
        "max_rate_of_the_vehicle_deg_s": float(speed.max() / units.DEG),
        "turned_deg": float((speed * np.diff(ideal.time))[turning].sum() / units.DEG),
    }
    if by_cause is not None:
        numbers["final_horizontal_error_by_cause_m"] = {
            name.replace(" ", "_"): float(np.hypot(*rows[-1])) for name, rows in by_cause.position.items()
        }
        numbers["largest_difference_from_error_equations_m"] = by_cause.apart(simulated)
    if strapdown is not None and without is not None:
        name, own = strapdown
        rows = min(len(own.time), len(without.time))
        apart = np.linalg.norm(own.position_ned[:rows, :2] - without.position_ned[:rows, :2], axis=1)
        numbers["strapdown"] = {
            "algorithm": name,
            "without_errors_of_turns": error_numbers(without),
            "final_distance_m": float(apart[-1]),
            "max_distance_m": float(apart.max()),
        }
    return numbers


def platform_sentences(numbers: Mapping[str, Any], algorithms: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield the results of a platform in words.

    Args:
        numbers: result of `platform_numbers`.
        algorithms: errors of the algorithms.

    Yields:
        Sentences.
    """
    most = number_text(numbers["max_commanded_rate_deg_h"], 3)
    turned = numbers["max_commanded_rate_deg_h"] > 0.0
    yield (
        f"The platform was {f'turned by its gyros at up to {most} deg/h' if turned else 'not turned in inertial space'}"
        f"; in the strapdown system, they measured up to {number_text(numbers['max_rate_of_the_vehicle_deg_s'], 3)} "
        f"deg/s, and "
        f"{number_text(numbers['turned_deg'], 4)}° in turns."
    )
    beside = numbers.get("strapdown")
    if beside is None or PLATFORM not in algorithms or beside["algorithm"] not in algorithms:
        return
    own, other, without = algorithms[PLATFORM], algorithms[beside["algorithm"]], beside["without_errors_of_turns"]
    if any(n["final_horizontal_error_m"] is None for n in (own, other, without)):
        return

    def both(errors: Mapping[str, Any]) -> str:
        end, most = (number_text(errors[f"{when}_horizontal_error_m"], 4) for when in ("final", "max"))
        return f"{end} m at the end, {most} m at most"

    yield (
        f"Horizontal error of the same sensors on the platform: {both(own)}; strapdown ({beside['algorithm']}): "
        f"{both(other)}."
    )
    yield (
        "Scale factor, misalignment and non-linearity of the gyros, which act on the sensed rate, changed the "
        f"strapdown solution by {number_text(beside['final_distance_m'], 4)} m at the end, "
        f"{number_text(beside['max_distance_m'], 4)} m at most; without them its error is {both(without)}."
    )
