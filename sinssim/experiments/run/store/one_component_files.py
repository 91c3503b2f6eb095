"""Streams and numbers of a one-component run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.data import Array
from sinssim.experiments.run.plane_errors import ROW_NAMES
from sinssim.formatting import number_text
from sinssim.recording.store.summary import plain
from sinssim.recording.streams import Stream, Vector
from sinssim.strapdown.one_component import projections
from sinssim.strapdown.one_component_errors import PlaneErrors
from sinssim.units import ARCSEC, DEG

if TYPE_CHECKING:
    from sinssim.sensors.sets.one_component import PlaneReadings
    from sinssim.simulation.one_component import OneComponentResult

EQUATIONS = {
    "equation_8_10": "along_motion",
    "equation_8_11": "pendulum",
    "equation_8_12": "first_order",
    "closed_form": "closed",
}
"""Attributes of `OneComponentResult` by their names in streams and summary."""

_ERROR_COLUMNS = ("velocity_mps", "coordinate_rad", "pitch_rad")


def one_component_streams(result: OneComponentResult) -> list[Stream]:
    """Return the streams of a one-component run.

    Args:
        result: the run.

    Returns:
        `truth`, the readings `imu_ideal`, `imu_measured` and, of an attitude sensor, `attitude_ideal` and
        `attitude_measured`, `nav_<variant>`, `forces_<variant>`, `error_<variant>`, `error_perfect_sensors`, and
        `error_<equation>` for each entry of `EQUATIONS`.
    """
    truth, found, name = result.truth, result.solution, result.section.variant.replace("-", "_")
    time = truth.time
    moved = {"velocity_mps": truth.velocity, "coordinate_rad": result.coordinate, "height_m": truth.height}
    state = [("motion", moved),
             ("attitude", {"pitch_rad": truth.pitch, "body_pitch_rad": truth.body_pitch, "rate_radps": truth.rate}),
             ("force", {"horizontal_mps2": truth.horizontal, "vertical_mps2": truth.vertical})]  # fmt: skip
    attitude = {"pitch_rad": found.pitch, "body_pitch_rad": found.pitch - result.section.mounting_angle_deg * DEG}
    if found.rate is not None:
        attitude["rate_radps"] = found.rate
    navigated = [("motion", {"velocity_mps": found.velocity, "coordinate_rad": found.coordinate}),
                 ("attitude", attitude)]  # fmt: skip
    push = result.measured.dvel / np.diff(time)[:, None]
    along, up = projections(push[:, 0], push[:, 1], 0.5 * (found.pitch[:-1] + found.pitch[1:]))
    return [
        _stream("truth", time, *state),
        *_readings("ideal", result.ideal),
        *_readings("measured", result.measured),
        _stream(f"nav_{name}", time, *navigated),
        _stream(f"forces_{name}", time[1:], ("force", {"horizontal_mps2": along, "vertical_mps2": up})),
        _errors(name, result.error),
        _errors("perfect_sensors", result.perfect),
        *(_errors(key, getattr(result, field)) for key, field in EQUATIONS.items()),
    ]


def _stream(name: str, time: Array, *vectors: tuple[str, dict[str, Array]]) -> Stream:
    made = (Vector(group, tuple(columns), np.column_stack(list(columns.values()))) for group, columns in vectors)
    return Stream(name, time, tuple(made))


def _readings(kind: str, readings: PlaneReadings) -> Iterator[Stream]:
    columns = {"dvel_x_mps": readings.dvel[:, 0], "dvel_y_mps": readings.dvel[:, 1]}
    if readings.dvel_arm is not None:
        columns["dvel_arm_mps"] = readings.dvel_arm
    vectors = [("dvel", columns)]
    if readings.dtheta is not None:
        vectors.append(("dtheta", {"dtheta_rad": readings.dtheta}))
    yield _stream(f"imu_{kind}", readings.time[1:], *vectors)
    if readings.angle is not None:
        yield _stream(f"attitude_{kind}", readings.time, ("attitude", {"inertial_angle_rad": readings.angle}))


def _errors(name: str, error: PlaneErrors) -> Stream:
    values = np.column_stack((error.velocity, error.coordinate, error.pitch))
    return Stream(f"error_{name}", error.time, (Vector("error", _ERROR_COLUMNS, values),))


def numbers(result: OneComponentResult) -> dict[str, Any]:
    """Return the numbers of a one-component run for `summary.json`.

    Args:
        result: the run.

    Returns:
        The variant, the Schuler period, statistics of the errors of the simulation, with perfect sensors and of each
        equation, and the largest difference of each equation's coordinate from that of the simulation minus that with
        perfect sensors, in m and relative to its largest value.
    """
    section = result.section
    caused, radius = result.caused, section.radius_m
    errors = {"simulation": result.error, "perfect_sensors": result.perfect}
    errors |= {key: getattr(result, field) for key, field in EQUATIONS.items()}
    largest = float(np.abs(caused.coordinate).max())
    apart = {key: float(np.abs(errors[key].coordinate - caused.coordinate).max()) for key in EQUATIONS}
    differences = {
        key: {"max_m": most * radius, "relative": most / largest if largest else None} for key, most in apart.items()
    }
    sources = {source.name.replace(" ", "_"): _statistics(source.simulated, radius) for source in result.by_source}
    found: dict[str, Any] = plain(
        {
            "variant": section.variant,
            "schuler_period_s": float(2.0 * np.pi * np.sqrt(radius / section.gravity_mps2)),
            "errors": {name: _statistics(error, radius) for name, error in errors.items()},
            "errors_by_source": sources,
            "differences": differences,
        }
    )
    return found


def _statistics(error: PlaneErrors, radius: float) -> dict[str, float]:
    columns = {
        "position_error_m": error.coordinate * radius,
        "velocity_error_mps": error.velocity,
        "pitch_error_arcsec": error.pitch / ARCSEC,
    }
    found = {}
    with np.errstate(over="ignore", invalid="ignore"):
        for name, values in columns.items():
            found[f"final_{name}"] = float(values[-1])
            found[f"rms_{name}"] = float(np.sqrt(np.mean(values * values)))
            found[f"max_{name}"] = float(np.abs(values).max())
    return found


def markdown(found: Mapping[str, Any]) -> str:
    """Return the errors as a table.

    Args:
        found: result of `numbers`.

    Returns:
        Markdown: a row for the simulation and for each equation.
    """
    lines = ["| | R Δy max [m] | ΔV max [m/s] | difference, relative |", "|---|---|---|---|"]
    for key, errors in found["errors"].items():
        apart = found["differences"].get(key, {}).get("relative")
        values = (number_text(math.nan if errors[name] is None else errors[name], 4)
                  for name in ("max_position_error_m", "max_velocity_error_mps"))  # fmt: skip
        lines.append(f"| {ROW_NAMES[key]} | {' | '.join(values)} | {'' if apart is None else f'{apart:.1e}'} |")
    return "\n".join(lines)
