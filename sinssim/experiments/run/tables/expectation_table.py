"""The tables of a sensor grade: its error terms, and the position error that each causes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sinssim.scenario.notes import keys_without_effect
from sinssim.sensors.expectation import ASSUMPTIONS, Expectation
from sinssim.sensors.imu.grades import find_grade, grade_name
from sinssim.units import DEG, NAUTICAL_MILE

if TYPE_CHECKING:
    from rich.console import Console

CIRCULAR = 0.8326
"""Ratio of the radius that holds half of all errors to their rms, √(ln 2), for equal normal north and east errors."""
_LINEAR = 5e5
"""Position error beyond which the linear theory does not hold, m."""


def to_json(expectation: Expectation) -> dict[str, Any]:
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


def show(expectation: Expectation, console: Console) -> None:
    """Print the error terms and the position error that each causes."""
    from rich import box
    from rich.table import Table

    e = expectation
    grade = find_grade(e.imu.grade)
    console.print(f"{grade_name(e.imu.grade)}: {grade.description}", markup=False)
    console.print(f"Source: {grade.source}\n", markup=False)
    if not e.terms:
        console.print("The sensors have no errors.")
        return
    terms = Table(title="Value (1σ)", title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading, justify in (("term", "left"), ("value", "right"), ("", "left"), ("SI", "right"), ("", "left")):
        terms.add_column(heading, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    terms.add_column("is")
    for term in e.terms:
        terms.add_row(
            term.name, _number(term.value), term.unit, f"{term.si:.4g}", term.si_unit.removeprefix("1"), term.meaning
        )
    console.print(terms)
    hours = e.duration / 3600.0
    sums = Table(
        title=f"Horizontal position error that each alone causes in {hours:g} h, latitude {e.latitude / DEG:g}°",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    sums.add_column("m (1σ)", justify="right", no_wrap=True)
    sums.add_column("nmi", justify="right", no_wrap=True)
    sums.add_column("from", no_wrap=True)
    sums.add_column("vehicle", no_wrap=True)
    for c in e.contributions:
        sums.add_row(*_position(c.position), c.term, c.assumes)
    sums.add_section()
    sums.add_row(*_position(e.total), "total", "")
    console.print(sums)
    assumed = dict.fromkeys(c.assumes for c in e.contributions)
    console.print("Vehicle: " + "; ".join(f"{name}, {ASSUMPTIONS[name]}" for name in assumed) + ".")
    console.print("All together: root of the sum of squares.")
    if e.total > _LINEAR:
        console.print(f"The linear theory is not valid beyond {_LINEAR / 1e3:g} km: the position is lost.")
    elif e.total and e.drawn:
        console.print(
            f"Half of all runs end within {CIRCULAR * e.total / NAUTICAL_MILE / hours:.2f} nmi per hour, which is "
            "called the class of a unit."
        )
    for sentence in keys_without_effect(e.imu, e.duration):
        console.print(sentence)
    if e.height:
        away = f"{_digits(e.height)} m" if e.height < _LINEAR else f"more than {_LINEAR / 1e3:g} km"
        console.print(
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
