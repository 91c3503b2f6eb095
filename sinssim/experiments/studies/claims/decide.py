"""Decides the textbook chapter's claims, and further laws, from the numbers of a study.

A part of a study names the claims that it has the numbers for; the study names those that need no navigation. The rules
and their thresholds are beside this file, one file for each subject.
"""

from __future__ import annotations

from collections.abc import Callable

from sinssim.experiments.studies.claims.coning import coning_drift
from sinssim.experiments.studies.claims.cost import cheapest, trigonometric_matrix
from sinssim.experiments.studies.claims.euler import euler_heading, euler_limit
from sinssim.experiments.studies.claims.gravity_series import gravity_series
from sinssim.experiments.studies.claims.gyro_free import gyro_free
from sinssim.experiments.studies.claims.one_component import accelerometer_term, gyro_term
from sinssim.experiments.studies.claims.orthogonality import orthogonality
from sinssim.experiments.studies.claims.outcome import Evidence, Outcome, undecided
from sinssim.experiments.studies.claims.position import computer_errors, latitude_rate, simplified_radii
from sinssim.experiments.studies.claims.rates import attitude_rate, velocity_rate
from sinssim.experiments.studies.results import StudyResult, Verdict
from sinssim.experiments.studies.schema import CLAIMS

_DECIDERS: dict[str, Callable[[Evidence], Outcome]] = {
    "velocity-rate": velocity_rate,
    "attitude-rate": attitude_rate,
    "cheapest": cheapest,
    "orthogonality": orthogonality,
    "euler-heading": euler_heading,
    "euler-limit": euler_limit,
    "simplified-radii": simplified_radii,
    "latitude-rate": latitude_rate,
    "computer-errors": computer_errors,
    "gyro-free": gyro_free,
    "coning-drift": coning_drift,
}
_COMPUTED: dict[str, Callable[[], Outcome]] = {
    "trigonometric-matrix": trigonometric_matrix,
    "accelerometer-term": accelerometer_term,
    "gyro-term": gyro_term,
    "gravity-series": gravity_series,
}
"""Claims decided by a computation of their own, without navigations."""


def decide(comparison: StudyResult) -> list[Verdict]:
    """Decide the claims that a study's parts have numbers for.

    Returns:
        A verdict for each claim, in the order of the chapter; "undecided" if the study ended early or lacks numbers
        that the claim needs.
    """
    verdicts = []
    for claim, sentence in CLAIMS.items():
        parts = [part for part in comparison.study.parts if claim in part.decides]
        titles = [part.title for part in parts]
        if not titles and claim not in comparison.study.decides:
            continue
        planned = sum(part.cases * len(part.motions) for part in parts)
        done = sum(row.part in titles for row in comparison.rows)
        if comparison.status != "finished" and done < planned:  # an incomplete set of numbers is not conclusive
            outcome = undecided(f"{planned - done} of its {planned} navigations were not reached")
        elif claim in _COMPUTED:
            outcome = _COMPUTED[claim]()
        else:
            outcome = _DECIDERS[claim](_evidence(comparison, titles))
        points, judged = tuple(p.text for p in outcome.points), tuple(p.verdict for p in outcome.points)
        verdicts.append(
            Verdict(
                claim, sentence, outcome.verdict, outcome.reason, points, outcome.numbers, judged, outcome.measured,
                outcome.expected,
            )
        )  # fmt: skip
    return verdicts


def _evidence(comparison: StudyResult, titles: list[str]) -> Evidence:
    rows = [row for row in comparison.rows if row.part in titles and row.status == "done"]
    return Evidence(
        rows,
        {row.motion: comparison.motions[row.part, row.motion] for row in rows},
        comparison.history_or_none,
        [heading for heading in comparison.headings if heading.part in titles],
    )
