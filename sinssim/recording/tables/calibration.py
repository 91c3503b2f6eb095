"""The tables of a calibration on the console."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.calibration.result import CalibrationResult

if TYPE_CHECKING:
    from rich.console import Console

NOT_SEEN = "not observable"


def heads(result: CalibrationResult) -> list[str]:
    """Return the heads of the table of parameters."""
    known = [] if result.truth is None else ["true", "error/σ"]
    return ["parameter", "estimate", "1σ", "unit", "before, 1σ", *known, ""]


def cells(result: CalibrationResult) -> list[list[str]]:
    """Return the rows of the table of parameters, as text."""
    rows = []
    for k, one in enumerate(result.parameters):
        unit, size = one.unit
        seen = bool(result.observable[k])
        row = [one.name, _number(result.values[k] / size) if seen else "–", _number(result.sigma[k] / size), unit]
        row.append(_number(one.size / size))
        if result.truth is not None:
            row += [_number(result.truth[k] / size), f"{(result.values[k] - result.truth[k]) / result.sigma[k]:+.2f}"]
        rows.append([*row, "" if seen else NOT_SEEN])
    return rows


def _number(value: float) -> str:
    return f"{value:.4f}" if abs(value) < 1.0 else f"{value:.3f}" if abs(value) < 1e3 else f"{value:.1f}"


def sentences(result: CalibrationResult) -> list[str]:
    """Return what is said below the table."""
    solution = result.estimate.solution
    found = [f"Misalignments refer to {result.frame}."]
    if result.unobservable:
        found.append(
            "The sequence does not determine the following, which stay 0 in the compensation (factors are in units of "
            f"each error's 1σ before): {'; '.join(result.unobservable)}."
        )
    else:
        found.append("The sequence determines every parameter.")
    found.append(f"Residuals: χ² = {solution.chi_square:.1f} with {solution.degrees} degrees of freedom.")
    total = result.chi_square_of_errors
    if total is not None:
        found.append(f"Errors of the observable parameters: χ² = {total[0]:.1f} with {total[1]} degrees of freedom.")
    return [*found, *result.notes]


def show(result: CalibrationResult, console: Console) -> None:
    """Print a calibration: its parameters, and what the sequence does not determine.

    Args:
        result: the calibration.
        console: the console to print on.
    """
    from rich import box
    from rich.table import Table

    table = Table(
        title=f"{result.scenario.name}: calibration, {result.method} method, {len(result.dwells)} positions",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for name in heads(result):
        table.add_column(name, justify="left" if name in ("parameter", "unit", "") else "right", no_wrap=True)
    for row in cells(result):
        table.add_row(*row)
    console.print(table)
    for sentence in sentences(result):
        console.print(sentence, markup=False)
