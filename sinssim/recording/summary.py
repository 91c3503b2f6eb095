"""A run in numbers: each algorithm's errors, as `summary.json` has them and as a table for people."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

import sinssim
from sinssim import units
from sinssim.data import Array, NavSolution
from sinssim.nav_error import NavError


def error_numbers(error: NavError) -> dict[str, float]:
    """Return one algorithm's errors in numbers.

    Args:
        error: its errors.

    Returns:
        `final_`, `rms_` and `max_` of `horizontal_error_m`, `height_error_m`, `velocity_error_mps` and
        `attitude_error_arcsec`. The final height error has a sign, positive if the solution is too high; all others
        are magnitudes.
    """
    numbers = {}
    for name, values in (
        ("horizontal_error_m", error.horizontal),
        ("height_error_m", error.height),
        ("velocity_error_mps", error.speed),
        ("attitude_error_arcsec", error.angle / units.ARCSEC),
    ):
        numbers[f"final_{name}"] = float(values[-1])
        numbers[f"rms_{name}"] = _rms(values)
        numbers[f"max_{name}"] = float(np.abs(values).max())
    return numbers


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values * values)))


def singularities(solutions: Mapping[str, NavSolution]) -> dict[str, list[dict[str, Any]]]:
    """Return the passages through a singular attitude, for `summary.json`.

    Args:
        solutions: by algorithm.

    Returns:
        For each algorithm that had any: start, end, damage and text of each.
    """
    return {
        name: [
            {
                "start_s": event.start,
                "end_s": event.end,
                "damage_arcsec": event.damage / units.ARCSEC,
                "text": event.text,
            }
            for event in solution.events
        ]
        for name, solution in solutions.items()
        if solution.events
    }


def versions() -> dict[str, str]:
    """Return the versions of what made the numbers.

    Returns:
        By name.
    """
    names = ("jsbsim", "numpy", "scipy", "numba", "rerun-sdk", "pyarrow")
    return {"sinssim": sinssim.__version__, **{name: version(name) for name in names}}


def processor() -> str:
    """Return the name of the machine's processor.

    Returns:
        As the machine says it.
    """
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return (names or [platform.processor() or platform.machine()])[0]


def markdown_table(numbers: Mapping[str, Mapping[str, float]]) -> str:
    """Return the errors as a table.

    Args:
        numbers: what `error_numbers` returned, by algorithm.

    Returns:
        Markdown: a row for each quantity, a column for each algorithm.
    """
    lines = ["| error | " + " | ".join(numbers) + " |", "|---|" + "---|" * len(numbers)]
    for quantity, key in (
        ("horizontal [m]", "horizontal_error_m"),
        ("height [m]", "height_error_m"),
        ("velocity [m/s]", "velocity_error_mps"),
        ("attitude [arcsec]", "attitude_error_arcsec"),
    ):
        for kind in ("final", "max"):
            values = " | ".join(f"{n[f'{kind}_{key}']:.4g}" for n in numbers.values())
            lines.append(f"| {kind} {quantity} | {values} |")
    return "\n".join(lines)
