"""Writes the directory of a calibration: numbers as JSON, the compensation file, the report, the scenario."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sinssim.analyses.calibration.compensation_file import compensation_text
from sinssim.analyses.calibration.result import CalibrationResult
from sinssim.recording.store.directory import write_directory
from sinssim.recording.store.summary import versions
from sinssim.system.outputs import write_text
from sinssim.units import ARCSEC

_SI = {("gyro", "bias"): "rad/s", ("accel", "bias"): "m/s²", "scale": "1", "misalignment": "rad", "arm": "m"}


def to_json(result: CalibrationResult) -> dict[str, Any]:
    """Return a calibration as plain numbers with their units."""
    solution, estimate = result.estimate.solution, result.estimate
    rows = []
    for k, one in enumerate(result.parameters):
        unit, size = one.unit
        true = None if result.truth is None else float(result.truth[k])
        rows.append(
            {
                "name": one.name,
                "value": float(result.values[k]) / size,
                "sigma": float(result.sigma[k]) / size,
                "unit": unit,
                "observable": bool(result.observable[k]),
                "size_before": one.size / size,
                "true": None if true is None else true / size,
                "error_over_sigma": None if true is None else float((result.values[k] - true) / result.sigma[k]),
                "value_si": float(result.values[k]),
                "sigma_si": float(result.sigma[k]),
                "unit_si": _SI.get(one.field) or _SI[one.triad, one.field],
            }
        )
    total = result.chi_square_of_errors
    return {
        "name": result.scenario.name,
        "description": result.scenario.description,
        "method": result.method,
        "frame": result.frame,
        "parameters": rows,
        "covariance_si": result.covariance.tolist(),
        "unobservable": result.unobservable,
        "singular_values": solution.singular.tolist(),
        "directions": solution.directions.T.tolist(),
        "residuals": {
            "chi_square": solution.chi_square,
            "degrees_of_freedom": solution.degrees,
            "gyro_rad_s": estimate.residual_gyro.tolist(),
            "accel_mps2" if result.method == "separate" else "velocity_over_sigma": estimate.residual_accel.tolist(),
        },
        "errors": None if total is None else {"chi_square": total[0], "degrees_of_freedom": total[1]},
        "table_tilt_arcsec": None if estimate.tilt is None else (estimate.tilt / ARCSEC).tolist(),
        "dwells_s": result.dwells.tolist(),
        "iterations": estimate.iterations,
        "notes": list(result.notes),
        "versions": versions(),
    }


def write_calibration(result: CalibrationResult, directory: Path, *, overwrite: bool = False) -> Path:
    """Write a calibration's directory: calibration.json, compensation.toml, report.html, scenario.toml.

    Raises:
        InputError: the place is taken or cannot be written.
    """
    from sinssim.analyses.calibration.calibration_exhibits import exhibits_of
    from sinssim.recording.report.exhibits import page_of

    def write(folder: Path) -> None:
        write_text(folder / "calibration.json", json.dumps(to_json(result), indent=2, ensure_ascii=False) + "\n")
        write_text(folder / "compensation.toml", compensation_text(result))
        write_text(folder / "scenario.toml", result.scenario.to_toml())
        write_text(folder / "report.html", page_of(exhibits_of(result)))

    return write_directory(directory, write, overwrite=overwrite)
