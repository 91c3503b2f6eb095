"""The [ensemble] section of a scenario: many runs that differ in their random numbers and in chosen keys."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sinssim.section import Duration, Positive, Section, once

MOST_RUNS = 10_000_000
Runs = Annotated[int, Field(ge=1, le=MOST_RUNS)]
VariedKey = Annotated[str, Field(min_length=1, max_length=200)]


class Normal(Section):
    """A key with normally distributed values."""

    type: Literal["normal"]
    key: VariedKey = Field(description="key that varies from run to run, in the form of --set")
    mean: float = Field(description="mean over the runs, in the key's unit")
    sigma: Positive = Field(description="1σ, in the key's unit")


class Uniform(Section):
    """A key with uniformly distributed values."""

    type: Literal["uniform"]
    key: VariedKey = Field(description="key that varies from run to run, in the form of --set")
    low: float = Field(description="smallest value")
    high: float = Field(description="largest value")

    @model_validator(mode="after")
    def _low_is_below_high(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} must be less than high = {self.high:g}")
        return self


class Choice(Section):
    """A key that takes one of several values in each run with equal probability."""

    type: Literal["choice"]
    key: VariedKey = Field(description="key that varies from run to run, in the form of --set")
    values: tuple[int | float, ...] = Field(min_length=1, description="the values")


Variation = Annotated[Normal | Uniform | Choice, Field(discriminator="type")]


class EnsembleSection(Section):
    """Settings of `sinssim ensemble`, which runs this scenario many times; `sinssim run` does not use them."""

    runs: Runs = Field(default=1000, description="number of runs; the option --runs replaces it")
    epoch_s: Duration | None = Field(
        default=None,
        description="time between the epochs at which errors are kept; default: about 500 epochs over the run",
    )
    solution: str | None = Field(
        default=None,
        description='solution whose errors are kept: one of navigation.algorithms, or "aided"; default: "aided" with '
        "[filter], else the first of the algorithms",
    )
    vary: Annotated[tuple[Variation, ...], once("key", lambda one: one.key)] = Field(
        default=(),
        description="keys that differ from run to run, in addition to the random numbers that depend on the seed",
    )
