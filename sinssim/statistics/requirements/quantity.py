"""Quantities of the navigation errors as people write them, without a limit: "r95(3600 s)", "heading(end)"."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from sinssim.errors import InputError, shortened, unknown_name
from sinssim.statistics.requirements.requirement import QUANTITIES, Requirement, When, parse_when

_PATTERN = re.compile(r"\s*(?P<name>\w+)\s*(\((?P<when>[^()]*)\))?\s*")
_SI = {"length": "m", "speed": "mps", "angle": "rad"}


@dataclass(frozen=True)
class Quantity:
    """A quantity at an instant.

    Attributes:
        quantity: one of `QUANTITIES`.
        when: "at" a time, at the "end", or the largest throughout the "run".
        time: the time for "at", s since the start; 0 for the others.
    """

    quantity: str
    when: When
    time: float = 0.0

    @property
    def text(self) -> str:
        """As it is written: "r95(3600 s)"."""
        return f"{self.quantity}({f'{self.time:.10g} s' if self.when == 'at' else self.when})"

    @property
    def dimension(self) -> str:
        """ "length", "speed" or "angle"."""
        return QUANTITIES[self.quantity][0]

    @property
    def instant(self) -> str:
        """When it holds, in words."""
        largest = "largest of the run"
        return {"at": f"at {self.time:.10g} s", "end": "at the end", "run": largest}[self.when]

    @property
    def column(self) -> str:
        """Name of its column, with the unit: "r95_3600s_m", "heading_end_rad"; rates are in nmi/h."""
        when = f"{self.time:.10g}s" if self.when == "at" else self.when
        return f"{self.quantity}_{when}_{'nmi_h' if self.quantity == 'rate' else _SI[self.dimension]}"


def quantity_of(requirement: Requirement) -> Quantity:
    """Return the quantity of a requirement."""
    return Quantity(requirement.quantity, requirement.when, requirement.time if requirement.when == "at" else 0.0)


def parse_quantity(text: str) -> Quantity:
    """Read a quantity.

    Args:
        text: for example "r95(3600 s)", "cep(end)" or "heading(run)"; without parentheses it is that at the end.

    Raises:
        InputError: it cannot be read, or there is no such quantity.
    """
    found = _PATTERN.fullmatch(text) if isinstance(text, str) else None
    if found is None:
        raise InputError(
            f'the quantity {shortened(repr(text))} cannot be read; write it like "r95(3600 s)" or "heading(end)".'
        )
    name = found["name"].lower()
    if name not in QUANTITIES:
        raise unknown_name("quantity", name, QUANTITIES)
    if found["when"] is None:
        return Quantity(name, "end")
    when, time = parse_when(found["when"], name, f"quantity {shortened(repr(text))}")
    return Quantity(name, when, 0.0 if math.isnan(time) else time)
