"""The verdicts of an ensemble on requirements, in sentences."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sinssim.experiments.ensembles.judge import LOOKS
from sinssim.formatting import number_text

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.result import EnsembleResult
    from sinssim.statistics.requirements.verdict import Verdict

_WORDS = {"met": "met, with 95 % confidence", "not met": "NOT MET, with 95 % confidence", "undecided": "undecided"}


def verdict_text(found: Verdict) -> str:
    """Return the value behind a verdict, its limit, and about how many more runs decide."""
    one, size = found.requirement, found.requirement.unit_size
    if math.isnan(found.value):
        return f"No run has a solution {one.instant}."
    value = f"{number_text(found.value / size)} {one.unit}" if math.isfinite(found.value) else "∞ (failed runs)"
    at = "at the end" if one.when == "end" else f"at {found.time:g} s"
    it = "the largest value" if one.when == "run" else "it"
    text = f"In {found.runs} runs {it} is {value} {at}; the limit is {one.limit / size:g} {one.unit}."
    if found.exceeded is not None:
        text += f" It is {found.exceeded.text}."
    if found.verdict != "undecided":
        return text
    if found.more_runs is None:
        return f"{text} The value lies at the limit: the necessary number of runs cannot be predicted."
    return f"{text} About {_rounded(found.more_runs)} more runs are needed for a decision if they are similar."


def looks_text(result: EnsembleResult) -> str:
    """Return how often an ensemble was looked at, and the probability of error.

    Returns:
        Whole sentences; "" if it did not run until decided.
    """
    if not result.looks:
        return ""
    *first, last = map(str, result.looks)
    numbers = f"{', '.join(first)} and {last}" if first else last
    limit = ""
    if any(one.verdict == "undecided" for one in result.verdicts):
        limit = (
            f" {last} runs are the most for this --runs; a further series of tests has its own probability of error of "
            "5 %."
        )
    return (
        f"Tested after {numbers} runs. Each of at most {LOOKS} tests errs with at most {5 / LOOKS:g} %, all together "
        f"with at most 5 %.{limit}"
    )


def requirement_lines(result: EnsembleResult) -> list[str]:
    """Return the verdicts as lines for the console."""
    lines = [f"{one.requirement.text}: {_WORDS[one.verdict]}. {verdict_text(one)}" for one in result.verdicts]
    return [*lines, *filter(None, [looks_text(result)])]


def _rounded(number: int) -> str:
    """Return about how many: two digits."""
    digits = max(len(str(number)) - 2, 0)
    return str(round(number, -digits))
