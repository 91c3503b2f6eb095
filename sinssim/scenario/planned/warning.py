"""Warns of flight plans beyond the limits of their aircraft, for all that flies them."""

from __future__ import annotations

from sinssim.errors import warn
from sinssim.scenario.planned.limits import findings
from sinssim.scenario.tables import Tables


def warn_of_limits(*scenarios: Tables) -> None:
    """Warn of the legs that an aircraft cannot fly, or not as they are written, once for each sentence.

    Args:
        scenarios: scenarios that will be flown: one, or the cells of a study.
    """
    for text in dict.fromkeys(finding.text for scenario in scenarios for finding in findings(scenario)):
        warn(text)
