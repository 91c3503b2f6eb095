"""Summary of a run on recorded sensors: what it is compared with, and the errors at the end of every outage."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.formatting import number_text
from sinssim.strapdown.nav_error import NavError

if TYPE_CHECKING:
    from sinssim.data import NavSolution
    from sinssim.estimation import Estimate
    from sinssim.simulation.result import Run

_SHARES = {"median": 50.0, "p90": 90.0}


def best_solution(run: Run) -> tuple[str, NavSolution]:
    """Return the best solution of a run on recorded sensors, which stands for the motion in pictures.

    Args:
        run: the run.

    Returns:
        Its name, and the smoothed solution, else the aided one, else that of the first algorithm.
    """
    if run.aided is not None and len(run.aided.estimate.time) > 1:
        smoothed = run.aided.estimate.smoothed
        if smoothed is not None and run.aided.estimate.divergence is None:
            return "smoothed", smoothed.solution
        return "aided", run.aided.estimate.solution
    return next(iter(run.solutions.items()))


def outage_errors(
    estimate: Estimate, error: NavError, smoothed: NavError | None, outages: Sequence[tuple[float, float]]
) -> list[dict[str, Any]]:
    """Return the errors at the end of each outage.

    Args:
        estimate: the aided solution.
        error: its differences from the reference, or from the withheld fixes, at the filter's epochs.
        smoothed: the same of the smoothed solution, if there is one.
        outages: beginning and end of each, s.

    Returns:
        For every outage its times, the horizontal and height error and the velocity error of the filter at the last
        known instant, its own 1σ of the horizontal position there, and the largest horizontal error of the smoothed
        solution within it.
    """
    found = []
    for begin, end in outages:
        during = (error.time > begin) & (error.time <= end + 1e-9)
        known = np.flatnonzero(during & np.isfinite(error.position_ned).all(axis=1))
        if not len(known):
            continue
        k = int(known[-1])
        one: dict[str, Any] = {
            "from_s": float(begin),
            "to_s": float(end),
            "at_s": float(error.time[k]),
            "horizontal_error_m": float(error.horizontal[k]),
            "height_error_m": float(error.height[k]),
            "velocity_error_mps": float(error.speed[k]),
            "horizontal_sigma_m": float(np.hypot(*estimate.sigma[k, :2])),
        }
        if smoothed is not None:
            inside = (smoothed.time > begin) & (smoothed.time <= end + 1e-9)
            values = smoothed.horizontal[inside]
            values = values[np.isfinite(values)]
            one["smoothed_max_horizontal_error_m"] = float(values.max()) if len(values) else math.nan
        found.append(one)
    return found


def outage_numbers(found: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the errors of outages together.

    Args:
        found: the errors of each, of `outage_errors`.

    Returns:
        `each`: the same; `median` and `p90` over the outages of the magnitude of each error; `error_over_sigma`: root
        mean square of the horizontal error over the filter's own 1σ, which is 1 on average for a filter that is right.
    """
    ratio = [one["horizontal_error_m"] / one["horizontal_sigma_m"] for one in found]
    return {
        "each": list(found),
        **{word: _share(found, percent) for word, percent in _SHARES.items()},
        "error_over_sigma": float(np.sqrt(np.mean(np.square(ratio)))) if ratio else math.nan,
    }


def _share(found: Sequence[Mapping[str, float]], percent: float) -> dict[str, float]:
    """Return a percentile over the outages of the magnitude of each error."""
    keys = [key for key in (found[0] if found else ()) if key.endswith(("_m", "_mps"))]
    values = {key: np.abs([one[key] for one in found]) for key in keys}
    known = {key: row[np.isfinite(row)] for key, row in values.items()}
    return {key: float(np.percentile(row, percent)) if len(row) else math.nan for key, row in known.items()}


def compared_words(about: Mapping[str, Any]) -> str:
    """Return a sentence on what the solutions are compared with.

    Args:
        about: the entry `log` of the summary.
    """
    against, knows = about["compared_with"], about["knows"]
    if about["reference_file"] is not None:
        missing = [what for what in ("velocity", "attitude") if what not in knows]
        without = f"; it has no {' and no '.join(missing)}" if missing else ""
        return f"Errors are differences from the reference {against}{without}."
    if against is None:
        return "There is no reference and only one solution, so the errors are unknown."
    return f"There is no reference: differences from {against} are shown, which is not the truth."


def outage_sentence(numbers: Mapping[str, Any]) -> Iterator[str]:
    """Yield the result of the outages in a sentence.

    Args:
        numbers: the entry `outages` of the summary.
    """
    each = numbers["each"]
    if not each:
        yield "No outage could be evaluated: the reference is not known in any of them."
        return
    median, high = numbers["median"], numbers["p90"]
    lengths = {round(one["to_s"] - one["from_s"], 3) for one in each}
    of = f" of {lengths.pop():g} s" if len(lengths) == 1 else ""
    passes = len({one.get("pass", 1) for one in each})
    of += f" in {passes} passes" if passes > 1 else ""
    text = (
        f"{len(each)} outage{'s' * (len(each) != 1)}{of}: horizontal error at the end "
        f"{number_text(median['horizontal_error_m'])} m (median), {number_text(high['horizontal_error_m'])} m (90 %)"
    )
    key = "smoothed_max_horizontal_error_m"
    if key in median:
        text += f"; smoothed, at most {number_text(median[key])} m and {number_text(high[key])} m within the outage"
    if len(each) > 1:
        text += f". The errors at the end are {number_text(numbers['error_over_sigma'])} of their 1σ (rms)"
    yield f"{text}."
