"""The sentences that compare a run with what it would be otherwise, for console and report alike."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sinssim.experiments.run.store.summaries.platform_summary import platform_sentences
from sinssim.experiments.run.store.summaries.redundancy_summary import redundancy_sentences
from sinssim.experiments.run.store.summaries.rotation_summary import rotation_sentences

COMPARISONS = {
    "redundancy": redundancy_sentences,
    "rotation": rotation_sentences,
    "platform": platform_sentences,
}
"""The sentences of each entry of `summary.json` that compares, by its name, in their order."""


def comparison_sentences(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield what a run compares itself with: voted sensors, the same block at rest, a platform beside strapdown.

    Args:
        summary: contents of `summary.json`.

    Yields:
        Whole sentences.
    """
    found = summary.get("algorithms") or {}
    numbers = {name: errors for name, errors in found.items() if name not in summary["failures"]}
    for name, sentences in COMPARISONS.items():
        if name in summary:
            yield from sentences(summary[name], numbers)
