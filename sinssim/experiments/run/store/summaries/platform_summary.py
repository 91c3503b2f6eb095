"""Summary of a platform beside the same sensors strapped down: numbers for `summary.json`, and sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from sinssim.algorithms import PLATFORM
from sinssim.formatting import number_text

if TYPE_CHECKING:
    pass


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
