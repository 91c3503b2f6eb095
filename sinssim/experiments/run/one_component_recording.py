"""The Rerun recording of a one-component run: pendulum, errors beside the equations, motion, streams."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from sinssim.data import Array
from sinssim.experiments.run.one_component_exhibits import (
    EQUATION_COLORS,
    EQUATION_NAMES,
    EQUATIONS,
    SIMULATION_COLOR,
    markdown,
)
from sinssim.recording import style
from sinssim.recording.rerun.rrd import Recording
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.recording.stream_tables import Stream
from sinssim.recording.style import thinned
from sinssim.units import ANGLE_SCALE, ARCMIN, DEG, SPEED_SCALE, Scale, suiting

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.simulation.one_component_run import OneComponentResult

_FRAMES = 2000  # positions of the pendulum
_ROWS = 8192  # rows of each stream, four for each column of pixels of a wide screen
_LARGEST = 35.0 * DEG  # largest angle at which it is drawn
_FINE: Scale = (("mas", ANGLE_SCALE[0][1] * 1e-3, ANGLE_SCALE[0][1]), *ANGLE_SCALE)


def record(
    path: Path, scenario: Scenario, result: OneComponentResult, found: Mapping[str, Any], streams: Iterable[Stream]
) -> None:
    """Write the recording.

    Args:
        found: its numbers, as in `summary.json`.

    Raises:
        OSError: the file cannot be written.
    """
    time = result.truth.time
    run = RunInfo(
        scenario.name,
        float(time[0]),
        float(time[-1]),
        (result.section.variant,),
        labels={"kind": "one-component"},
        views=scenario.views,
    )
    with Recording(path, run.application, all_views(run)) as recording:
        labels = _draw_errors(recording, result) | _draw_pendulum(recording, result)
        _draw_motion(recording, result)
        recording.document("about/scenario", f"```toml\n{scenario.to_toml()}\n```")
        recording.document("about/summary", markdown(found))
        for stream in streams:
            recording.stream(stream, thin=scenario.recording.detail == "light")
        run = replace(run, labels={**run.labels, **labels}, ranges=dict(recording.ranges))
        recording.document(RUN_ENTITY, run.to_json())
        recording.blueprint(all_views(run))


def _draw_errors(recording: Recording, result: OneComponentResult) -> dict[str, str]:
    """Record the errors below `one_component/`, and return units and panels for the view."""
    k = thinned(len(result.truth.time), _ROWS)
    t, caused = result.truth.time[k], result.caused
    keys = ("closed_form", "equation_8_12", "equation_8_11")  # (8.10) is the same line as (8.11)
    values = [getattr(result, EQUATIONS[key]).coordinate[k] / ARCMIN for key in keys]
    values.append(result.error.coordinate[k] / ARCMIN)
    names, colors = [EQUATION_NAMES[key] for key in keys], [EQUATION_COLORS[key] for key in keys]
    _lines(recording, "coordinate", t, values, [*names, "simulation"], [*colors, SIMULATION_COLOR])
    both = ("equation_8_10", "equation_8_11")
    apart = [getattr(result, EQUATIONS[key]).coordinate - caused.coordinate for key in both]
    unit, size = suiting(_FINE, *apart)
    _lines(recording, "difference", t, [a[k] / size for a in apart], [EQUATION_NAMES[key] for key in both],
           [EQUATION_COLORS[key] for key in both])  # fmt: skip
    panels = []
    for number, source in enumerate(result.by_source, start=1):
        entity = f"source_{number}"
        lines = [source.closed.coordinate[k] / ARCMIN, source.simulated.coordinate[k] / ARCMIN]
        _lines(recording, entity, t, lines, [EQUATION_NAMES["closed_form"], "simulation"],
               [EQUATION_COLORS["closed_form"], SIMULATION_COLOR])  # fmt: skip
        panels.append((entity, f"Δy due to the {source.name} alone [arcmin]"))
    of_speed, of_pitch = suiting(SPEED_SCALE, result.error.velocity), suiting(ANGLE_SCALE, result.error.pitch)
    for entity, error, equation, (_, scale) in (
        ("velocity_error", result.error.velocity, result.pendulum.velocity, of_speed),
        ("pitch_error", result.error.pitch, result.pendulum.pitch, of_pitch),
    ):
        _lines(recording, entity, t, [equation[k] / scale, error[k] / scale],
               [EQUATION_NAMES["equation_8_11"], "simulation"],
               [EQUATION_COLORS["equation_8_11"], SIMULATION_COLOR])  # fmt: skip
    return {
        "sources": json.dumps(panels if len(panels) > 1 else []),
        "difference": unit,
        "velocity": of_speed[0],
        "pitch": of_pitch[0],
    }


def _lines(
    recording: Recording, entity: str, time: Array, values: Sequence[Array], names: list[str], colors: list[style.Rgb]
) -> None:
    """Record lines below `one_component/`, each drawn thinner than the one under it."""
    entity, widths = f"one_component/{entity}", [6.0, 4.0, 2.7, 1.4][-len(names) :]
    recording.series(entity, time, np.stack(values, axis=1), names, colors=colors, widths=widths)


def _draw_motion(recording: Recording, result: OneComponentResult) -> None:
    truth, k = result.truth, thinned(len(result.truth.time), _ROWS)
    blue, green, orange = style.colors(["z", "y", "x"])
    for entity, values, color in (
        ("velocity", truth.velocity, green),
        ("height", truth.height, blue),
        ("body_pitch", truth.body_pitch / DEG, orange),
    ):
        _lines(recording, entity, truth.time[k], [values[k]], [entity.replace("body_", "")], [color])
    force = [truth.horizontal[k], truth.vertical[k] - result.section.gravity_mps2]
    _lines(recording, "force", truth.time[k], force, ["a_ξ", "a_η − g"], [orange, blue])


def _draw_pendulum(recording: Recording, result: OneComponentResult) -> dict[str, str]:
    """Record the mathematical Schuler pendulum that Δy swings like: simulation over closed form.

    Returns:
        The label `enlarged`, by how much the angles are drawn larger than they are.
    """
    k = thinned(len(result.truth.time), _FRAMES)
    t = result.truth.time[k]
    lines = ((result.closed.coordinate, "closed", 9.0), (result.error.coordinate, "simulation", 3.0))
    largest = max(float(np.abs(y).max()) for y, _, _ in lines)
    factor = _LARGEST / largest if largest and np.isfinite(largest) else 1.0
    digits = 10.0 ** np.floor(np.log10(factor))
    factor = float(digits * np.floor(factor / digits))  # a round number
    arc = np.linspace(-1.3 * _LARGEST, 1.3 * _LARGEST, 61)
    grey = style.COLORS["ground"]
    rim = np.column_stack((np.sin(arc), np.cos(arc)))
    still = [rim, np.array([[0.0, 0.0], [0.0, 1.08]])]
    recording.static(
        "one_component/pendulum/scale", rr.LineStrips2D(still, radii=rr.Radius.ui_points(0.8), colors=grey)
    )
    colors = (EQUATION_COLORS["closed_form"], SIMULATION_COLOR)
    recording.static(
        "one_component/pendulum/words",
        rr.Points2D(
            [[0.0, 1.14], [-0.42, -0.1], [0.42, -0.1]],
            labels=["Δy = 0: true vertical", "closed form at rest", "simulation"],
            radii=rr.Radius.ui_points(0.1),
            colors=[grey, *colors],
            show_labels=True,
        ),
    )
    for order, ((y, name, size), color) in enumerate(zip(lines, colors, strict=True), start=1):
        angle, entity = factor * y[k], f"one_component/pendulum/{name}"
        bob = np.column_stack((np.sin(angle), np.cos(angle)))
        rods = np.stack((np.zeros_like(bob), bob), axis=1)
        rod = rr.LineStrips2D.from_fields(radii=rr.Radius.ui_points(size / 2.0), colors=[color], draw_order=order)
        recording.static(f"{entity}/rod", rod)
        recording.columns(f"{entity}/rod", t, rr.LineStrips2D.columns(strips=list(rods)))
        ball = rr.Points2D.from_fields(radii=rr.Radius.ui_points(3.0 + size), colors=[color], draw_order=order)
        recording.static(f"{entity}/bob", ball)
        recording.columns(f"{entity}/bob", t, rr.Points2D.columns(positions=bob))
    return {"enlarged": f"{factor:g}"}
