"""The section [ensemble] of a scenario: many runs that differ in random numbers and in varied keys.

The varied keys are checked, and set in a scenario's contents, here.
"""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self, Union, get_args, get_origin

from pydantic import Field, ValidationError, model_validator

from sinssim.errors import InputError, shortened, unknown_name
from sinssim.toml_mistakes import Table, describe
from sinssim.toml_section import Duration, Positive, Section, once

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
        description="solution whose errors are kept: one of navigation.algorithms, the name of a [[navigator]], or "
        '"aided"; default: "aided" with [filter], else the first of the algorithms',
    )
    vary: Annotated[tuple[Variation, ...], once("key", lambda variation: variation.key)] = Field(
        default=(),
        description="keys that differ from run to run, in addition to the random numbers that depend on the seed",
    )


_NOT_VARIED = {
    "seed": "the seed of each run follows from the ensemble's seed",
    "ensemble": "an ensemble does not vary itself",
}


def check_variation(scenario: Table, section: EnsembleSection, contents: dict[str, Any]) -> None:
    """Check that the varied keys exist, are numbers, and may have the values of their distributions.

    The scenario is otherwise valid; its contents are those of its file by key, without [ensemble].
    """
    for number, variation in enumerate(section.vary, start=1):
        where = f"vary.{number}: key = {shortened(repr(variation.key))}"
        whole = _check_key(scenario, variation.key, where)
        for name, value in _extremes(variation, where, whole):
            try:
                type(scenario).model_validate(with_values(contents, {variation.key: value}))
            except ValidationError as error:
                mistakes, _ = describe(error.errors(include_url=False), type(scenario), {}, ())
                raise ValueError(f"{where} cannot have the value {name} = {value:g}: {mistakes[0]}") from error


def with_values(contents: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's contents with other values of some keys (contents by key; unchanged; values by the path of
    their key; entries of arrays are counted from 1)."""
    new = dict(contents)
    for path, value in values.items():
        *tables, key = path.split(".")
        here: Any = new
        for name in tables:
            place: Any = int(name) - 1 if isinstance(here, list) else name
            here[place] = _copy(here[place] if isinstance(here, list) else here.get(name, {}))
            here = here[place]
        here[int(key) - 1 if isinstance(here, list) else key] = value
    return new


def _copy(table: Any) -> Any:
    return dict(table) if isinstance(table, Mapping) else list(table)


def _extremes(variation: Normal | Uniform | Choice, where: str, whole: bool) -> Iterator[tuple[str, float]]:
    """Yield the values of a distribution that must be allowed, with the key that gives each."""
    if whole and not (isinstance(variation, Choice) and all(isinstance(value, int) for value in variation.values)):
        raise ValueError(f'{where} is a whole number: use type = "choice" with whole numbers, for example [1, 2, 3]')
    match variation:
        case Normal():
            yield "mean", variation.mean
        case Uniform():
            yield "low", variation.low
            yield "high", variation.high
        case Choice():
            for number, value in enumerate(variation.values, start=1):
                yield f"values.{number}", value


def _check_key(scenario: Table, path: str, where: str) -> bool:
    """Raise unless a path leads to a number of the scenario; return whether it is a whole number."""
    names = path.split(".")
    if names[0] in _NOT_VARIED:
        raise ValueError(f"{where} cannot be varied: {_NOT_VARIED[names[0]]}")
    here: Any = scenario
    annotation: Any = None
    for index, name in enumerate(names):
        above = ".".join(names[:index])
        if isinstance(here, Table):
            fields = type(here).file_keys()
            if name not in fields:
                raise ValueError(f"{where}: {_unknown(name, above, fields)}")
            annotation, here = fields[name].annotation, getattr(here, name)
        elif isinstance(here, tuple):
            if not name.isdecimal() or not 1 <= int(name) <= len(here):
                raise ValueError(f"{where}: {above} has entries 1 to {len(here)}; {name!r} is not one of them")
            here = here[int(name) - 1]
            annotation = type(here)
        elif here is None:
            raise ValueError(f"{where}: the scenario has no value for {above}{_write(scenario, above, annotation)}")
        else:
            raise ValueError(f"{where}: {above} is a value, not a table")
    kinds = set(_types(annotation))
    number = isinstance(here, int | float) and not isinstance(here, bool)
    if not (number or (here is None and kinds & {int, float})):
        if here is None:
            raise ValueError(f"{where} has no value in the scenario{_write(scenario, path, annotation)}")
        if isinstance(here, tuple) and here and isinstance(here[0], int | float):
            raise ValueError(f"{where} has {len(here)} entries; vary one of them: {path}.1 to {path}.{len(here)}")
        shown = "a table" if isinstance(here, Table) else shortened(repr(here), 40)
        raise ValueError(f"{where} is {shown}, not a number; only numbers can be varied")
    return int in kinds and float not in kinds


def _write(scenario: Table, path: str, annotation: Any) -> str:
    """Return what to write for a key that is left out, so that its entries can be varied."""
    *tables, key = path.split(".")
    arrays = [get_args(kind) for kind in _types(annotation) if get_origin(kind) is tuple]
    if not arrays or Ellipsis in arrays[0] or set(map(_number, arrays[0])) != {True}:
        return "; give it one first"
    zeros = ", ".join("0.0" for _ in arrays[0])
    place = f"[{'.'.join(tables)}]" if tables else "the scenario"
    entries = f"{path}.1 to {path}.{len(arrays[0])}"
    above: Any = scenario
    for name in tables:
        above = getattr(above, name, None)
    words = key.split("_")
    siblings = ("_".join([*words[:i], "sigma", *words[i:]]) for i in range(1, len(words)))
    sigma = next((name for name in siblings if isinstance(above, Table) and name in above.file_keys()), "")
    if not sigma:
        return f": give {key} its {len(arrays[0])} numbers in {place} first, and vary {entries}"
    return (
        f": write {key} = [{zeros}] in {place} and vary {entries}; with {sigma} beside it the errors of the runs are "
        "still drawn, about it"
    )


def _number(annotation: Any) -> bool:
    return bool(set(_types(annotation)) & {int, float})


def _unknown(name: str, above: str, known: Mapping[str, Any]) -> InputError:
    return unknown_name(f"key of {above or 'the scenario'}", name, known)


def _types(annotation: Any) -> Iterator[Any]:
    """Unfold Annotated and unions."""
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from _types(get_args(annotation)[0])
    elif origin in (Union, types.UnionType):
        for option in get_args(annotation):
            yield from _types(option)
    else:
        yield annotation
