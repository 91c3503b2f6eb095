"""The table of a run's errors, and the sentences below it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich import box
from rich.table import Table as RichTable

from sinssim.exhibits import Table
from sinssim.experiments.run.store.summaries.filter_summary import sentences
from sinssim.recording.console import show_items
from sinssim.recording.store.summary import flagged_words
from sinssim.scenario.height import height_words
from sinssim.scenario.notes import (
    coarse_rates,
    defaults_taken,
    earth_of_the_navigator,
    keys_without_effect,
    torquer_taken,
)

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.experiments.run.result import Run

_HEADINGS = (
    "horizontal\nfinal, m",
    "\nrms, m",
    "\nmax, m",
    "height\nmax, m",
    "velocity\nmax, m/s",
    "attitude\nmax, arcmin",
)


def show(run: Run, console: Console) -> None:
    """Print each algorithm's errors, what only some runs have, remarks, and the time of each stage."""
    scenario, summary = run.scenario, run.summary
    failures, of_filter = summary["failures"], summary.get("filter", {})
    aided = {name: of_filter[name] for name in ("aided", "backward", "smoothed") if of_filter.get(name)}
    table = RichTable(
        title=f"{scenario.name}: {_title(summary)}",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("algorithm", no_wrap=True)
    for heading in _HEADINGS:
        table.add_column(heading, justify="right", no_wrap=True)
    for name, errors in {**summary["algorithms"], **aided}.items():
        table.add_row(name, *_cells(errors, failed=name in failures))
    numbers = {name: errors for name, errors in summary["algorithms"].items() if name not in failures}
    of_parts = [item for part in run.parts.values() for item in part.brief(numbers)]
    of_log = summary.get("log")
    lines = [
        *summary.get("not_attained", ()),
        *([] if of_log is not None else [f"Height of the inertial solutions: {height_words(scenario)}."]),
        *earth_of_the_navigator(scenario),
        *torquer_taken(scenario),
        *coarse_rates(scenario.imu),
    ]
    samples = round((summary["end_s"] - summary["start_s"]) * scenario.imu.rate_hz)
    if flags := flagged_words(summary["flagged_samples"], samples):
        lines.append(flags)
    if of_log is None:
        lines += keys_without_effect(scenario.imu, summary["end_s"])
    lines += defaults_taken(scenario.imu, summary["end_s"])
    lines += [f"{name} has no result: {failure['text']}" for name, failure in failures.items()]
    lines += [event["text"] for events in summary["singularities"].values() for event in events]
    if of_filter:
        lines += sentences(of_filter)
    timing = {stage.removesuffix("_s"): seconds for stage, seconds in summary["timing"].items()}
    lines.append("Time: " + ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in timing.items() if seconds))
    if scenario.description:
        console.print(f"{scenario.description}\n", markup=False)
    console.print(table)
    show_items((item for item in of_parts if isinstance(item, Table)), console)
    show_items((item for item in of_parts if not isinstance(item, Table)), console)
    for line in lines:
        console.print(line, markup=False)


def _title(summary: Mapping[str, Any]) -> str:
    """Return what the table shows."""
    about = summary.get("log")
    if about is None:
        return "errors against the truth"
    if about["reference_file"] is not None:
        return f"errors against the reference {about['reference_file']}"
    return f"differences from {about['compared_with']}" if about["compared_with"] else "one solution, no reference"


def _cells(errors: Mapping[str, float | None], failed: bool) -> tuple[str, ...]:
    """Return the cells of one algorithm; if it failed, its numbers end at the failure."""
    angle = errors["max_attitude_error_arcsec"]
    return (
        error_text(errors["final_horizontal_error_m"]),
        error_text(errors["rms_horizontal_error_m"]),
        error_text(errors["max_horizontal_error_m"]),
        error_text(errors["max_height_error_m"]),
        error_text(errors["max_velocity_error_mps"]),
        "–" if failed or angle is None else error_text(angle / 60.0),
    )


def error_text(value: float | None) -> str:
    """Write a number with four significant digits, without an exponent where possible.

    Args:
        value: the number; None if unknown.

    Returns:
        For example "0.01235", "123457", "1.2e-07", or "–" for None.
    """
    if value is None:
        return "–"
    if value == 0.0:
        return "0"
    if not math.isfinite(value) or not 1e-4 <= abs(value) < 1e9:
        return f"{value:.1e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"
