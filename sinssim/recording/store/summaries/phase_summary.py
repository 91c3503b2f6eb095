"""What each phase of a mission adds to the errors: the entry `phases` of `summary.json`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim import units
from sinssim.data import Array
from sinssim.formatting import signed
from sinssim.strapdown.nav_error import NavError
from sinssim.truth.channel import FlightEvent

_LEG = re.compile(r"leg (\d+) \((\w+)\) (begins|ends)")
_REACHED = re.compile(r"(.+) reached: \d+ m away, height .*")
_OF_LEG = {
    "park": "standstill", "parked": "standstill", "stop": "standstill", "taxi": "taxi", "takeoff": "take-off",
    "take_off": "take-off", "land": "landing", "straight": "under way", "turn": "under way",
}  # fmt: skip
"""Phase of a leg by its type; any other leg is flight."""
_STILL = "standstill"
_NOTHING = 1e-9  # smaller errors, by rounding, are shown as zero

NOTE = (
    "Errors at the end of each phase. Added: length of the change of the north and east error of position or velocity "
    "within the phase, and change of the other errors. The first row of a solution that aligns itself is its start."
)


@dataclass(frozen=True)
class Phase:
    """A part of a mission.

    Attributes:
        name: "alignment", "standstill", "taxi", "take-off", "flight", "landing" and so on.
        start, end: instants, s.
    """

    name: str
    start: float
    end: float


def phases_of(events: Iterable[FlightEvent], driven: bool = False) -> list[Phase]:
    """Return the phases of a motion by its legs; neighbouring legs of one kind are one phase, and so is the flight to
    each named waypoint.

    Args:
        events: events of the trajectory.
        driven: whether the legs are those of a vehicle on the ground or on water, where a turn is no flight.

    Returns:
        The phases in order; empty for a motion of a single kind, which has nothing to compare.
    """
    begun: dict[str, float] = {}
    found: list[Phase] = []
    number = ""
    for event in events:
        match = _LEG.fullmatch(event.text)
        if match is None:
            place = _REACHED.fullmatch(event.text)
            if place is not None and number in begun:
                found.append(Phase(f"flight to {place[1]}", begun[number], event.time))
                begun[number] = event.time
            continue
        number, kind, edge = match.groups()
        if edge == "begins":
            begun[number] = event.time
            continue
        name = _OF_LEG.get(kind, "flight")
        if name == "under way" and not driven:
            name = "flight"
        start = begun.get(number, event.time)
        if found and found[-1].name == name:
            found[-1] = Phase(name, found[-1].start, event.time)
        elif event.time > start:
            found.append(Phase(name, start, event.time))
    return found if len(found) > 1 else []


def phase_rows(phases: Sequence[Phase], time: Array, fine: bool) -> list[dict[str, Any]]:
    """Return the phases of a solution: an alignment before its first row, the rest of the standstill after it, and
    none that begins after its last row, where a filter has diverged.

    Args:
        phases: of the motion.
        time: times of the solution, (N,) s.
        fine: whether the solution goes on aligning itself while the vehicle stands, by zero velocity.

    Returns:
        For each phase `phase`, `from_s` and `to_s`; those outside the solution are left out.
    """
    rows: list[dict[str, Any]] = []
    start, end = float(time[0]), float(time[-1])
    for phase in phases:
        begin, name = phase.start, phase.name
        if phase.end < start - 1e-9 or begin > end - 1e-9:
            continue
        if begin < start - 1e-9:
            rows.append({"phase": "alignment", "from_s": begin, "to_s": start})
            begin = start
        if name == _STILL and fine and len(rows) <= 1:
            name = "fine alignment"
        if phase.end - begin > 1e-9:
            rows.append({"phase": name, "from_s": begin, "to_s": min(phase.end, end)})
    return rows


def phase_numbers(
    phases: Sequence[Phase], time: Array, error_at: Callable[[NDArray[np.intp]], NavError], fine: bool = False
) -> list[dict[str, Any]]:
    """Return the errors of a solution at the end of each phase, and what the phase added.

    Args:
        phases: of the motion.
        time: times of the solution, (N,) s.
        error_at: returns the errors in some rows.
        fine: as for `phase_rows`.

    Returns:
        For each phase its name, beginning and end, and the errors: `_error_` at its end and `_added_` within it, of
        horizontal position, height, velocity, heading and tilt.
    """
    rows = phase_rows(phases, time, fine)
    ends = np.searchsorted(time, [row["to_s"] - 1e-9 for row in rows])
    edges = np.concatenate([[0], np.minimum(ends, len(time) - 1)]).astype(np.intp)
    error = error_at(edges)
    for number, row in enumerate(rows, start=1):
        aligned = number == 1 and row["phase"] == "alignment"
        row.update(_errors(error, number, None if aligned else number - 1))
    return rows


def _errors(error: NavError, end: int, begin: int | None) -> dict[str, float]:
    """Return the errors in a row, and their change since another; since nothing if there is none."""

    def of(values: Array, unit: float = 1.0) -> tuple[float, float]:
        now = values[end] / unit
        then = np.zeros_like(now) if begin is None else values[begin] / unit
        return float(np.linalg.norm(now)), float(np.linalg.norm(now - then))

    def signed(values: Array, unit: float = 1.0) -> tuple[float, float]:
        now = float(values[end]) / unit
        return now, now - (0.0 if begin is None else float(values[begin]) / unit)

    found: dict[str, float] = {}
    for name, (value, added) in {
        "horizontal_{}_m": of(error.position_ned[:, :2]),
        "height_{}_m": signed(-error.position_ned[:, 2]),
        "velocity_{}_mps": of(error.velocity_ned),
        "heading_{}_arcmin": signed(-error.attitude[:, 2], units.ARCMIN),
        "tilt_{}_arcsec": of(error.attitude[:, :2], units.ARCSEC),
    }.items():
        found[name.format("error")], found[name.format("added")] = value, added
    return found


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
