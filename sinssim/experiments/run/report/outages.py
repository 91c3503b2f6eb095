"""The section of a run's report about injected outages: a table, and the growth of the errors within each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.experiments.run.store.summaries.log_summary import outage_sentence
from sinssim.formatting import number_text, signed
from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line

if TYPE_CHECKING:
    from sinssim.data import Array
    from sinssim.experiments.run.parts.outages import Outages

_SMOOTHED = "smoothed_max_horizontal_error_m"


def outage_section(part: Outages, numbers: Mapping[str, Any]) -> Iterator[str]:
    """Yield the section about injected outages.

    Args:
        part: the outages of a run.
        numbers: the entry `outages` of the summary.

    Yields:
        HTML.
    """
    yield from (f"<p><strong>{words(sentence)}</strong></p>" for sentence in outage_sentence(numbers))
    each, span = numbers["each"], (float(part.run.time[0]), float(part.run.time[-1]))
    if not each:
        return
    pictures = _growth(part.judged.growth, numbers) + _ends(numbers, span)
    yield f'<div class="pair"><div>{pictures}</div><div>{_table(numbers)}</div></div>'


def _table(numbers: Mapping[str, Any]) -> str:
    each, smoothed = numbers["each"], _SMOOTHED in numbers["median"]
    heads = ["outage [s]", "horizontal [m]", "1σ of the filter [m]", "height [m]", "velocity [m/s]"]
    keys = ["horizontal_error_m", "horizontal_sigma_m", "height_error_m", "velocity_error_mps"]
    if smoothed:
        heads.append("smoothed, largest [m]")
        keys.append(_SMOOTHED)
    lines = [
        (f"{one['from_s']:g} … {one['to_s']:g}", *("–" if one[k] is None else signed(one[k]) for k in keys))
        for one in sorted(each, key=lambda one: one["from_s"])
    ]
    for word, name in (("median", "median"), ("90 %", "p90")):
        own = numbers[name]
        lines.append((f"<strong>{word}</strong>", *("–" if own[k] is None else number_text(own[k]) for k in keys)))
    return table(heads, lines) + (
        f'<p class="note">Errors at the last time of each outage at which {words(numbers["against"])} is known; '
        "median and 90 % of magnitudes. Smoothed: the largest horizontal error within the outage.</p>"
    )


def _growth(growth: Sequence[tuple[Array, Array]], numbers: Mapping[str, Any]) -> str:
    """Draw the horizontal error from the beginning of each outage on."""
    longest = max(one["to_s"] - one["from_s"] for one in numbers["each"])
    color = style.css(style.COLORS["aided"])
    drawn = [(time, error) for time, error in growth if len(time) > 1]
    lines = [
        Line("" if number else "one line an outage", time, error, color, 1.0)
        for number, (time, error) in enumerate(drawn)
    ]
    if not lines:
        return ""
    return plot.plot("Horizontal error since the last fix", "m", lines, (0.0, longest), from_zero=True)


def _ends(numbers: Mapping[str, Any], span: tuple[float, float]) -> str:
    """Draw the error at the end of each outage over the run."""
    each = numbers["each"]
    time = np.array([one["at_s"] for one in each])
    end = np.array([one["horizontal_error_m"] for one in each])
    sigma = np.array([one["horizontal_sigma_m"] for one in each])
    lines = [
        Line("at the end", time, end, style.css(style.COLORS["aided"]), dots=6.0),
        Line("1σ of the filter", time, sigma, style.css(style.COLORS["bound"]), dots=5.0),
    ]
    return plot.plot("Horizontal error at the end of each outage", "m", lines, span, from_zero=True)
