"""The tables of a calibration on the console."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.analyses.calibration.result import CalibrationResult
from sinssim.formatting import number_text

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
        seen, sigma = bool(result.observable[k]), float(result.sigma[k]) / size
        row = [one.name, _like(result.values[k] / size, sigma) if seen else "–", number_text(sigma), unit]
        row.append(number_text(one.size / size))
        if result.truth is not None:
            off = (result.values[k] - result.truth[k]) / result.sigma[k]
            row += [_like(result.truth[k] / size, sigma), f"{off:+.2f}".replace("-", "−")]
        rows.append([*row, "" if seen else NOT_SEEN])
    return rows


def _like(value: float, sigma: float) -> str:
    """Write a value with as many decimals as its 1σ has with three significant digits."""
    decimals = len(number_text(sigma).partition(".")[2]) if 1e-4 <= sigma < 1e6 else 4
    return f"{value:.{decimals}f}".replace("-", "−")


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
