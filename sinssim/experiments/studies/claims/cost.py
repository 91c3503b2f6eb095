"""The computational cost of equal accuracy, and of the matrix B by trigonometric functions."""

from __future__ import annotations

import math
from dataclasses import replace

from sinssim.algorithms import family
from sinssim.experiments.studies.attitude_cost import matrix_costs
from sinssim.experiments.studies.claims.outcome import (
    EULER,
    LOOKS_AHEAD,
    Evidence,
    Outcome,
    Point,
    base,
    by,
    needed,
    of_motion,
    overall,
    undecided,
)
from sinssim.experiments.studies.operations import OF_FUNCTION
from sinssim.experiments.studies.results import Row

_OTHERS = ("direction cosines", "Euler angles")
_FAMILIES = {
    "quaternion": "quaternions",
    "two-quaternions": "quaternions",
    "poisson": _OTHERS[0],
    EULER: _OTHERS[1],
    "rotation-vector": "beyond the chapter, rotation vectors",
}


def cheapest(evidence: Evidence) -> Outcome:
    """Compare families by the operations per second of motion that keep attitude within a few tenths of a minute of
    arc in an hour.

    The chapter's algorithms, which make a step of every sample, decide; rotation vectors of several samples per step
    are listed beside them. The whole navigation decides; the attitude alone is compared, too.

    Returns:
        The outcome, with a verdict on each motion.
    """
    numbers: dict[str, float] = {}
    said = []
    won, margins, alone = [], [], []
    for motion, found in by(evidence.rows, of_motion).items():
        best: dict[str, Row] = {}
        for row in needed(found).values():
            group = _FAMILIES.get(family(row.algorithm))
            if group and (group not in best or _load(row) < _load(best[group])):
                best[group] = row
        chapter = sorted((f for f in best if f in ("quaternions", *_OTHERS)), key=lambda f: _load(best[f]))
        if "quaternions" not in chapter or len(chapter) < 2:
            return undecided("quaternions and another of the chapter's families within 0.3′/h")
        won.append(chapter[0] == "quaternions")
        margins.append(min(_load(best[f]) for f in chapter if f != "quaternions") / _load(best["quaternions"]) - 1.0)
        attitude = _attitude_loads(found)
        others = [load for group, load in attitude.items() if group in _OTHERS]
        if "quaternions" in attitude and others:
            alone.append(min(others) / attitude["quaternions"] - 1.0)
        for group, load in attitude.items():
            numbers[f"{motion}: {group}, attitude alone, 1000 operations/s"] = load / 1e3
        for group, row in best.items():
            numbers[f"{motion}: {group}, 1000 operations/s"] = _load(row) / 1e3
            numbers[f"{motion}: {group}, µs/s"] = row.ns_per_step * row.rate_hz / 1e3
        words = [
            f"{group} {_load(row) / 1e3:.3g} thousand ({row.algorithm} at {row.rate_hz:g} Hz"
            + (", uses later samples)" if base(row.algorithm) in LOOKS_AHEAD else ")")
            for group, row in ((f, best[f]) for f in (*chapter, *(f for f in best if f not in chapter)))
        ]
        said.append(Point(f"{motion}: {', '.join(words)}", "confirmed" if won[-1] else "refuted"))
    if not said:
        return undecided("any result")
    reason = (
        f"Quaternions need the fewest operations on {sum(won)} of {len(won)} motions; the best of the others "
        f"takes {100.0 * min(margins):+.1f} % to {100.0 * max(margins):+.1f} %"
        + (f", of the attitude alone {100.0 * min(alone):+.1f} % to {100.0 * max(alone):+.1f} %" if alone else "")
        + ". Operations of the whole navigation per second of motion, for 0.3′ in an hour; a sine counts as "
        f"{OF_FUNCTION:g}:"
    )
    measured = f"best of the others: {100.0 * min(margins):+.1f} %"
    return Outcome(overall(said), reason, tuple(said), numbers, measured, "more than 0 %")


def trigonometric_matrix() -> Outcome:
    """Compare B by sines and cosines of three angles with B from a quaternion: operations, and time in bulk.

    Returns:
        The outcome. A sine counts as the additions and multiplications of which it consists.
    """
    by_products, by_functions = matrix_costs()
    ratio = by_functions.operations.total / by_products.operations.total
    slower = by_functions.ns / by_products.ns
    if_one = replace(by_functions.operations, function=0.0).total + by_functions.operations.function
    numbers = {
        "quaternion, operations": by_products.operations.total,
        "angles, operations": by_functions.operations.total,
        "angles, operations if a function were one": if_one,
        "quaternion, ns": by_products.ns,
        "angles, ns": by_functions.ns,
    }
    reason = (
        "B from a quaternion takes sums and products only. B from three angles takes six sines and cosines, 14 "
        "multiplications and 4 additions; a sine to rounding takes "
        f"{OF_FUNCTION:g} operations (reduction and a polynomial of degree 15). If a function were one operation, the "
        f"angles would seem to need {if_one:.0f}. One matrix, and its time among many:"
    )
    points = tuple(
        Point(f"{name}: {cost.operations.total:.0f} operations, {cost.ns:.2g} ns", verdict)
        for name, cost, verdict in (
            ("from a quaternion", by_products, ""),
            ("from angles by six functions", by_functions, "confirmed" if min(ratio, slower) > 1.0 else "refuted"),
        )
    )
    measured = f"{ratio:.2g} × operations, {slower:.2g} × time"
    return Outcome(overall(points), reason, points, numbers, measured, "more than 1")


def _load(row: Row) -> float:
    return row.operations_per_step * row.rate_hz


def _attitude_loads(rows: list[Row]) -> dict[str, float]:
    """Return, by family, the least operations per second of the attitude alone that keep it within 0.3′/h."""
    least: dict[str, float] = {}
    for row in needed(rows).values():
        group, load = _FAMILIES.get(family(row.algorithm)), row.attitude_operations_per_step * row.rate_hz
        if group and load < least.get(group, math.inf):
            least[group] = load
    return least
