"""What each phase of a mission adds to the errors: the entry `phases` of `summary.json`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sinssim.formatting import signed

_NOTHING = 1e-9  # smaller errors, by rounding, are shown as zero

NOTE = (
    "Errors at the end of each phase. Added: length of the change of the north and east error of position or velocity "
    "within the phase, and change of the other errors. The first row of a solution that aligns itself is its start."
)


def phase_tables(summary: Mapping[str, Any]) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    """Yield the table of each solution as text, without its head.

    Args:
        summary: contents of `summary.json`.

    Yields:
        Name of the solution, and the cells of each row, in the order of `HEADS`.
    """
    for name, rows in summary.get("phases", {}).items():
        yield (
            name,
            [
                (row["phase"], f"{row['from_s']:.0f} … {row['to_s']:.0f}", *(_cell(row[key]) for key in HEADS))
                for row in rows
            ],
        )


HEADS = {
    "horizontal_error_m": ("horizontal", "m"),
    "horizontal_added_m": ("added", "m"),
    "velocity_error_mps": ("velocity", "m/s"),
    "velocity_added_mps": ("added", "m/s"),
    "heading_error_arcmin": ("heading", "arcmin"),
    "heading_added_arcmin": ("added", "arcmin"),
    "tilt_error_arcsec": ("tilt", "arcsec"),
    "tilt_added_arcsec": ("added", "arcsec"),
}
"""Columns of the table: name and unit by key."""


def _cell(value: float | None) -> str:
    """Write a number with three significant digits."""
    if value is None or not np.isfinite(value):
        return "–"
    if abs(value) < _NOTHING:
        return "0"
    return signed(value, 3)


SOURCE_HEADS = {
    "horizontal": ("horizontal_sigma_m", "m"),
    "heading": ("heading_sigma_arcmin", "arcmin"),
    "tilt": ("tilt_sigma_arcsec", "arcsec"),
}
"""Columns of the table of the sources: key and unit of the root mean square, by quantity."""

SOURCE_NOTE = (
    "Sources: root mean square over all runs of what a phase adds, from the covariance budget, and the shares of the "
    "largest sources in the mean square. This run is one of these runs. `sinssim budget` ranks the sources over the "
    "whole run."
)
_LARGEST, _SHARE = 2, 0.1


def source_tables(summary: Mapping[str, Any]) -> Iterator[tuple[str, list[tuple[str, ...]] | str]]:
    """Yield the table of the sources of each solution as text, without its head, or why there is none.

    Args:
        summary: contents of `summary.json`.

    Yields:
        Name of the solution, and the cells of each row, in the order of `SOURCE_HEADS`, or the reason.
    """
    for name, rows in summary.get("phases", {}).items():
        if rows and "no_sources" in rows[0]:
            yield name, rows[0]["no_sources"]
        elif rows and "sources" in rows[0]:
            yield name, [(row["phase"], *(_of_sources(row["sources"], what) for what in SOURCE_HEADS)) for row in rows]


def _of_sources(sources: Mapping[str, Any], what: str) -> str:
    """Write the root mean square and the largest sources, at most two of a tenth or more."""
    key, unit = SOURCE_HEADS[what]
    found = sources[what]
    largest = [(name, share) for name, share in found["shares"].items() if share >= _SHARE][:_LARGEST]
    of = ", ".join(f"{name} {100.0 * share:.0f}\u00a0%" for name, share in largest)
    size = _cell(found[key])
    return size if size == "0" else f"{size} {unit}: {of}"
