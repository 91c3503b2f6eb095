"""The report of finished runs beside each other: table, errors on common axes, keys that differ."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sinssim.data import NavState
from sinssim.earth.models import ellipsoid_by_name
from sinssim.experiments.run.finished.compared_runs import ComparedRuns
from sinssim.experiments.run.report.errors import error_plots, error_tables
from sinssim.experiments.run.report.run_report import STYLE, schuler_period
from sinssim.recording import style
from sinssim.recording.report import page, plot
from sinssim.recording.report.page import swatch, table, words
from sinssim.scales import duration_words

_MOST_KEYS = 60


def compare_runs_report(compared: ComparedRuns) -> str:
    """Return the report."""
    start, end = compared.span
    title = "Comparison of " + ", ".join(compared.runs)
    body = [f"<h1>{words(title)}</h1>"]
    note = " A run that is longer is cut to it." if compared.is_cut else ""
    body.append(
        f"<p>Errors from {start:g} s to {end:g} s ({duration_words(end - start)}), which all runs have.{note}</p>"
    )
    body += ["<h2>Runs</h2>", _runs(compared), "<h2>Errors</h2>"]
    body += error_tables(compared.numbers, "comparison.json; all samples: sinssim.load_streams of each run")
    body += ["<h2>Errors over time</h2>", *error_plots(compared, _period(compared), apart=False)]
    body += ["<h2>What differs in the scenarios</h2>", *_differences(compared)]
    return page.page(title, body, STYLE + plot.STYLE)


def _runs(compared: ComparedRuns) -> str:
    """Return the table of the runs: scenario, solution, times, date."""
    colors = dict(zip(compared.runs, map(style.css, style.colors(list(compared.runs))), strict=True))
    lines = []
    for label, run in compared.runs.items():
        time = compared.errors[label].time
        cells = (words(str(run.summary["scenario"])), words(compared.solutions[label]))
        lines.append(
            (
                swatch(colors[label]) + words(label),
                *cells,
                words(run.status),
                f"{run.date:%Y-%m-%d %H:%M}",
                str(run.summary.get("seed", "–")),
                f"{time[0]:g} … {time[-1]:g}",
            )
        )
    return table(("run", "scenario", "solution", "status", "date", "seed", "time [s]"), lines, 5)


def _period(compared: ComparedRuns) -> float:
    """Return Schuler's period at the place of the first run, s."""
    run = next(iter(compared.runs.values()))
    latitude, height = run.place()
    ellipsoid = str(run.scenario.get("truth", {}).get("ellipsoid", "wgs84"))
    state = NavState(latitude, np.zeros(1), height, np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]))
    return schuler_period(state, ellipsoid_by_name(ellipsoid))


def _differences(compared: ComparedRuns) -> Iterator[str]:
    """Yield the table of the keys that differ."""
    rows = compared.differences
    if not rows:
        yield "<p>The scenarios are the same.</p>"
        return
    lines = [
        (words(key), *(f'<td class="text">{words(value)}</td>' for value in values))
        for key, values in list(rows.items())[:_MOST_KEYS]
    ]
    yield table(("key", *(f'<th class="name">{words(label)}</th>' for label in compared.runs)), lines)
    if len(rows) > _MOST_KEYS:
        yield f'<p class="note">And {len(rows) - _MOST_KEYS} more; comparison.json has all of them.</p>'
