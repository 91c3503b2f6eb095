"""The part "What to try" of a run's report: rejected measurements, the explanations that were tried, the keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sinssim.formatting import listed, number_text
from sinssim.recording.report.page import table, words


def what_to_try(numbers: Mapping[str, Any]) -> Iterator[str]:
    """Yield the part, nothing for a filter without a diagnosis.

    Args:
        numbers: the summary's entry on the filter.
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
            words(_name(one)),
            f"<strong>{_gain(one)}</strong>" if k == 0 and found["cause"] is not None else _gain(one),
            f"{one['needed']:.1f}",
            _size(one),
        )
        for k, one in enumerate(_by_cause(found))
    ]
    yield table(("explanation", "gain", "limit", "size ± 1σ, SI; factor of a σ or a noise"), lines)
    yield (
        '<p class="note">The filter ran again with each explanation, until '
        f"{round(found['until_s'], 1):g} s. The gain is twice the logarithm of the factor by which the measurements "
        "become more probable. The limit is the value that the gain of any explanation exceeds in at most "
        f"{100.0 * found['false_alarm']:g} % of runs with a correct filter. A wrong explanation that resembles the "
        "correct one has a large gain, too: only the largest gain, in bold, identifies the cause.</p>"
    )


def _by_cause(found: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the explanations with the cause first."""
    return sorted(found["hypotheses"], key=lambda one: (not one["gain"] > one["needed"], -one["gain"]))


def _name(one: Mapping[str, Any]) -> str:
    match one["kind"]:
        case "measurement noise":
            return f"σ of {listed(one['name'].split(', '))}"
        case "bias walk":
            return f"random walk of the biases of the {one['name']}s"
        case "inertial noise":
            return "noise of gyros and accelerometers"
        case "initial state":
            return f"error of the {one['name']}"
        case _:
            return str(one["name"])


def _gain(one: Mapping[str, Any]) -> str:
    return f"{one['gain']:.0f}"


def _size(one: Mapping[str, Any]) -> str:
    """Return the estimates as HTML, three in a line: six angles in one would be wider than the page."""
    if not one["value"]:
        return "–"
    if not one["sigma"]:
        return ", ".join(number_text(value, 3) for value in one["value"])
    texts = [
        f"{number_text(value, 3)} ± {number_text(sigma, 2)}"
        for value, sigma in zip(one["value"], one["sigma"], strict=True)
    ]
    return "<br>".join(words(", ".join(texts[k : k + 3])) for k in range(0, len(texts), 3))
