"""Requirements on navigation errors as text, their quantities and limits in charts, and verdicts of ensembles on them.

    QUANTITY(WHEN) <= NUMBER UNIT, or miss(WAYPOINT) <= NUMBER UNIT

A quantity is `cep` or `r95`, the radius of the circle that contains 50 or 95 % of all runs; `rate`, R95 divided by the
time since the start; or a component of the error, whose root mean square over all runs counts (1σ if its mean is zero).
WHEN is a time, `end`, or `run` for every instant of the run; without it, `run`, and `end` for a rate. Of the errors by
a planned path, and of the miss of a waypoint, the size counts that 95 % of all runs do not exceed.

The verdict is met, not met, or undecided at 95 % confidence. A circle's requirement says that at least the share p of
all runs lies within the limit. Of N runs, k do, and the exact binomial interval of the share (Clopper and Pearson,
Biometrika 26, 1934, 404) decides: met if it lies above p, not met if it lies below. No distribution of the errors is
assumed. A component's requirement concerns a root mean square σ, whose interval follows from N s²/σ² ~ χ² with N
degrees of freedom, for normal errors.

Throughout a run, the requirement is met if it is met at every instant, each at 95 %. It is not met if it is not met at
one instant, with the probability of error divided by the number of instants.

Several looks at an ensemble that grows until the requirement is decided err more often than one look. Each of L looks
is then given a probability of error of 5 %/L, so that all of them err with at most 5 % (Bonferroni).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.charts import Limit
from sinssim.data import Array
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.statistics.chi_square import root_mean_square_band
from sinssim.statistics.percentiles import percentile
from sinssim.units import ANGLES, LENGTHS, SPEEDS, TIMES, number_text

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


@dataclass(frozen=True)
class Exceeded:
    """The first time at which a limit is exceeded."""

    time: float  # the time, s since the start
    fixes_end: float | None = None
    """Time of the last fix before it, if it lies in an outage, s since the start; None otherwise."""

    @property
    def text(self) -> str:
        """In words: "exceeded from 1319 s, 119 s after the fixes end"."""
        shown = float(round(self.time) if self.time >= 100.0 else f"{self.time:.3g}")
        text = f"exceeded from {shown:.10g} s" if shown else "exceeded from the start"
        if self.fixes_end is None:
            return text
        return f"{text}, {max(shown - self.fixes_end, 0.0):.4g} s after the fixes end"

    @property
    def after_fixes_end(self) -> float | None:
        """How long after the last fix it is, s; None outside an outage."""
        return None if self.fixes_end is None else self.time - self.fixes_end


def first_exceeded(
    requirement: Requirement, time: Array, values: Array, outages: Sequence[tuple[float, float]] = ()
) -> Exceeded | None:
    """Return since when a requirement over the whole run is exceeded; None if it is not, or holds at one time only.

    Values at the instants `time`, (E,) s since the start, are in SI, NaN where unknown; the first time is on the
    straight line between two instants. Outages without fixes have beginning and end, s since the start, and may
    overlap.
    """
    above = np.flatnonzero(values > requirement.limit)
    if requirement.when != "run" or not len(above):
        return None
    first = int(above[0])
    at, value = float(time[first]), float(values[first])
    if first > 0 and np.isfinite(value) and np.isfinite(values[first - 1]):
        before = float(values[first - 1])
        at -= (at - float(time[first - 1])) * (value - requirement.limit) / (value - before)
    ended = [begin for begin, end in outages if begin <= at <= end]
    while ended and (earlier := [begin for begin, end in outages if begin < min(ended) <= end]):
        ended = earlier
    return Exceeded(at, min(ended, default=None))


CONFIDENCE = 0.95
Counts = NDArray[np.signedinteger[Any]]
Word = Literal["met", "not met", "undecided"]


@dataclass(frozen=True)
class VerdictInUnit:
    """A verdict in the unit of the requirement, as files have it."""

    requirement: str  # the requirement as it was written
    verdict: Word  # "met" or "not met"; of an ensemble with 95 % confidence, or "undecided"
    value: float
    limit: float  # value, limit: quantity and limit in the `unit`
    unit: str
    time_s: float  # instant of the value, s since the start
    more_runs: int | None = 0  # about how many more runs would decide; 0 if decided, None if they cannot be counted
    exceeded_from_s: float | None = None
    """Since when the limit is exceeded, throughout a run, s since the start; None if it is not."""
    after_fixes_end_s: float | None = None  # how long after the last fix this is, s; None outside an outage

    @property
    def text(self) -> str:
        """The value, and since when the limit is exceeded, in words; "" if no run has a solution."""
        if math.isnan(self.value):
            return ""
        value = f"{number_text(self.value)} {self.unit}" if math.isfinite(self.value) else "∞"
        text = f"{value} at {self.time_s:g} s"
        if self.exceeded_from_s is None:
            return text
        after = self.after_fixes_end_s
        return f"{text}, {Exceeded(self.exceeded_from_s, None if after is None else self.exceeded_from_s - after).text}"


@dataclass(frozen=True)
class Verdict:
    """The verdict of N runs, or without scatter of a covariance."""

    requirement: Requirement  # the requirement
    verdict: Word  # "met", "not met" or "undecided"
    value: float  # quantity of these runs, SI; of the instant nearest to the limit, throughout a run
    time: float  # that instant, s since the start
    runs: int  # N
    more_runs: int | None
    """About how many more runs decide if the further ones are like these; 0 if decided, None if more runs than can be
    counted.
    """
    exceeded: Exceeded | None = None
    """Since when the quantity of these runs exceeds the limit, throughout a run; None if it does not."""

    @classmethod
    def certain(cls, requirement: Requirement, value: float, time: float, exceeded: Exceeded | None) -> Verdict:
        """Return the verdict on a value that has no scatter, SI."""
        return cls(requirement, "met" if value <= requirement.limit else "not met", value, time, 0, 0, exceeded)

    @property
    def in_unit(self) -> VerdictInUnit:
        """The verdict in the unit of its requirement."""
        requirement, since, size = self.requirement, self.exceeded, self.requirement.unit_size
        return VerdictInUnit(
            requirement.text, self.verdict, self.value / size, requirement.limit / size, requirement.unit, self.time,
            self.more_runs, None if since is None else since.time, None if since is None else since.after_fixes_end,
        )  # fmt: skip


def columns_of(requirement: Requirement) -> tuple[int, ...]:
    """Return the places of the errors that a requirement concerns: 0 and 1 for a circle, else one of `COMPONENTS`."""
    return (0, 1) if requirement.quantity in CIRCLES else (COMPONENTS.index(requirement.quantity),)


def errors_of(errors: Sequence[Array]) -> Array:
    """Return the horizontal distance, or the component, (N, E), of the errors of `columns_of`, (N, E) SI each."""
    return np.asarray(np.hypot(*errors) if len(errors) > 1 else errors[0])


@dataclass(frozen=True)
class Tally:
    """What a requirement needs to know of the errors of N runs at E instants; several are joined by `joined`."""

    value: Array  # percentile, or root mean square, of the runs that count, (E,) SI; NaN where none counts
    count: Counts  # number of runs that count, (E,)
    inside: Counts  # number of runs within the limit, (E,)
    runs: int  # N


def joined(tallies: Sequence[Tally]) -> Tally:
    """Return the tally of all instants of several ones, of the same runs, in the order of the instants."""
    value, count, inside = (
        np.concatenate([getattr(part, name) for part in tallies]) for name in ("value", "count", "inside")
    )
    return Tally(value, count, inside, tallies[0].runs)


def tally(requirement: Requirement, time: Array, errors: Array, counts: NDArray[np.bool_] | None = None) -> Tally:
    """Count how the errors of an ensemble lie to a requirement.

    They are of each run at the instants `time`, (E,) s since the start, in SI, (N, E): the horizontal distance for cep,
    r95 and rate, else the component; NaN or infinite for a failed run, which counts as infinitely far off. A run need
    not count at each instant, (N, E): a shorter one does not after its end.
    """
    instants, values = np.asarray(time, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if values.ndim != 2 or values.shape[1:] != instants.shape or not len(values) or not len(instants):
        raise InputError(
            f"errors have the shape {values.shape}; N runs at {len(instants)} times need (N, {len(instants)})."
        )
    counted = np.ones(values.shape, np.bool_) if counts is None else counts
    distance = np.where(np.isfinite(values), np.abs(values), np.inf)
    distance[~counted] = np.nan
    if requirement.quantity == "rate":
        distance = distance / instants
    count, inside = counted.sum(axis=0), np.count_nonzero(distance <= requirement.limit, axis=0)
    value = np.full(len(instants), np.nan)
    some = count > 0
    if requirement.quantity in SHARES:  # the R95 and CEP that are shown
        value[some] = percentile(distance[:, some], SHARES[requirement.quantity]).value
    else:
        value[some] = np.sqrt(np.nanmean(distance[:, some] ** 2, axis=0))
    return Tally(value, count, inside, len(values))


def verdict_of(
    requirement: Requirement,
    time: Array,
    tallied: Tally,
    error: float = 1.0 - CONFIDENCE,
    outages: Sequence[tuple[float, float]] = (),
) -> Verdict:
    """Judge a requirement by a tally at the instants `time`, (E,) s since the start, with outages."""
    there = tallied.count > 0
    time, runs = time[there], tallied.runs
    if not len(time):
        return Verdict(requirement, "undecided", float("nan"), float("nan"), runs, None)
    value, count, inside = tallied.value[there], tallied.count[there], tallied.inside[there]
    low, high, need = _limits(requirement, value, count, inside, error)
    if len(time) > 1:  # "not met" anywhere needs a smaller probability of error
        low = _limits(requirement, value, count, inside, error / len(time))[0]
    refuted = low > requirement.limit
    exceeded = first_exceeded(requirement, time, value, outages)
    worst = int(np.argmax(value))
    if refuted.any():
        worst = int(np.argmax(np.where(refuted, value, -np.inf)))
        return Verdict(requirement, "not met", float(value[worst]), float(time[worst]), runs, 0, exceeded)
    if (high <= requirement.limit).all():
        return Verdict(requirement, "met", float(value[worst]), float(time[worst]), runs, 0)
    open_ones = high > requirement.limit
    most = float(np.max((need / (count / runs))[open_ones]))
    more = None if not np.isfinite(most) else max(int(np.ceil(most)) - runs, 1)
    return Verdict(requirement, "undecided", float(value[worst]), float(time[worst]), runs, more, exceeded)


def _limits(
    requirement: Requirement, value: Array, count: Counts, inside: Counts, error: float
) -> tuple[Array, Array, Array]:
    """Return lower and upper limit of a quantity as far as they concern the requirement's, and runs needed."""
    if requirement.quantity in SHARES:
        return _share(SHARES[requirement.quantity], count, inside, error)
    return _mean_square(requirement.limit, value, count, error)


def _share(share: float, count: Counts, inside: Counts, error: float) -> tuple[Array, Array, Array]:
    from scipy.special import ndtri
    from scipy.stats import beta

    lowest = np.where(inside > 0, beta.ppf(0.5 * error, np.maximum(inside, 1), count - inside + 1), 0.0)
    highest = np.where(inside < count, beta.ppf(1.0 - 0.5 * error, inside + 1, np.maximum(count - inside, 1)), 1.0)
    # the percentile is at most the limit where the share within the limit is at least p
    high = np.where(lowest >= share, 0.0, np.inf)
    low = np.where(highest < share, np.inf, 0.0)
    off = np.abs(inside / count - share)
    with np.errstate(divide="ignore"):
        need = ndtri(0.5 * error) ** 2 * share * (1.0 - share) / off**2
    least = np.log(0.5 * error) / np.log(share)  # runs, all of which lie inside
    return low, high, np.where(inside == count, least, np.maximum(need, least))


def _mean_square(limit: float, value: Array, count: Counts, error: float) -> tuple[Array, Array, Array]:
    from scipy.special import ndtri

    low, high = root_mean_square_band(value, count, error)
    with np.errstate(divide="ignore"):
        need = 0.5 * (ndtri(0.5 * error) / (value / limit - 1.0)) ** 2
    return low, high, need
