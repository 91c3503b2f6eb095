"""The errors that a grade of sensors leads one to expect: its terms, and the position error that each causes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sinssim.exhibits import Column, Item, Sentence, Table
from sinssim.scenario.notes import keys_without_effect
from sinssim.sensors.error_propagation import ASSUMPTIONS, Expectation
from sinssim.sensors.imu.grades import find_grade, grade_name
from sinssim.units import DEG, NAUTICAL_MILE

CIRCULAR = 0.8326
"""Ratio of the radius that holds half of all errors to their rms, √(ln 2), for equal normal north and east errors."""
_LINEAR = 5e5
"""Position error beyond which the linear theory does not hold, m."""


def expectation_numbers(expectation: Expectation) -> dict[str, Any]:
    """Return the expectation as plain numbers with units in the names."""
    e = expectation
    grade = find_grade(e.imu.grade)
    return {
        "grade": e.imu.grade,
        "description": grade.description,
        "source": grade.source,
        "latitude_deg": e.latitude / DEG,
        "duration_s": e.duration,
        "terms": [vars(term) for term in e.terms],
        "contributions": [{"term": c.term, "assumes": c.assumes, "position_m": c.position} for c in e.contributions],
        "root_sum_square_m": e.total,
        "root_sum_square_nmi": e.total / NAUTICAL_MILE,
        "circular_error_probable_nmi": CIRCULAR * e.total / NAUTICAL_MILE if e.drawn else None,
        "unaided_height_from_accelerometer_bias_m": e.height,
        "linear": e.total < _LINEAR,
    }


def expectation_exhibits(expectation: Expectation) -> Iterator[Item]:
    """Yield the error terms, and the position error that each causes."""
    e = expectation
    grade = find_grade(e.imu.grade)
    yield Sentence(f"{grade_name(e.imu.grade)}: {grade.description}")
    yield Sentence(f"Source: {grade.source}\n")
    if not e.terms:
        yield Sentence("The sensors have no errors.")
        return
    heads = (Column("term", words=True), Column("value"), Column("", words=True), Column("SI"), Column("", words=True),
             Column("is", words=True))  # fmt: skip
    terms = [(t.name, _number(t.value), t.unit, f"{t.si:.4g}", t.si_unit.removeprefix("1"), t.meaning) for t in e.terms]
    yield Table(heads, terms, title="Value (1σ)")
    hours = e.duration / 3600.0
    columns = (Column("m (1σ)"), Column("nmi"), Column("from", words=True), Column("vehicle", words=True))
    causes = [(*_position(c.position), c.term, c.assumes) for c in e.contributions]
    title = f"Horizontal position error that each alone causes in {hours:g} h, latitude {e.latitude / DEG:g}°"
    yield Table(columns, [*causes, (*_position(e.total), "total", "")], title=title)
    assumed = dict.fromkeys(c.assumes for c in e.contributions)
    yield Sentence("Vehicle: " + "; ".join(f"{name}, {ASSUMPTIONS[name]}" for name in assumed) + ".")
    yield Sentence("All together: root of the sum of squares.")
    if e.total > _LINEAR:
        yield Sentence(f"The linear theory is not valid beyond {_LINEAR / 1e3:g} km: the position is lost.")
    elif e.total and e.drawn:
        yield Sentence(
            f"Half of all runs end within {CIRCULAR * e.total / NAUTICAL_MILE / hours:.2f} nmi per hour, which is "
            "called the class of a unit."
        )
    yield from map(Sentence, keys_without_effect(e.imu, e.duration))
    if e.height:
        away = f"{_digits(e.height)} m" if e.height < _LINEAR else f"more than {_LINEAR / 1e3:g} km"
        yield Sentence(
            f"Height is not included: unaided, its error grows to {away} in {hours:g} h for the bias of the down "
            "accelerometer alone."
        )


def _number(value: float) -> str:
    """Write four digits, without a power of ten where it is not customary."""
    return f"{value:.0f}" if 1e4 <= value < 1e7 else f"{value:.4g}"


def _position(error: float) -> tuple[str, str]:
    """Write a position error in metres and nautical miles."""
    beyond = "> " if error > _LINEAR else ""
    error = min(error, _LINEAR)
    return beyond + _digits(error), beyond + _digits(error / NAUTICAL_MILE)


def _digits(value: float) -> str:
    """Write a number with three or four significant digits and no more."""
    rounded = float(f"{value:.4g}")
    decimals = sum(rounded < limit for limit in (100.0, 10.0, 1.0))
    return f"{rounded:,.{decimals}f}"
