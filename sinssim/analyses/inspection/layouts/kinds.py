"""Splits a text file whose rows alternate between several units, or between kinds of records, into its parts."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.inspection.layouts.text_table import TextTable

_INSTANCE = re.compile(
    r"^(?:i|inst\w*|id|(?:imu|gps|gnss|sensor|unit|device)[\W_]*(?:id|index|no|nr|number|instance)?)$"
)
_MOST_UNITS = 8
_ALTERNATES = 0.2
"""Least share of rows whose kind is not that of the row before: a status changes a few times in a whole log."""


def split_kinds(table: TextTable) -> tuple[list[TextTable], list[str]]:
    """Split a file by the column that tells kinds of rows or units apart.

    Returns:
        The parts, or the file itself if nothing alternates; of several units the first one; and a sentence on what is
        left out.
    """
    for k, texts in table.kinds.items():
        if _alternates(texts):
            chosen = {str(text): texts == text for text in np.unique(texts) if text}
            return [table.selected(k, text, rows) for text, rows in chosen.items() if rows.sum() > 2], []
    for k, name in enumerate(table.words or ()):
        values = table.values[:, k]
        if not _INSTANCE.match(name.strip().lower()) or not np.isfinite(values).all():
            continue
        units = np.unique(values)
        if 1 < len(units) <= _MOST_UNITS and (units == np.rint(units)).all() and _alternates(values):
            first = table.selected(k, str(int(units[0])), values == units[0])
            words = ", ".join(str(int(unit)) for unit in units)
            text = (
                f"{table.path} contains {len(units)} units ({name} = {words}), of which {name} = {int(units[0])} is "
                "used."
            )
            return [first], [text]
    return [table], []


def _alternates(values: NDArray[Any]) -> bool:
    return len(values) > 3 and float(np.mean(values[1:] != values[:-1])) > _ALTERNATES
