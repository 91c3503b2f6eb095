"""The members of an ensemble: seed, varied keys and scenario of each run."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from sinssim.scenario.sections.ensemble import Choice, Normal, Uniform

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

_SEED_BITS = 53
"""Bits of a run's seed: every JSON reader keeps them, and two of 10⁵ runs share a seed with a probability of 6e-7."""


def run_seed(seed: int, number: int) -> int:
    """Return the seed of a run of an ensemble; it depends on the ensemble's seed and the run's number alone.

    Args:
        seed: the ensemble's seed, that of its scenario.
        number: number of the run, from 0.

    Returns:
        A whole number below 2⁵³: the first bits of the SHA-256 digest of both numbers.
    """
    digest = hashlib.sha256(f"sinssim ensemble {seed} run {number}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> (64 - _SEED_BITS)


@dataclass(frozen=True)
class Member:
    """One run of an ensemble.

    Attributes:
        number: its number, from 0.
        seed: its seed.
        values: values of the varied keys, by key.
        base: the scenario of the ensemble.
    """

    number: int
    seed: int
    values: dict[str, float | int]
    base: Scenario

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario of this run: that of `sinssim run` with `settings`.

        Raises:
            InputError: a value of a varied key is not allowed.
        """
        alone = {"seed": self.seed, "ensemble": None}
        if not self.values:
            return self.base.model_copy(update=alone)
        from pydantic import ValidationError

        from sinssim.errors import InputError
        from sinssim.mistakes import report
        from sinssim.scenario.variation import with_values

        contents = with_values(self.base.contents(without=("ensemble",)), {"seed": self.seed, **self.values})
        try:
            return type(self.base).model_validate(contents)
        except ValidationError as error:
            raise InputError(report(error, type(self.base), {}, (), "a varied key")) from error

    @property
    def settings(self) -> list[str]:
        """Settings "key=value" that make the ensemble's scenario the one of this run, as for --set."""
        return [f"seed={self.seed}", *(f"{key}={value!r}" for key, value in self.values.items())]


def member(scenario: Scenario, number: int) -> Member:
    """Return a run of an ensemble.

    Args:
        number: number of the run, from 0.
    """
    seed = run_seed(scenario.seed, number)
    vary = () if scenario.ensemble is None else scenario.ensemble.vary
    return Member(number, seed, {one.key: _drawn(one, seed) for one in vary}, scenario)


def _drawn(one: Normal | Uniform | Choice, seed: int) -> Any:
    """Return the value of a varied key in the run of a seed."""
    from scipy.special import ndtr

    from sinssim.statistics.random_numbers import normals

    normal = float(normals(seed, f"vary {one.key}", 0, 1)[0])
    uniform = float(ndtr(normal))
    match one:
        case Normal():
            return one.mean + one.sigma * normal
        case Uniform():
            return one.low + (one.high - one.low) * uniform
        case Choice():
            return one.values[min(int(uniform * len(one.values)), len(one.values) - 1)]
