"""The file of a trade study: a scenario, the keys that vary in a grid, and what is computed in each cell."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from sinssim.errors import shortened
from sinssim.scenario.ensemble_section import Runs
from sinssim.statistics.requirements import Quantity, Requirement, parse_quantity, parse_requirement, quantity_of
from sinssim.toml_section import ExperimentFile, Keys, Moment, Section

_PRETTY = {
    "arcmin": "arcmin", "arcsec": "arcsec", "c": "°C", "deg": "deg", "deg2": "deg²", "g": "g", "g2": "g²", "g3": "g³",
    "h": "h", "hz": "Hz", "kt": "kt", "m": "m", "mm": "mm", "mm2": "mm²", "mps": "m/s", "mps2": "m/s²", "ms": "ms",
    "nm": "nm", "percent": "%", "ppm": "ppm", "s": "s", "s2": "s²", "ug": "µg",
}  # fmt: skip
"""Units in the names of keys, as they are printed."""
_WITHIN = {*_PRETTY, "sqrt", "per"}
_PLAIN = ("imu", "navigation", "flight")
"""Tables whose keys are clear without the table's name."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def unit_of(key: str) -> str:
    """Return the unit in the name of a key: "imu.gyro_bias_sigma_deg_h" → "deg/h"; "" without one."""
    name, tokens = _split(key.rpartition(".")[2])
    text, link = "", ""
    for token in tokens:
        if token in ("sqrt", "per"):
            link = "/√" if token == "sqrt" else "/"
        else:
            text += (link or ("/" if text else "")) + _PRETTY[token]
            link = ""
    return text if name else ""


def label_of(key: str) -> str:
    """Return the words of a key without its unit: "aiding.gnss.position_sigma_m" → "gnss position σ".

    The table's name is left out where the key is clear without it.
    """
    *tables, name = key.split(".")
    words = _split(name)[0]
    plain = words != "rate"  # a quantity of the tables, too
    above = [table for table in tables[-2:] if not (plain and table in _PLAIN and len(tables) == 1)]
    if above and (above[-1].isdecimal() or len(above) == 1):
        words = f"{' '.join(above)} {words}"
    elif above:
        words = f"{above[-1]} {words}"
    return re.sub(r"\bsigma\b", "σ", words.replace("_", " "))


def _split(name: str) -> tuple[str, list[str]]:
    """Return a key's name without its unit, and the parts of the unit."""
    tokens = name.split("_")
    for first in range(1, len(tokens)):
        if tokens[first] in _PRETTY and all(token in _WITHIN for token in tokens[first:]):
            return "_".join(tokens[:first]), tokens[first:]
    return name, []


def toml_text(value: Any) -> str:
    """Return a value as TOML in one line, as `--set` takes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_text, value))}]"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_key_text(str(key))} = {toml_text(item)}' for key, item in value.items())}}}"
    return repr(value)


def _key_text(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key)


def value_text(value: Any) -> str:
    """Return a value as people read it: "0.01", "on", "tactical" or "[1, 2]"."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, str):
        return value
    if isinstance(value, int | float):
        return f"{value:.10g}".replace("-", "−") if isinstance(value, float) else str(value).replace("-", "−")
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(value_text, value))}]"
    return toml_text(value)


MOST_CELLS = 1000
"""Most cells of a grid: tables and pictures of more are no longer read."""

_WITHOUT_EFFECT = {
    "name": "it is the name of the scenario and changes no number",
    "description": "it changes no number",
    "views": "it changes no number",
    "use": "it names files; vary the names that they bring",
    "output": "a cell writes no streams",
    "recording": "a cell writes no run directory",
    "one_component": "a one-component run has no budget and no ensemble",
}
"""Keys of a scenario that a study cannot vary, and why."""

STANDARD = (
    "cep", "r95", "rate", "velocity_north", "velocity_east", "velocity_down", "tilt_north", "tilt_east", "heading",
    "position_north", "position_east", "position_down",
)  # fmt: skip
"""The quantities of every cell, at the end and at each of the study's times."""


def _requirement(text: str) -> str:
    parse_requirement(text)
    return text


def _quantity(text: str) -> str:
    parse_quantity(text)
    return text


Key = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\s=]+$")]


class Axis(Section):
    """One axis of the grid: a key with its values, or several keys that change together."""

    exactly_one = (Keys(("key", "keys"), "an axis needs key = …, or keys = […] for keys that change together"),)

    key: Key | None = Field(default=None, description="key of the scenario, as for --set")
    keys: tuple[Key, ...] = Field(default=(), description="keys that change together; each value is then an array")
    values: tuple[Any, ...] = Field(min_length=1, description="values of the key, as in the scenario's file")
    labels: tuple[str, ...] = Field(default=(), description="names of the values in tables and pictures")
    label: str = Field(default="", description="name of the axis; default: the words of its key")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if len(self.keys) == 1:
            raise ValueError(f"keys has a single key; write key = {self.keys[0]!r}, and its values without brackets")
        if len(set(self.keys)) < len(self.keys):
            raise ValueError(f"keys contains {next(k for k in self.keys if self.keys.count(k) > 1)!r} twice")
        for number, value in enumerate(self.values, start=1):
            if self.keys and not (isinstance(value, tuple) and len(value) == len(self.keys)):
                raise ValueError(
                    f"values.{number} = {shortened(value_text(value))} must be an array of {len(self.keys)} values, "
                    "one for each of keys"
                )
            for before, other in enumerate(self.values[: number - 1], start=1):
                if _same(value, other):
                    raise ValueError(f"values.{before} and values.{number} are both {shortened(value_text(value))}")
        if self.labels and len(self.labels) != len(self.values):
            raise ValueError(f"labels has {len(self.labels)} names for {len(self.values)} values; give one for each")
        if len(set(self.labels)) < len(self.labels):
            raise ValueError(f"labels contains {next(n for n in self.labels if self.labels.count(n) > 1)!r} twice")
        return self

    @property
    def paths(self) -> tuple[str, ...]:
        """The keys."""
        return self.keys if self.key is None else (self.key,)

    def settings(self, place: int) -> tuple[tuple[str, Any], ...]:
        """Return the keys with their values at a place of the axis, counted from 0."""
        value = self.values[place]
        return tuple(zip(self.keys, value, strict=True)) if self.key is None else ((self.key, value),)

    @property
    def numeric(self) -> bool:
        """Whether its values are numbers that stand for themselves."""
        numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.values)
        return self.key is not None and not self.labels and numbers

    @property
    def logarithmic(self) -> bool:
        """Whether a logarithmic scale suits its numbers: positive, and spanning more than a factor of eight."""
        return self.numeric and min(self.values) > 0 and max(self.values) > 8.0 * min(self.values)

    @property
    def title(self) -> str:
        """Its name, without a unit."""
        return self.label or " & ".join(map(label_of, self.paths))

    @property
    def unit(self) -> str:
        """Unit of its numbers; "" without one."""
        return unit_of(self.key) if self.key is not None and self.numeric else ""

    @property
    def heading(self) -> str:
        """Its name with the unit: "gyro bias sigma, deg/h"."""
        return f"{self.title}, {self.unit}" if self.unit else self.title

    def name_of(self, place: int) -> str:
        """Return the name of the value at a place, counted from 0, without a unit."""
        if self.labels:
            return self.labels[place]
        value = self.values[place]
        return " & ".join(map(value_text, value)) if self.keys else value_text(value)


class TradeStudy(ExperimentFile):
    """A trade study: every combination of the values of its axes."""

    rules = (
        (lambda s: s.cell == "budget" and s.runs is not None,
         'runs = {s.runs} has no effect on budgets; it belongs to cell = "ensemble"'),
        (lambda s: s.cell == "ensemble" and s.inertial,
         'inertial = true belongs to budgets; for ensembles set ensemble.solution: set = ["ensemble.solution='
         'quaternion"]'),
    )  # fmt: skip

    scenario: str = Field(min_length=1, description="a scenario's file, or a name from `sinssim list scenarios`")
    set: tuple[str, ...] = Field(default=(), description='keys that are the same in every cell, each "key.path=value"')
    cell: Literal["budget", "ensemble"] = Field(
        default="budget", description="what a cell is: a covariance budget, or an ensemble of runs"
    )
    runs: Runs | None = Field(
        default=None, description="number of runs of each ensemble; default: that of `sinssim ensemble`"
    )
    inertial: bool = Field(
        default=False, description="budgets of inertial navigation without the filter of the scenario"
    )
    times_s: tuple[Moment, ...] = Field(
        default=(), description="times since the start at which errors are given, in addition to the end"
    )
    require: tuple[Annotated[str, AfterValidator(_requirement)], ...] = Field(
        default=(), description='requirements judged in every cell: "r95(3600 s) <= 1852 m"'
    )
    draw: tuple[Annotated[str, AfterValidator(_quantity)], ...] = Field(
        default=(),
        description='quantities of the pictures: "r95(end)", "heading(1800 s)"; default: those of the requirements, '
        "or R95 at the end",
    )
    axes: tuple[Axis, ...] = Field(min_length=1, description="the axes of the grid")

    @model_validator(mode="after")
    def _keys_once(self) -> Self:
        fixed = [setting.partition("=")[0].strip() for setting in self.set]
        varied: list[tuple[str, str]] = []
        for number, axis in enumerate(self.axes, start=1):
            for path in axis.paths:
                where = f"axes.{number}: the key {path!r}"
                if reason := _WITHOUT_EFFECT.get(path.split(".")[0]):
                    raise ValueError(f"{where} cannot be varied: {reason}")
                if path == "ensemble.runs":
                    raise ValueError(f"{where} cannot be varied: every ensemble has the number of runs of the study")
                if path.split(".")[0] == "ensemble" and self.cell == "budget":
                    raise ValueError(f'{where} has no effect on a budget; it belongs to cell = "ensemble"')
                for other in fixed:
                    if _overlap(path, other):
                        raise ValueError(f'{where} is fixed by set = ["{other}=…"], too: fix it, or vary it')
                for other, place in varied:
                    if _overlap(path, other):
                        raise ValueError(f"{where} is varied by {place}, too ({other!r}); give each key once")
                varied.append((path, f"axes.{number}"))
        return self

    @model_validator(mode="after")
    def _everything_is_used(self) -> Self:
        for name in ("times_s", "require", "draw", "set"):
            values = getattr(self, name)
            for value in values:
                if values.count(value) > 1:
                    raise ValueError(f"{name} contains {value!r} twice; give it once")
        titles = [axis.label or axis.heading for axis in self.axes]
        for title in titles:
            if titles.count(title) > 1:
                raise ValueError(f"two axes have the name {title!r}; distinguish them with label = …")
        if self.size > MOST_CELLS:
            product = " × ".join(str(len(axis.values)) for axis in self.axes)
            raise ValueError(
                f"the grid has {product} = {self.size} cells, which take {self.size / 60.0:.0f} min at one second "
                f"each, and at most {MOST_CELLS} are allowed; give fewer values, or link axes with keys = […]"
            )
        return self

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def size(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """The requirements."""
        return tuple(map(parse_requirement, self.require))

    def settings(self, place: Iterable[int]) -> dict[str, Any]:
        """Return the varied keys of a cell with their values, by its place on each axis."""
        return dict(pair for axis, k in zip(self.axes, place, strict=True) for pair in axis.settings(k))

    @property
    def drawn(self) -> tuple[Quantity, ...]:
        """The quantities of the pictures."""
        if self.draw:
            return tuple(dict.fromkeys(map(parse_quantity, self.draw)))
        return tuple(dict.fromkeys(map(quantity_of, self.requirements))) or (Quantity("r95", "end"),)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Every quantity of a cell: the standard ones at the end and at the study's times, and the requested ones."""
        instants = [("end", 0.0), *(("at", t) for t in self.times_s)]
        standard = [Quantity(name, when, t) for when, t in instants for name in STANDARD  # type: ignore[arg-type]
                    if not (name == "rate" and when == "at" and t == 0.0)]  # fmt: skip
        return tuple(dict.fromkeys((*standard, *map(quantity_of, self.requirements), *self.drawn)))

    @property
    def instants(self) -> tuple[float, ...]:
        """Times since the start at which errors are computed, s."""
        return tuple(sorted({q.time for q in self.quantities if q.when == "at"}))

    def with_requirements(self, texts: Iterable[str]) -> TradeStudy:
        """Return the study with further requirements, `texts`, without those that it has."""
        added = tuple(dict.fromkeys(text for text in texts if text not in self.require))
        for text in added:
            parse_requirement(text)
        if not added:
            return self
        contents = self.model_dump(exclude_unset=True)
        return TradeStudy(**{**contents, "require": (*self.require, *added)})


def _same(a: Any, b: Any) -> bool:
    """Return whether two values are the same for a scenario; 1 and true are not."""
    return isinstance(a, bool) == isinstance(b, bool) and bool(a == b)


def _overlap(a: str, b: str) -> bool:
    """Return whether two keys are the same, or one is a table that holds the other."""
    return a == b or a.startswith(f"{b}.") or b.startswith(f"{a}.")
