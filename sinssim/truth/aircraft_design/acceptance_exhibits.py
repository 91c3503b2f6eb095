"""What an acceptance flight has to show: the errors of each leg beside their limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from sinssim.exhibits import Column, Item, Sentence, Table
from sinssim.truth.aircraft_design.acceptance_flight import LIMITS, LegErrors

_KEYS = (("height_m", "height, m"), ("airspeed_kt", "airspeed, kt"), ("heading_deg", "heading, °"),
         ("rate_deg_s", "roll or pitch rate, °/s"))  # fmt: skip


def acceptance_numbers(name: str, height: float, errors: Sequence[LegErrors]) -> dict[str, Any]:
    """Return the errors of an acceptance flight as plain numbers with units in the names; `height` is its height, m."""
    return {
        "aircraft": name,
        "height_m": height,
        "accepted": not any(leg_errors.excess() for leg_errors in errors),
        "legs": [{**asdict(leg_errors), "limits": asdict(LIMITS[leg_errors.kind])} for leg_errors in errors],
    }


def acceptance_items(name: str, height: float, errors: Sequence[LegErrors]) -> Iterator[Item]:
    """Yield the verdict on an aircraft and the largest errors of each leg; `height` is that of the flight, m."""
    excess = [words for leg_errors in errors if (words := leg_errors.excess())]
    yield Sentence(
        f"{name} flies the acceptance plan at {height:.0f} m: every leg is within its limits."
        if not excess
        else f"{name} does not hold the limits of the acceptance plan at {height:.0f} m: {'; '.join(excess)}."
    )
    columns = (Column("leg", words=True), *(Column(head) for _, head in _KEYS))
    rows = [(leg_errors.leg, *(_cell(leg_errors, key) for key, _ in _KEYS)) for leg_errors in errors]
    yield Table(columns, rows, title="Largest errors", note="In brackets: limits.")


def _cell(errors: LegErrors, key: str) -> str:
    value, most = getattr(errors, key), getattr(LIMITS[errors.kind], key)
    return "" if value is None else f"{value:.2f} ({most:g})"
