"""Summary of a run: each algorithm's errors for `summary.json` and as a table."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np

import sinssim
from sinssim import units
from sinssim.data import DROPPED, FROZEN, SATURATED, ImuData, NavSolution
from sinssim.errors import RunError


def flagged(imu: ImuData) -> dict[str, int]:
    """Return the number of flagged samples, for `summary.json`.

    Returns:
        Number of samples by kind of flag, set by any sensor; empty if the sensors set no flags.
    """
    if imu.flags is None:
        return {}
    kinds = {"saturated": SATURATED, "dropped": DROPPED, "frozen": FROZEN}
    return {name: int(np.any(imu.flags & bit, axis=1).sum()) for name, bit in kinds.items()}


def flagged_words(flags: Mapping[str, int], samples: int) -> str:
    """Report the number of flagged samples.

    Args:
        flags: result of `flagged`.

    Returns:
        A sentence; empty if there are no flagged samples.
    """
    found = [f"{count:,} {name}" for name, count in flags.items() if count]
    return f"Flagged by the sensors, of {samples:,} samples: {', '.join(found)}." if found else ""


def singularities(solutions: Mapping[str, NavSolution]) -> dict[str, list[dict[str, Any]]]:
    """Return the passages through a singular attitude, for `summary.json`."""
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


def failures(failed: Mapping[str, RunError]) -> dict[str, dict[str, Any]]:
    """Return which algorithms have no result, and why, for `summary.json`.

    Returns:
        For each algorithm the instant, None if unknown, and the text.
    """
    return {name: {"time_s": error.time, "text": str(error)} for name, error in failed.items()}


def plain(value: Any) -> Any:
    """Return a value that JSON can hold: null in place of non-finite numbers, at any depth.

    Args:
        value: dictionaries, lists and tuples of numbers, texts and the like.

    Returns:
        The same value, with None where a float is NaN or infinite.
    """
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def versions() -> dict[str, str]:
    """Return the versions of the software that computed the numbers."""
    names = ("jsbsim", "numpy", "scipy", "numba", "filterpy", "rerun-sdk", "pyarrow")
    return {"sinssim": sinssim.__version__, **{name: _version(name) for name in names}}


@cache
def _version(name: str) -> str:
    """Return the version of an installed package; its metadata take milliseconds to read."""
    return version(name)


def software() -> str:
    """Return the versions of the software and the processor, in a line."""
    about = {**versions(), "Python": platform.python_version(), "processor": processor()}
    return ", ".join(f"{name} {text}" for name, text in about.items())


def processor() -> str:
    """Return the name of the machine's processor."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return (names or [platform.processor() or platform.machine()])[0]


def markdown_table(numbers: Mapping[str, Mapping[str, float]]) -> str:
    """Return the errors as a table.

    Args:
        numbers: results of `error_numbers` by algorithm.
    """
    lines = ["| error | " + " | ".join(numbers) + " |", "|---|" + "---|" * len(numbers)]
    for quantity, key in (
        ("horizontal [m]", "horizontal_error_m"),
        ("height [m]", "height_error_m"),
        ("velocity [m/s]", "velocity_error_mps"),
        ("attitude [arcsec]", "attitude_error_arcsec"),
    ):
        for kind in ("final", "max"):
            found = (n[f"{kind}_{key}"] for n in numbers.values())
            values = " | ".join(f"{value:.4g}" if math.isfinite(value) else "–" for value in found)
            lines.append(f"| {kind} {quantity} | {values} |")
    return "\n".join(lines)
