"""The part "What to try" of a run's report: refused readings, the explanations that were tried, the keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sinssim.formatting import number_text
from sinssim.recording.report.page import table, words


def what_to_try(numbers: Mapping[str, Any]) -> Iterator[str]:
    """Yield the part, nothing for a filter without a diagnosis.

    Args:
        numbers: the summary's entry on the filter.

    Yields:
        HTML.
    """
    found = numbers.get("diagnosis")
    if not found:
        return
    yield "<h3>What to try</h3>"
    yield from (f"<p>{words(sentence)}</p>" for sentence in found["what_to_try"])
    if "hypotheses" not in found:
        return
    lines = [
        (
            words(f"{one['name']}, {one['kind']}"),
            words(_size(one)),
            f"<strong>{_gain(one)}</strong>" if one["gain"] > one["needed"] else _gain(one),
        )
        for one in found["hypotheses"]
    ]
    yield table(("explanation", "size ± 1σ, SI", "gain"), lines)
    yield (
        '<p class="note">The filter ran again under each explanation, over the time until '
        f"{found['until_s']:g} s. Gain: twice the logarithm of the factor by which the readings become more likely; "
        f"bold where it exceeds what occurs by chance in {100.0 * found['false_alarm']:g} % of sound runs, over all "
        "explanations. Wrong explanations gain as well where they are like the right one; the largest gain counts.</p>"
    )


def _gain(one: Mapping[str, Any]) -> str:
    return f"{one['gain']:.0f}"


def _size(one: Mapping[str, Any]) -> str:
    if not one["sigma"]:
        return ", ".join(number_text(value, 3) for value in one["value"])
    return ", ".join(
        f"{number_text(value, 3)} ± {number_text(sigma, 2)}"
        for value, sigma in zip(one["value"], one["sigma"], strict=True)
    )
