"""What the page of a trade study needs to answer for other sizes of the sources, in all budgets at once.

The covariance is quadratic in the size of a random source and the mean is linear in that of a given one, so that a page
computes the quantities of the cells as exactly as the budgets do.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.experiments.studies.trade_cells import SourceParts, place_name
from sinssim.experiments.studies.trade_result import TradeResult, label_of, unit_for
from sinssim.experiments.studies.trade_schema import TradeStudy
from sinssim.statistics.requirements import SHARES, Quantity, quantity_of
from sinssim.units import KNOT


def asked(study: TradeStudy) -> list[Quantity]:
    """Return the quantities of a study's requirements and figures."""
    return list(dict.fromkeys((*map(quantity_of, study.requirements), *study.drawn)))


def what_if(result: TradeResult) -> tuple[dict[str, Any], list[Array]]:
    """Return what a page needs: plain values, and the parts as arrays, for each cell, source and quantity in order."""
    study, arrays, cells, quantities = result.study, list[Array](), [], asked(result.study)
    known: dict[str, SourceParts] = {}
    budgets = [(cell, cell.numbers) for cell in result.cells if cell.numbers is not None and cell.numbers.sources]
    for cell, numbers in budgets:
        known |= {source.name: source for source in numbers.sources}
        arrays += [np.ravel(source.parts[quantity.text]) for source in numbers.sources for quantity in quantities]
        cells.append(
            {"name": place_name(study, cell.place, titled=False),
             "sources": [[source.name, source.value if math.isfinite(source.value) else None, source.random]
                         for source in numbers.sources],
             "computed": [numbers.values[quantity.column] for quantity in quantities],
             "times": [numbers.instants[quantity.text] for quantity in quantities]}
        )  # fmt: skip
    units = [unit_for(result, quantity) for quantity in quantities]
    plain = {
        "cells": cells, "study": study.name, "seconds": result.seconds / max(result.computed, 1),
        "filter": any("filter_r95_end_m" in numbers.values for _, numbers in budgets),
        "sources": [{"name": name, "label": f"{source.group}: {source.label}", "unit": source.unit, "key": source.key}
                    for name, source in known.items()],
        "quantities": [
            {"label": f"{label_of(quantity)}", "share": SHARES.get(quantity.quantity, 0.0),
             "rate": quantity.quantity == "rate", "unit": unit.name, "size": unit.size,
             "some": quantity.when == "run"}
            for quantity, unit in zip(quantities, units, strict=True)
        ],
        "requirements": [
            {"text": requirement.text, "quantity": quantities.index(quantity_of(requirement)),
             "limit": requirement.limit / (KNOT if requirement.quantity == "rate" else 1.0)}
            for requirement in study.requirements
        ],
    }  # fmt: skip
    return plain, arrays
