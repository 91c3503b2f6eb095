"""What a budget's page needs to answer "and with half the gyro bias?": the errors by source, with keys and grades.

The covariance is quadratic in the size of a random source and the mean is linear in that of a given one, so that the
page computes circles, shares, ranking and verdicts for other sizes as exactly as the budget does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sinssim.analyses.error_budget.budget_result import Answer, BudgetResult
from sinssim.analyses.error_budget.error_sources import Source
from sinssim.content import list_content
from sinssim.data import Array
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.grades import GRADE_TABLE, find_grade, grade_key, of_grades
from sinssim.statistics.requirements import COMPONENTS, SHARES

_NO_ERRORS = ("correlation_time", "limit")
"""Terms of a grade that are no error by themselves."""
_TERMS = {term.name: term for term in TERMS}
_OMITTED = (
    "Linear theory leaves out products of errors, limits of the sensors, the gate of a filter and failures; "
    "docs/budgets.md lists them. A source that one run gives, or that no number describes, stays as it is."
)
_OF_FILTER = (
    "The gains of the filter stay those of this budget. The command lets the filter know the change: it then performs "
    "as well or better. It propagates the filter's covariance anew, which takes as long as this budget did."
)


def what_if(
    result: BudgetResult, answers: Sequence[Answer], times: Sequence[float]
) -> tuple[dict[str, Any], list[Array]]:
    """Return what a page needs to answer for other sizes of the sources: plain values, and arrays in their order.

    The arrays are the times, s, and for each source its horizontal covariance (north, north with east, east) and mean
    at them; the squares of all components, or their means, at the rows of the table; and for each requirement on a
    component the squares of the random sources and the means of the others at its rows.
    """
    rows = result.table_rows(times)
    arrays: list[Array] = [result.time]
    for source in result.sources:
        covariance, mean = result.covariance.get(source.name), result.mean.get(source.name)
        if covariance is not None:
            arrays += [covariance[:, 0, 0], covariance[:, 0, 1], covariance[:, 1, 1]]
            arrays.append(np.einsum("kii->ki", covariance)[rows].ravel())
        else:
            mean = np.zeros((len(result.time), 9)) if mean is None else mean
            arrays += [mean[:, 0], mean[:, 1], np.empty(0), mean[rows].ravel()]
    requirements = []
    for answer in answers:
        requirement = answer.requirement
        at = {"run": range(len(result.time)), "end": [len(result.time) - 1]}.get(requirement.when)
        at = [result.row(requirement.time)] if at is None else list(at)
        component = COMPONENTS.index(requirement.quantity) if requirement.quantity in COMPONENTS else -1
        requirements.append(
            {"text": requirement.text, "share": SHARES.get(requirement.quantity, 0.0), "limit": requirement.limit,
             "rate": requirement.quantity == "rate", "unit": requirement.unit, "size": requirement.unit_size,
             "rows": at, "component": component}
        )  # fmt: skip
        arrays += [] if component < 0 else [_component(result, source, component)[at] for source in result.sources]
    plain = {
        "sources": [_plain(result, source) for source in result.sources],
        "requirements": requirements,
        "rows": rows,
        "ranked": [result.row(t) for t in result.instants_to_rank],
        "options": ["--inertial"] if result.solution == "inertial" and result.scenario.filter is not None else [],
        "title": result.scenario.name,
        "grades": _grades(result.sources),
        "rest": _rest(result),
        "notes": [_OMITTED, *([_OF_FILTER] if result.solution == "filter" else [])],
    }
    return plain, arrays


def _component(result: BudgetResult, source: Source, k: int) -> Array:
    if source.name in result.covariance:
        return result.covariance[source.name][:, k, k]
    return result.mean.get(source.name, np.zeros((len(result.time), 9)))[:, k]


def _plain(result: BudgetResult, source: Source) -> dict[str, Any]:
    term = _TERMS.get(source.name)
    return {
        "name": source.name, "label": source.label, "group": source.group.replace("_", " "), "unit": source.unit,
        "value": source.value if source.kind != "one run" and math.isfinite(source.value) else None,
        "random": source.name in result.covariance, "key": source.key, "values": source.values,
        "grade": grade_key(term) if term and of_grades(term) and source.key.startswith("imu.") else "",
    }  # fmt: skip


def _grades(sources: Sequence[Source]) -> dict[str, Any]:
    """Return for each shipped grade the values of the sources that it has, by their names, in their units, and what
    else it has."""
    terms = [_TERMS[source.name] for source in sources if source.name in _TERMS and source.key.startswith("imu.")]
    grades: Mapping[str, Any] = {
        name: find_grade(name) for name in (*GRADE_TABLE, *list_content("grades", packages=False))
    }
    errors = [term for term in TERMS if of_grades(term) and term not in terms and term.field not in _NO_ERRORS]
    return {
        name: {
            "values": {term.name: float(f"{getattr(grade, term.triad).of(term) / term.unit:.12g}") for term in terms},
            "more": [term.name for term in errors if getattr(grade, term.triad).of(term)],
        }
        for name, grade in (grades.items() if terms else ())
    }


def _rest(result: BudgetResult) -> dict[str, float]:
    """Return the values of a grade's file that are no sources here, such as ranges and correlation times, by key."""
    if not any(source.key.startswith("imu.") for source in result.sources):
        return {}
    names, rest = {source.name for source in result.sources if source.key.startswith("imu.")}, {}
    for term in TERMS:
        if not of_grades(term) or term.name in names:
            continue
        mean, sigma = result.scenario.imu.stated(term)
        value = float(np.max(sigma if term.drawn else mean))
        if math.isfinite(value) and value not in (0.0, term.without):
            rest[grade_key(term)] = float(f"{value / term.unit:.12g}")
    return rest
