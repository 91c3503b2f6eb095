"""The Rerun recording of an ensemble: the cloud of positions over time, growth of CEP and R95, σ by component."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from sinssim.data import Array
from sinssim.experiments.ensembles.ensemble_figure import judged_of
from sinssim.experiments.ensembles.ensemble_report import opening, regulation, with_band
from sinssim.experiments.ensembles.run_errors import COMPONENTS, VECTORS
from sinssim.recording import style
from sinssim.recording.figures.limits import CIRCLES, of_quantities
from sinssim.recording.rerun.limits import record_limits
from sinssim.recording.rerun.rrd import Recording
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.recording.scales import Rows, thinned
from sinssim.scales import ANGLES, LENGTHS, SPEEDS, suiting
from sinssim.statistics.order_statistics import Percentile
from sinssim.statistics.requirements.requirement import COMPONENTS as QUANTITIES

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.result import EnsembleResult

_FRAMES, _DOTS = 200, 2000
"""Most instants and runs of the cloud of positions."""
_ROOT = "ensemble"


def record(result: EnsembleResult, numbers: Mapping[str, Any], path: Path) -> None:
    """Write the recording.

    Args:
        result: the ensemble.
        numbers: its numbers, from `ensemble_numbers`.
        path: the file.

    Raises:
        OSError: it cannot be written.
    """
    time = result.time
    labels = {"kind": "ensemble", "runs": str(len(result)), "filter": "yes" if result.nees else ""}
    name = f"{result.plan.scenario.name} ensemble"  # the viewer keeps a layout for each name
    run = RunInfo(name, float(time[0]), float(time[-1]), (result.plan.solution,), labels=labels)
    with Recording(path, run.application, all_views(run)) as recording:
        labels = labels | _draw_growth(recording, result) | _draw_components(recording, result)
        if result.nees:
            _draw_consistency(recording, result)
        recording.document("about/summary", _markdown(result, numbers))
        recording.document("about/scenario", f"```toml\n{result.plan.scenario.to_toml()}\n```")
        run = replace(run, labels=labels, ranges=dict(recording.ranges))
        recording.document(RUN_ENTITY, run.to_json())
        recording.blueprint(all_views(run))


def _draw_growth(recording: Recording, result: EnsembleResult) -> dict[str, str]:
    """Record CEP and R95 with their bands, and the cloud of positions; return the unit."""
    drawn = {"cep": result.cep, "r95": result.r95}
    unit, size = suiting(LENGTHS, *(v.value[np.isfinite(v.value)] for v in drawn.values()))
    names, values, colors, widths = [], [], [], []
    for key, found in drawn.items():
        color = style.COLORS[key]
        for name, rows, width in (
            (key.upper(), found.value, 2.2), (f"{key.upper()}, low", found.low, 0.8),
            (f"{key.upper()}, high", found.high, 0.8),
        ):  # fmt: skip
            names.append(name)
            values.append(np.where(np.isfinite(rows), rows, np.nan) / size)
            colors.append(color if width > 1.0 else style.tint(color))
            widths.append(width)
    if np.isfinite(values).any():
        recording.series(f"{_ROOT}/growth", result.time, np.stack(values, 1), names, colors=colors, widths=widths)
        most = float(np.nanmax(values)) * size
        _draw_limits(recording, result, f"{_ROOT}/growth", CIRCLES, size, most)
    _draw_cloud(recording, result, drawn, size)
    return {"position": unit}


def _draw_cloud(recording: Recording, result: EnsembleResult, circles: Mapping[str, Percentile], size: float) -> None:
    rows = thinned(len(result.time), _FRAMES)
    runs = np.flatnonzero(~result.failed)[:_DOTS]
    north, east = (_taken(result, name, runs, rows) / size for name in COMPONENTS[:2])
    entity = f"{_ROOT}/cloud"
    # the picture's y axis points down
    points = np.stack((east, -north), axis=-1).transpose(1, 0, 2)
    dots = rr.Points2D.from_fields(radii=rr.Radius.ui_points(1.6), colors=[style.COLORS["run"]])
    recording.static(f"{entity}/runs", dots)
    there = [frame[np.isfinite(frame).all(axis=1)] for frame in points]
    recording.columns(
        f"{entity}/runs", result.time[rows],
        rr.Points2D.columns(positions=np.concatenate(there)).partition([len(frame) for frame in there]),
    )  # fmt: skip
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    ring = np.column_stack((np.sin(angle), np.cos(angle)))
    for key, found in circles.items():
        radius = np.nan_to_num(found.value[rows] / size, nan=0.0, posinf=0.0)
        strips = [r * ring for r in radius]
        style_of = rr.LineStrips2D.from_fields(radii=rr.Radius.ui_points(1.2), colors=[style.COLORS[key]])
        recording.static(f"{entity}/{key}", style_of)
        recording.columns(f"{entity}/{key}", result.time[rows], rr.LineStrips2D.columns(strips=strips))
    reach = max((float(np.abs(frame).max(initial=0.0)) for frame in there), default=1.0) or 1.0
    cross = [np.array([[-reach, 0.0], [reach, 0.0]]), np.array([[0.0, -reach], [0.0, reach]])]
    grey = style.COLORS["ground"]
    recording.static(f"{entity}/axes", rr.LineStrips2D(cross, radii=rr.Radius.ui_points(0.5), colors=grey))
    recording.static(
        f"{entity}/words",
        rr.Points2D([[0.0, -1.05 * reach], [1.05 * reach, 0.0]], labels=["north", "east"], colors=grey,
                    radii=rr.Radius.ui_points(0.1), show_labels=True),
    )  # fmt: skip


def _taken(result: EnsembleResult, name: str, runs: Rows, rows: Rows) -> Array:
    """Return some runs of a column at some epochs."""
    parts, first = [], slice(0, int(runs.max(initial=-1)) + 1)
    for epochs in result.errors.spans():
        there = rows[(rows >= epochs.start) & (rows < epochs.stop)] - epochs.start
        parts.append(result.errors.column(name, epochs, first)[np.ix_(runs, there)])
    return np.concatenate(parts, axis=1)


def _draw_components(recording: Recording, result: EnsembleResult) -> dict[str, str]:
    """Record σ over the runs by component; return the units."""
    labels = {}
    axes = ["north", "east", "down"]
    for quantity, scale, key in zip(
        VECTORS, (LENGTHS, SPEEDS, ANGLES), ("position", "velocity", "attitude"), strict=True
    ):
        sigma = result.spread(quantity).sigma
        if not np.isfinite(sigma).any():
            continue
        unit, size = suiting(scale, sigma[np.isfinite(sigma)])
        entity, number = f"{_ROOT}/sigma_{key}", 3 * VECTORS.index(quantity)
        recording.series(entity, result.time, sigma / size, axes)
        _draw_limits(recording, result, entity, QUANTITIES[number : number + 3], size, float(np.nanmax(sigma)))
        labels[f"sigma_{key}"] = unit
    return labels


def _draw_limits(
    recording: Recording, result: EnsembleResult, entity: str, quantities: Sequence[str], unit: float, most: float
) -> None:
    """Record the limits of the requirements on some quantities."""
    judged = of_quantities(judged_of(result), quantities)
    record_limits(recording, entity, judged, unit, float(result.time[0]), float(result.elapsed[-1]), most)


def _draw_consistency(recording: Recording, result: EnsembleResult) -> None:
    for key, squares in (("nees", result.nees), ("nis", result.nis)):
        drawn = [one for one in squares.values() if np.isfinite(one.value).any()]
        if drawn:
            values: list[Array] = [one.value for one in drawn]
            recording.series(f"{_ROOT}/{key}", result.time, np.stack(values, axis=1), [one.name for one in drawn])


def _markdown(result: EnsembleResult, numbers: Mapping[str, Any]) -> str:
    final, rate = numbers["final_horizontal_m"], numbers["rate_nmi_h"]
    lines = [
        f"# {result.plan.scenario.name}: {len(result)} runs", "", opening(result, numbers), "",
        "| | CEP (95 % band) | R95 (95 % band) |", "|---|---|---|",
        f"| horizontal error at the end, m | {with_band(final['cep'])} | {with_band(final['r95'])} |",
        f"| rate Σ t r / Σ t², nmi/h | {with_band(rate['line']['cep'])} | {with_band(rate['line']['r95'])} |",
        f"| rate r(T) / T, nmi/h | {with_band(rate['end']['cep'])} | {with_band(rate['end']['r95'])} |",
        "", regulation(numbers), "", "## Runs to examine", "",
    ]  # fmt: skip
    lines += [f"- **{one['rank']}**, run {one['run']}: `{result.command(one['run'])}`" for one in numbers["named_runs"]]
    lines += ["", *([f"## {len(result.failures)} failed runs", ""] if result.failures else [])]
    lines += [f"- run {number}: {text}" for number, text in list(result.failures.items())[:20]]
    return "\n".join(lines)
