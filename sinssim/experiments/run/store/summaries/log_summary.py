"""Summary of a run on recorded sensors: what it is compared with, and the errors at the end of every outage."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from sinssim.formatting import number_text

if TYPE_CHECKING:
    from sinssim.data import NavSolution
    from sinssim.simulation.aided.truth_comparison import Aided
    from sinssim.simulation.navigation import Navigated


def best_solution(run: Navigated, aided: Aided | None) -> tuple[str, NavSolution]:
    """Return the best solution of a run on recorded sensors, which stands for the motion in pictures.

    Args:
        run: its inertial solutions.
        aided: its aided solution, if there is a filter.

    Returns:
        Its name, and the smoothed solution, else the aided one, else that of the first algorithm.
    """
    if aided is not None and len(aided.estimate.time) > 1:
        smoothed = aided.estimate.smoothed
        if smoothed is not None and aided.estimate.divergence is None:
            return "smoothed", smoothed.solution
        return "aided", aided.estimate.solution
    return next(iter(run.solutions.items()))


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
