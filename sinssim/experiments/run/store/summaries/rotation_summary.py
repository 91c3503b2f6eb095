"""The entry of a rotating IMU in `summary.json`, and its sentence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sinssim.formatting import number_text


def rotation_sentences(entry: Mapping[str, Any], numbers: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield the effect of the rotation, in words.

    Args:
        entry: from `rotation_numbers`.
        numbers: entries of the algorithms with a solution.
    """
    still = entry["without_rotation"]["max_horizontal_error_m"]
    if still is None or not numbers:
        return
    own = next(iter(numbers.values()))["max_horizontal_error_m"]
    yield (
        f"The IMU rotates in the vehicle. The horizontal error reaches {number_text(own, 4)} m. With the same sensor "
        f"errors and without the rotation it reaches {number_text(still, 4)} m."
    )
