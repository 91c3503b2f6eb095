"""The entry of a rotating IMU in `summary.json`, and its sentence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sinssim.formatting import number_text
from sinssim.recording.store.summary import NO_NUMBERS, error_numbers
from sinssim.strapdown.nav_error import NavError


def rotation_numbers(without: NavError | None) -> dict[str, Any]:
    """Return the entry of a rotating IMU.

    Args:
        without: errors of the first algorithm without the rotation; None without a solution.

    Returns:
        `without_rotation`, as the entries of algorithms.
    """
    return {"without_rotation": NO_NUMBERS if without is None else error_numbers(without)}


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
