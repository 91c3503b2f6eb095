"""Requirements on navigation errors as text, "r95(3600 s) <= 1852 m", their quantities, and their limits in charts.

    QUANTITY(WHEN) <= NUMBER UNIT, or miss(WAYPOINT) <= NUMBER UNIT

A quantity is `cep` or `r95`, the radius of the circle that contains 50 or 95 % of all runs; `rate`, R95 divided by the
time since the start; or a component of the error, whose root mean square over all runs counts (1σ if its mean is zero).
WHEN is a time, `end`, or `run` for every instant of the run; without it, `run`, and `end` for a rate. Of the errors by
a planned path, and of the miss of a waypoint, the size counts that 95 % of all runs do not exceed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

from sinssim.charts import Limit
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.units import ANGLES, LENGTHS, SPEEDS, TIMES

CIRCLES = ("cep", "r95", "rate")
"""Quantities of the horizontal error, whose limits belong to the chart of CEP and R95."""
BY_PATH = ("tse", "nse", "fte", "tse_vertical")
"""Errors of a flight by its planned path."""
MISS = "miss"
"""The distance at which the true path passes a waypoint."""
SHARES = {"cep": 0.5} | dict.fromkeys((*CIRCLES[1:], *BY_PATH, MISS), 0.95)
"""Shares of all runs in the circles, or within the sizes, of these quantities."""
_MOST = ", which 95 % of all runs do not exceed"

QUANTITIES: dict[str, tuple[str, str]] = {
    "cep": ("length", "radius of the circle that contains half of all runs"),
    "r95": ("length", "radius of the circle that contains 95 % of all runs"),
    "rate": ("speed", "R95 divided by the time since the start"),
    "position_north": ("length", "position error to the north"),
    "position_east": ("length", "position error to the east"),
    "position_down": ("length", "height error"),
    "velocity_north": ("speed", "velocity error to the north"),
    "velocity_east": ("speed", "velocity error to the east"),
    "velocity_down": ("speed", "vertical velocity error"),
    "tilt_north": ("angle", "tilt about the north axis"),
    "tilt_east": ("angle", "tilt about the east axis"),
    "heading": ("angle", "heading error"),
    "tse": ("length", f"total system error across the planned path{_MOST}"),
    "nse": ("length", f"navigation system error across the planned path{_MOST}"),
    "fte": ("length", f"flight technical error across the planned path{_MOST}"),
    "tse_vertical": ("length", f"total system error above or below the planned path{_MOST}"),
    MISS: ("length", f"distance at which the true path passes the waypoint{_MOST}"),
}
"""Dimension and meaning of each quantity; a component counts with its root mean square over all runs."""

COMPONENTS = tuple(name for name in QUANTITIES if name not in SHARES)
"""The components, in the order of the navigation errors."""

_UNITS = {"length": LENGTHS, "speed": SPEEDS, "angle": ANGLES}
_PATTERN = re.compile(
    r"\s*(?P<name>\w+)\s*(\((?P<when>[^()]*)\))?\s*(?P<sign>[<>=≤≥]+)\s*"
    r"(?P<number>[-+]?[\d.]+([eE][-+]?\d+)?|\S+)\s*(?P<unit>[^\d\s.].*)?"
)
_FORM = 'write it like "r95(3600 s) <= 1852 m"'

When = Literal["at", "end", "run"]


@dataclass(frozen=True)
class Requirement:
    """One requirement."""

    text: str  # as it was written
    quantity: str  # one of `QUANTITIES`
    when: When  # "at" a time, at the "end", or throughout the "run"
    time: float = field(compare=False)  # the time for "at", s since the start; NaN, unlike itself, for the others
    limit: float  # largest allowed value, SI
    unit: str  # unit as it was written
    place: str = ""  # waypoint of a miss: "waypoint 3", or its name

    @property
    def unit_size(self) -> float:
        """Size of the unit in SI."""
        return _UNITS[QUANTITIES[self.quantity][0]][self.unit]

    @property
    def instant(self) -> str:
        """When it holds, in words."""
        if self.place:
            return f"at {self.place}"
        return {"at": f"at {self.time:g} s", "end": "at the end", "run": "at every time of the run"}[self.when]

    @property
    def meaning(self) -> str:
        """What it says, in words."""
        what = QUANTITIES[self.quantity][1]
        if self.quantity in COMPONENTS:
            what = f"root mean square over all runs of the {what}"
        return f"{what}, {self.instant}, at most {self.limit / self.unit_size:g} {self.unit}"

    def check_within(self, duration: float) -> None:
        """Raise InputError if the time of the requirement lies outside a run of a duration, s."""
        if self.when == "at" and self.time > duration + 1e-6:
            raise InputError(
                f"requirement {self.text!r}: {self.time:g} s lies outside the run, which lasts {duration:g} s; give a "
                "time up to this, or (end)."
            )


def parse_requirement(text: str) -> Requirement:
    """Read a requirement such as "r95(3600 s) <= 1852 m" or "heading(end) <= 0.05 deg"."""
    match = _PATTERN.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise InputError(f"the requirement {shortened(repr(text))} cannot be read; {_FORM}.")
    name, unit, about = match["name"].lower(), (match["unit"] or "").strip(), f"requirement {shortened(repr(text))}"
    if name not in QUANTITIES:
        raise unknown_name("quantity of a requirement", name, QUANTITIES)
    if match["sign"] not in ("<=", "<", "≤"):
        raise InputError(f"{about}: {match['sign']} is not a limit of an error; {_FORM}.")
    try:
        number = float(match["number"])
    except ValueError as error:
        raise InputError(f"{about}: {match['number']!r} is not a number; {_FORM}.") from error
    if not (math.isfinite(number) and number > 0.0):
        raise InputError(f"{about}: the limit {match['number']} must be a positive number.")
    dimension = QUANTITIES[name][0]
    known = _UNITS[dimension]
    if unit not in known:
        other = next((kind for kind, units in _UNITS.items() if unit in units), None)
        what = f"no unit follows the number {match['number']}" if not unit else f"{unit!r} is not a known unit"
        what = f"{unit!r} is a unit of {other}" if other else what
        article = "an" if dimension == "angle" else "a"
        raise InputError(f"{about}: {what}; {name} is {article} {dimension}. Known units: {', '.join(known)}.")
    place = _place(match["when"], about) if name == MISS else ""
    when: When
    when, time = ("end", math.nan) if place else parse_when(match["when"], name, about)
    return Requirement(text.strip(), name, when, time, number * known[unit], unit, place)


def _place(text: str | None, about: str) -> str:
    """Read the waypoint of a miss."""
    place = (text or "").strip()
    if not place:
        raise InputError(f"{about}: a miss is that of a waypoint; write it like miss(waypoint 3), or with its name.")
    return place


def parse_requirements(require: str | Requirement | Iterable[str | Requirement]) -> tuple[Requirement, ...]:
    """Read requirements, or one of them, see `parse_requirement`."""
    several = (require,) if isinstance(require, str | Requirement) else require
    return tuple(
        requirement if isinstance(requirement, Requirement) else parse_requirement(requirement)
        for requirement in several
    )


def parse_when(text: str | None, name: str, about: str) -> tuple[When, float]:
    """Read what stands in the parentheses of a quantity: "at", "end" or "run", and the time for "at", s, else NaN."""
    word = (text or "").strip().lower()
    if not word and text is None:
        return ("end" if name == "rate" else "run"), math.nan
    if word == "end":
        return "end", math.nan
    if word == "run":
        if name == "rate":
            raise InputError(f"{about}: a rate is not limited over the whole run, as it has none at the start; give a "
                             "time or end.")  # fmt: skip
        return "run", math.nan
    match = re.fullmatch(r"([-+.\deE]+)\s*([a-z]*)", word)
    try:
        if match is None:
            raise ValueError
        number = float(match[1])
    except ValueError as error:
        raise InputError(f"{about}: ({text}) is not a time, end or run; {_FORM}.") from error
    if match[2] not in TIMES:
        raise InputError(f"{about}: ({text}) needs a unit of time, one of {', '.join(TIMES)}; {_FORM}.")
    time = number * TIMES[match[2]]
    if not (math.isfinite(time) and time >= 0.0) or (name == "rate" and time == 0.0):
        least = "a positive time" if name == "rate" else "a time from the start on"
        raise InputError(f"{about}: ({text}) must be {least}.")
    return "at", time


_QUANTITY_PATTERN = re.compile(r"\s*(?P<name>\w+)\s*(\((?P<when>[^()]*)\))?\s*")
_SI = {"length": "m", "speed": "mps", "angle": "rad"}


@dataclass(frozen=True)
class Quantity:
    """A quantity at an instant."""

    quantity: str  # one of `QUANTITIES`
    when: When  # "at" a time, at the "end", or the largest throughout the "run"
    time: float = 0.0  # the time for "at", s since the start; 0 for the others
    place: str = ""  # waypoint of a miss

    @property
    def text(self) -> str:
        """As it is written: "r95(3600 s)"."""
        if self.place:
            return f"{self.quantity}({self.place})"
        return f"{self.quantity}({f'{self.time:.10g} s' if self.when == 'at' else self.when})"

    @property
    def dimension(self) -> str:
        """ "length", "speed" or "angle"."""
        return QUANTITIES[self.quantity][0]

    @property
    def instant(self) -> str:
        """When it holds, in words."""
        if self.place:
            return f"at {self.place}"
        largest = "largest of the run"
        return {"at": f"at {self.time:.10g} s", "end": "at the end", "run": largest}[self.when]

    @property
    def column(self) -> str:
        """Name of its column, with the unit: "r95_3600s_m", "heading_end_rad"; rates are in nmi/h."""
        when = f"{self.time:.10g}s" if self.when == "at" else self.when
        when = re.sub(r"\W+", "_", self.place) or when
        return f"{self.quantity}_{when}_{'nmi_h' if self.quantity == 'rate' else _SI[self.dimension]}"


def quantity_of(requirement: Requirement) -> Quantity:
    """Return the quantity of a requirement."""
    time = requirement.time if requirement.when == "at" else 0.0
    return Quantity(requirement.quantity, requirement.when, time, requirement.place)


def parse_quantity(text: str) -> Quantity:
    """Read a quantity such as "r95(3600 s)", "cep(end)" or "heading(run)"; without parentheses
    it is that at the end.
    """
    match = _QUANTITY_PATTERN.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise InputError(
            f'the quantity {shortened(repr(text))} cannot be read; write it like "r95(3600 s)" or "heading(end)".'
        )
    name = match["name"].lower()
    if name not in QUANTITIES:
        raise unknown_name("quantity", name, QUANTITIES)
    if name == MISS:
        return Quantity(name, "end", place=_place(match["when"], f"quantity {shortened(repr(text))}"))
    if match["when"] is None:
        return Quantity(name, "end")
    when, time = parse_when(match["when"], name, f"quantity {shortened(repr(text))}")
    return Quantity(name, when, 0.0 if math.isnan(time) else time)


Judged = Sequence[tuple[Requirement, str]]
"""Requirements with their verdicts: "met", "not met" or "undecided"."""


def limits_of(judged: Judged, quantities: Iterable[str], end: float) -> list[Limit]:
    """Return a mark for each requirement on the quantities that a chart shows, of a run until `end`, s since its start.

    The limit of a rate is the length that it allows at its time.
    """
    chosen, limits = set(quantities), []
    for requirement, verdict in judged:
        if requirement.quantity in chosen:
            at = requirement.time if requirement.when == "at" else end
            height = requirement.limit * at if requirement.quantity == "rate" else requirement.limit
            limits.append(
                Limit(
                    text=requirement.text, verdict=verdict, height=height, at=None if requirement.when == "run" else at
                )
            )
    return limits
