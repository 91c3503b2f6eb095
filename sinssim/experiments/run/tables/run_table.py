"""The table of a run's errors, and the sentences below it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from rich import box
from rich.table import Table

from sinssim.experiments.run.store.summaries.comparison_summary import comparison_sentences
from sinssim.experiments.run.store.summaries.filter_summary import sentences
from sinssim.experiments.run.store.summaries.log_summary import compared_words, outage_sentence
from sinssim.experiments.run.store.summaries.phase_summary import (
    HEADS,
    NOTE,
    SOURCE_HEADS,
    SOURCE_NOTE,
    phase_tables,
    source_tables,
)
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

    from sinssim.scenario import Scenario

_LISTED_OUTAGES = 15
"""Number of outages up to which each has a row; the report has the rows of all."""
_HEADINGS = (
    "horizontal\nfinal, m",
    "\nrms, m",
    "\nmax, m",
    "height\nmax, m",
    "velocity\nmax, m/s",
    "attitude\nmax, arcmin",
)


def show(scenario: Scenario, summary: Mapping[str, Any], console: Console) -> None:
    """Print each algorithm's errors, remarks on the run, and the time of each stage.

    Args:
        scenario: the scenario.
        summary: contents of `summary.json`.
        console: the console to print on.
    """
    failures, of_filter = summary["failures"], summary.get("filter", {})
    aided = {name: of_filter[name] for name in ("aided", "backward", "smoothed") if of_filter.get(name)}
    table = Table(
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
    of_log = summary.get("log")
    lines = [
        *summary.get("not_attained", ()),
        *_about_track(scenario),
        *([] if of_log is None else [*of_log["notes"], compared_words(of_log)]),
        *([] if of_log is not None else [f"Height of the inertial solutions: {height_words(scenario)}."]),
        *earth_of_the_navigator(scenario),
        *torquer_taken(scenario),
        *coarse_rates(scenario.imu),
    ]
    samples = round((summary["end_s"] - summary["start_s"]) * scenario.imu.rate_hz)
    if flags := flagged_words(summary["flagged_samples"], samples):
        lines.append(flags)
    lines += comparison_sentences(summary)
    if of_log is None:
        lines += keys_without_effect(scenario.imu, summary["end_s"])
    lines += defaults_taken(scenario.imu, summary["end_s"])
    lines += [f"{name} has no result: {failure['text']}" for name, failure in failures.items()]
    lines += [event["text"] for events in summary["singularities"].values() for event in events]
    if of_filter:
        lines += sentences(of_filter)
    if "outages" in summary:
        lines += outage_sentence(summary["outages"])
    timing = {stage.removesuffix("_s"): seconds for stage, seconds in summary["timing"].items()}
    lines.append("Time: " + ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in timing.items() if seconds))
    if scenario.description:
        console.print(f"{scenario.description}\n", markup=False)
    console.print(table)
    if summary.get("outages", {}).get("each"):
        console.print(_outage_table(summary["outages"]))
    for name, rows in phase_tables(summary):
        console.print(_phase_table(name, rows))
    for name, found in source_tables(summary):
        if isinstance(found, str):
            lines.insert(0, f"{name}: the sources of the phases' errors are unknown (no budget). {found}")
        else:
            console.print(_source_table(name, found))
    if any("sources" in row for rows in summary.get("phases", {}).values() for row in rows):
        lines.insert(0, SOURCE_NOTE)
    if summary.get("phases"):
        lines.insert(0, NOTE)
    for line in lines:
        console.print(line, markup=False)


def _about_track(scenario: Scenario) -> Iterator[str]:
    """Yield how a track's curve fits its samples, and what is assumed."""
    if scenario.track is not None:
        from sinssim.truth.track.fit import fit_sentences

        yield from fit_sentences(scenario.track.prepared(scenario.truth).fit)


def _title(summary: Mapping[str, Any]) -> str:
    """Return what the table shows."""
    about = summary.get("log")
    if about is None:
        return "errors against the truth"
    if about["reference_file"] is not None:
        return f"errors against the reference {about['reference_file']}"
    return f"differences from {about['compared_with']}" if about["compared_with"] else "one solution, no reference"


def _outage_table(numbers: Mapping[str, Any]) -> Table:
    """Return the table of the errors at the end of each outage."""
    table = Table(
        title=f"{len(numbers['each'])} outages: errors at the end, against {numbers['against']}",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    keys = {
        "horizontal_error_m": "horizontal, m",
        "horizontal_sigma_m": "its 1σ, m",
        "height_error_m": "height, m",
        "velocity_error_mps": "velocity, m/s",
        "smoothed_max_horizontal_error_m": "smoothed, max, m",
    }
    keys = {key: head for key, head in keys.items() if key in numbers["median"]}
    table.add_column("from … to, s", no_wrap=True)
    for head in keys.values():
        table.add_column(head, justify="right", no_wrap=True)
    if len(numbers["each"]) <= _LISTED_OUTAGES:
        for one in numbers["each"]:
            table.add_row(f"{one['from_s']:g} … {one['to_s']:g}", *(error_text(one[key]) for key in keys))
    for word, name in (("median", "median"), ("90 %", "p90")):
        table.add_row(word, *(error_text(numbers[name][key]) for key in keys))
    return table


def _phase_table(name: str, rows: Iterable[tuple[str, ...]]) -> Table:
    """Return the table of what each phase of a mission added to the errors of a solution."""
    table = Table(
        title=f"{name}: what each phase added", title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    table.add_column("phase", no_wrap=True)
    table.add_column("from … to\ns", justify="right", no_wrap=True)
    for what, unit in HEADS.values():
        table.add_column(f"{what}\n{unit}", justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    return table


def _source_table(name: str, rows: Iterable[tuple[str, ...]]) -> Table:
    """Return the table of the sources of what each phase added."""
    table = Table(
        title=f"{name}: sources of what each phase added, 1σ of all runs", title_justify="left", box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )  # fmt: skip
    table.add_column("phase", no_wrap=True)
    for what in SOURCE_HEADS:
        table.add_column(what)
    for row in rows:
        table.add_row(*row)
    return table


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
