"""No verdict of the study chapter_claims turns with a seed or with a duration."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from sinssim.experiments.studies.algorithm_comparison import compare
from sinssim.experiments.studies.study_schema import COMPUTED, Part, Study, StudyMotion
from sinssim.experiments.study import load_study
from tests.experiments.studies.test_rates import VERDICTS
from tests.slow import slow

pytestmark = pytest.mark.usefixtures("hardly_counted")

SEEDS = (1, 2, 3, 4, 5)
"""Of turbulence and of band-limited vibration, and of the study's sensor errors."""
SHARES = (0.7, 0.85, 1.0)
"""Durations, relative to the shipped ones: each still contains the manoeuvres on which a claim is decided."""
HOURS = (3.5, 4.0, 5.0)
"""Durations of the block without gyros, which needs more than one and a half Schuler periods."""
PERIODS = (5064.0, 7600.0, 10_128.0)
"""Durations of motions that decide by one Schuler period."""

SHIPPED = load_study("chapter_claims")


def verdicts(parts: Iterator[Part] | list[Part], seed: int = 0) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Return the verdict on each claim, and on each of its points, of some parts."""
    study = Study.model_validate(
        {**SHIPPED.model_dump(exclude={"parts", "decides"}, exclude_none=True), "seed": seed, "parts": tuple(parts)}
    )
    return {verdict.claim: (verdict.verdict, verdict.judged) for verdict in compare(study).verdicts}


def changed(part: Part, change: Callable[[StudyMotion], dict[str, Any]], **more: Any) -> Part:
    """Return a part with changed motions."""
    motions = tuple(motion.model_copy(update=change(motion)) for motion in part.motions)
    return part.model_copy(update={"motions": motions, **more})


def seeded(seed: int) -> Callable[[StudyMotion], dict[str, Any]]:
    return lambda motion: {"set": (*motion.set, f"seed={seed}")} if motion.scenario else {}


def lasting(number: int) -> Callable[[StudyMotion], dict[str, Any]]:
    """Return the change of a motion's duration to the shortest, the middle or the longest one."""

    def change(motion: StudyMotion) -> dict[str, Any]:
        if motion.parked is not None:
            hours = HOURS[number] if motion.parked.duration_s > 10_000.0 else 1.0 + 0.5 * number
            return {"parked": motion.parked.model_copy(update={"duration_s": 3600.0 * hours})}
        if motion.great_circle is not None:
            return {"great_circle": motion.great_circle.model_copy(update={"duration_s": PERIODS[number]})}
        return {"duration_s": SHARES[number] * motion.duration_s} if motion.duration_s else {}

    return change


def of(*claims: str) -> list[Part]:
    return [part for part in SHIPPED.parts if set(claims) & set(part.decides)]


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_no_verdict_turns_with_the_seed(seed):
    found = verdicts([changed(part, seeded(seed)) for part in SHIPPED.parts], seed)
    assert {claim: verdict for claim, (verdict, _) in found.items()} == {
        claim: verdict for claim, verdict in VERDICTS.items() if claim not in COMPUTED
    }
    assert found["attitude-rate"][1] == ("refuted", "refuted", "confirmed", "partly", "partly")


@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
def test_no_verdict_turns_with_the_duration(number):
    found = verdicts(changed(part, lasting(number)) for part in SHIPPED.parts)
    assert {claim: verdict for claim, (verdict, _) in found.items()} == {
        claim: verdict for claim, verdict in VERDICTS.items() if claim not in COMPUTED
    }
    assert found["attitude-rate"][1] == ("refuted", "refuted", "confirmed", "partly", "partly")


@pytest.mark.parametrize("number", [0, *slow(1, 2)])
@pytest.mark.parametrize("by", [("computer-errors", "simplified-radii"), *slow((("gyro-free",),))])
def test_parked_and_great_circles_of_three_durations(number, by):
    """Those that need no flight: simplified radii, the computer and a gyro, latitude; powers of time.

    The powers of time of five hours without gyros are in `test_power_of_time.py`.
    """
    parts = []
    for part in of(*by):
        still = tuple(motion for motion in part.motions if motion.scenario is None)
        fewer = {"rates_hz": (1.0 if "gyro-free" in part.decides else 10.0,), "motions": still}
        parts.append(changed(part.model_copy(update=fewer), lasting(number)))
    found = verdicts(parts)
    claims = by if by == ("gyro-free",) else (*by, "latitude-rate")
    assert {claim: found[claim][0] for claim in claims} == {claim: VERDICTS[claim] for claim in claims}


@pytest.mark.parametrize(("seconds", "seed"), [(40.0, 1), *slow((60.0, 2), (90.0, 3))])
def test_vibration_of_three_durations_and_seeds(seconds, seed):
    """A parked block that rocks by 40″ at 12 Hz: a high order from 50 to 80 Hz, whatever the duration."""
    (part,) = of("attitude-rate")
    (rocking,) = (motion.vibration for motion in part.motions if motion.name == "vibration")
    still = StudyMotion.model_validate(
        {"name": "rocking", "parked": {"latitude_deg": 50.0, "duration_s": seconds}, "vibration": rocking[:2]}
    )
    fewer = {"algorithms": ("quaternion", "rotation-vector-3", "two-quaternions"), "rates_hz": (40.0, 80.0, 400.0)}
    found = verdicts([part.model_copy(update={**fewer, "motions": (still,), "decides": ("attitude-rate",)})], seed)
    assert found == {"attitude-rate": ("confirmed", ("confirmed",))}
