"""The table of a one-component run's errors, and the sentences below it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich import box
from rich.table import Table

from sinssim.experiments.run.plane_errors import ROW_NAMES
from sinssim.experiments.run.tables.run_table import error_text
from sinssim.truth.vertical_plane import WAYS

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.experiments.run.result import PlaneRun

_HEADINGS = (
    "position\nfinal, m",
    "\nrms, m",
    "\nmax, m",
    "velocity\nmax, m/s",
    "pitch\nmax, arcmin",
    "difference\nmax, m",
    "\nrelative",
)


def show(run: PlaneRun, console: Console) -> None:
    """Print the errors of the simulation and of the error equations, and the time of each stage.

    Args:
        run: the finished run.
        console: the console to print on.
    """
    scenario, summary = run.scenario, run.summary
    found = summary["one_component"]
    table = Table(
        title=f"{scenario.name}: errors against the truth",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("", no_wrap=True)
    for heading in _HEADINGS:
        table.add_column(heading, justify="right", no_wrap=True)
    for name, errors in found["errors"].items():
        table.add_row(ROW_NAMES[name], *_cells(errors, found["differences"].get(name)))
    if scenario.description:
        console.print(f"{scenario.description}\n", markup=False)
    console.print(table)
    for line in sentences(found):
        console.print(line, markup=False)
    timing = {stage.removesuffix("_s"): seconds for stage, seconds in summary["timing"].items()}
    times = ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in timing.items() if seconds)
    console.print(f"Time: {times}", markup=False)


def sentences(found: Mapping[str, Any]) -> list[str]:
    """Return what the table's rows mean.

    Args:
        found: entry `one_component` of `summary.json`.
    """
    return [
        f"Variant “{found['variant']}”: {WAYS[found['variant']]}. Schuler period "
        f"{found['schuler_period_s'] / 60.0:.2f} min.",
        "Difference: from the simulated error minus that with perfect sensors; relative: its ratio to the largest "
        "value of that error.",
    ]


def _cells(errors: Mapping[str, float | None], difference: Mapping[str, float | None] | None) -> tuple[str, ...]:
    angle = errors["max_pitch_error_arcsec"]
    return (
        error_text(errors["final_position_error_m"]),
        error_text(errors["rms_position_error_m"]),
        error_text(errors["max_position_error_m"]),
        error_text(errors["max_velocity_error_mps"]),
        "–" if angle is None else error_text(angle / 60.0),
        *(("", "") if difference is None else (error_text(difference["max_m"]), _relative(difference["relative"]))),
    )


def _relative(value: float | None) -> str:
    return "–" if value is None else f"{value:.1e}"
