"""Summary of a run: each algorithm's errors for `summary.json` and as a table."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np

import sinssim
from sinssim import units
from sinssim.data import DROPPED, FROZEN, SATURATED, Array, ImuData, NavSolution
from sinssim.errors import RunError
from sinssim.strapdown.nav_error import NavError

_QUANTITIES: dict[str, Callable[[NavError], Array]] = {
    "horizontal_error_m": lambda error: error.horizontal,
    "height_error_m": lambda error: error.height,
    "velocity_error_mps": lambda error: error.speed,
    "attitude_error_arcsec": lambda error: error.angle / units.ARCSEC,
}
NO_NUMBERS: dict[str, float] = {f"{kind}_{q}": math.nan for q in _QUANTITIES for kind in ("final", "rms", "max")}
"""The errors of an algorithm without a solution, in the form of `error_numbers`."""


def error_numbers(error: NavError) -> dict[str, float]:
    """Return the error statistics of one algorithm.

    Args:
        error: its errors.

    Returns:
        `final_`, `rms_` and `max_` of `horizontal_error_m`, `height_error_m`, `velocity_error_mps` and
        `attitude_error_arcsec`. The final height error has a sign, positive if the solution is too high; all others are
        magnitudes.
    """
    return error_numbers_of(lambda: [error])


def error_numbers_of(blocks: Callable[[], Iterable[NavError]]) -> dict[str, float]:
    """Return the error statistics of one solution, given block by block.

    Args:
        blocks: returns its errors, one block of rows after the other; called for each quantity, so that only one
            of them is in memory.

    Returns:
        As `error_numbers`.
    """
    numbers = {}
    for name, quantity in _QUANTITIES.items():
        values = np.concatenate([quantity(block) for block in blocks()])  # a copy
        numbers[f"final_{name}"] = float(values[-1])
        largest = float(np.abs(values, out=values).max())
        with np.errstate(over="ignore", invalid="ignore"):
            numbers[f"rms_{name}"] = float(np.sqrt(np.mean(np.multiply(values, values, out=values))))
        numbers[f"max_{name}"] = largest
    return numbers


def known_error_numbers_of(blocks: Callable[[], Iterable[NavError]]) -> dict[str, float]:
    """Return the statistics of errors that are known at some rows only, as `error_numbers_of`.

    Args:
        blocks: as for `error_numbers_of`; NaN where the errors are not known.

    Returns:
        The statistics over the known rows; "final" is the last known one. NaN for a quantity that is never known.
    """
    numbers = {}
    for name, quantity in _QUANTITIES.items():
        values = np.concatenate([quantity(block) for block in blocks()])
        values = values[np.isfinite(values)]
        numbers[f"final_{name}"] = float(values[-1]) if len(values) else math.nan
        numbers[f"rms_{name}"] = float(np.sqrt(np.mean(values * values))) if len(values) else math.nan
        numbers[f"max_{name}"] = float(np.abs(values).max()) if len(values) else math.nan
    return numbers


def flagged(imu: ImuData) -> dict[str, int]:
    """Return the number of flagged samples, for `summary.json`.

    Args:
        imu: measured increments.

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
        samples: number of all samples.

    Returns:
        A sentence; empty if there are no flagged samples.
    """
    found = [f"{count:,} {name}" for name, count in flags.items() if count]
    return f"Flagged by the sensors, of {samples:,} samples: {', '.join(found)}." if found else ""


def singularities(solutions: Mapping[str, NavSolution]) -> dict[str, list[dict[str, Any]]]:
    """Return the passages through a singular attitude, for `summary.json`.

    Args:
        solutions: by algorithm.

    Returns:
        For each algorithm with passages: start, end, damage and text of each.
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


def diverged(errors: Mapping[str, NavError]) -> dict[str, RunError]:
    """Find the algorithms whose errors are not finite.

    Args:
        errors: by algorithm.

    Returns:
        For each of them an error with the message and the instant from which this holds.
    """
    found = {}
    for name, error in errors.items():
        if all(map(math.isfinite, error_numbers(error).values())):
            continue
        with np.errstate(over="ignore", invalid="ignore"):
            finite = np.isfinite(error.horizontal**2 + error.height**2 + error.speed**2 + error.angle**2)
        time = float(error.time[int(np.argmin(finite))])
        found[name] = RunError(f"its errors are not finite from t = {time:.2f} s on: it diverged.", time=time)
    return found


def failures(failed: Mapping[str, RunError]) -> dict[str, dict[str, Any]]:
    """Return which algorithms have no result, and why, for `summary.json`.

    Args:
        failed: errors by algorithm.

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
    """Return the versions of the software that computed the numbers.

    Returns:
        Versions by name.
    """
    names = ("jsbsim", "numpy", "scipy", "numba", "filterpy", "rerun-sdk", "pyarrow")
    return {"sinssim": sinssim.__version__, **{name: _version(name) for name in names}}


@cache
def _version(name: str) -> str:
    """Return the version of an installed package; its metadata take milliseconds to read."""
    return version(name)


def processor() -> str:
    """Return the name of the machine's processor.

    Returns:
        The name as reported by the system.
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
        numbers: results of `error_numbers` by algorithm.

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
            found = (n[f"{kind}_{key}"] for n in numbers.values())
            values = " | ".join(f"{value:.4g}" if math.isfinite(value) else "–" for value in found)
            lines.append(f"| {kind} {quantity} | {values} |")
    return "\n".join(lines)
