"""The section of a study's report on errors in further coordinates."""

from __future__ import annotations

from collections.abc import Sequence

from sinssim.experiments.studies.naming import labeller
from sinssim.experiments.studies.results import Row, StudyResult
from sinssim.experiments.studies.schema import Part
from sinssim.formatting import capital, number_text
from sinssim.recording.report.page import table, words
from sinssim.scenario.sections.output import COORDINATES
from sinssim.units import ARCSEC

_UNITS = (("_mps", ", m/s", 1.0), ("_rad", ", \u2033", ARCSEC), ("_m", ", m", 1.0))


def coordinate_tables(comparison: StudyResult, part: Part, rows: Sequence[Row]) -> list[str]:
    """Return a table of the largest errors for each kind of coordinates of a part."""
    label, body = labeller(rows, pace=True), []
    for kind in part.coordinates:
        lines, heads = [], []
        for row in rows:
            own = [e for e in comparison.coordinate_errors if e.coordinates == kind and e.case == row.case]
            if not own:
                continue
            shown = [_unit(error.column) for error in own]
            heads = [f"{words(name)}{unit}" for name, unit, _ in shown]
            cells = [number_text(error.max_error / size) for error, (_, _, size) in zip(own, shown, strict=True)]
            lines.append((words(row.motion), words(label(row)), *cells))
        if lines:
            body += [
                f"<h3>Largest errors in the coordinates {words(kind)}</h3>",
                f"<p class=note>{words(capital(COORDINATES[kind]))}. Computed minus true, component by component; the "
                "attitude is the angle of the single rotation between both.</p>",
                table(["motion", "", *heads], lines, 2),
            ]
    return body


def _unit(column: str) -> tuple[str, str, float]:
    """Return a column's name without unit, the unit as shown, and its size in SI."""
    for ending, unit, size in _UNITS:
        if column.endswith(ending):
            return column.removesuffix(ending).replace("_", " "), unit, size
    return column.replace("_", " "), "", 1.0
