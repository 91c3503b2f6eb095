"""The scenario: one run, described by the tables of its file, and the keys of these tables.

`sinssim check --keys` and the site show the keys."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import tomli_w

from sinssim.data import html_lines
from sinssim.errors import InputError, shortened
from sinssim.logs.log_settings import Log
from sinssim.logs.track import Track
from sinssim.scenario.dependencies import DEPENDENCIES
from sinssim.scenario.tables import AnyClosedForm, Tables
from sinssim.truth.flight.flight import Flight
from sinssim.truth.motions.parked_and_great_circle import GreatCircleFlight, ParkedVehicle
from sinssim.truth.motions.rocket import Rocket
from sinssim.truth.motions.surface_vehicles import Drive, Voyage
from sinssim.truth.motions.turntable import Turntable
from sinssim.truth.one_component import OneComponent


class Scenario(Tables):
    """One run: a true motion, the IMU that measures it, and the algorithms that navigate with its measurements.

    Exactly one of `flight`, `parked`, `great_circle`, `motion`, `track`, `drive`, `voyage`, `rocket` and `turntable`
    gives the true motion, or `log` has recorded sensors, or `one_component` describes a run in a vertical plane, with
    its own sensors.
    """

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            name: str,
            flight: Flight | None = None,
            parked: ParkedVehicle | None = None,
            great_circle: GreatCircleFlight | None = None,
            motion: AnyClosedForm | None = None,
            track: Track | None = None,
            drive: Drive | None = None,
            voyage: Voyage | None = None,
            rocket: Rocket | None = None,
            turntable: Turntable | None = None,
            log: Log | None = None,
            one_component: OneComponent | None = None,
            **others: Any,
        ) -> None: ...

    rules = DEPENDENCIES

    def __repr__(self) -> str:
        given = {*self.model_fields_set, self.source.table} | ({"turntable"} if self.sequence is not None else set())
        there = [name for name in self.file_keys() if name in given and name != "name"]
        return f"Scenario({self.name}: {', '.join(there)}; print(scenario.to_toml()) shows all)"

    def _repr_html_(self) -> str:
        """Return the plan for a notebook, as `sinssim check` prints it."""
        from sinssim.scenario.plan_summary import plan_lines

        return html_lines(plan_lines(self))


_TAGS = ("type", "on")
"""Keys that say which kind of table a table is."""


@dataclass(frozen=True)
class Key:
    """A key of a table."""

    name: str  # the key
    field: dict[str, Any]  # its part of the JSON schema
    required: bool  # whether it has to be given
    default: Any  # what it is if it is left out; None for nothing
    limits: str  # allowed values in words; "" if `about` says them
    about: str  # what it is

    @property
    def notes(self) -> str:
        """Meaning and limits in one sentence."""
        text = "; ".join(part for part in (self.about, self.limits) if part)
        return f"required: {text}".removesuffix(": ") if self.required else text


@dataclass(frozen=True)
class KeyTable:
    """One table, or one kind of a table that has several."""

    path: str  # its path, for example "flight.legs"; "" for the top level
    array: bool  # whether the file may have several of it, [[flight.legs]]
    kind: int  # number among the kinds of a table of which there can be one only
    model: str  # name of its class
    tag: str  # value of the key that says which kind it is; "" without one
    about: str  # what it is
    keys: tuple[Key, ...]  # its keys, without the tables in it


def key_tables() -> Iterator[KeyTable]:
    """Yield the tables of a scenario, the top level first, each before the tables in it."""
    schema = Scenario.model_json_schema()
    yield from _table("", {**schema, "description": "", "model": "Scenario"}, schema["$defs"])


def keys_under(place: str) -> list[KeyTable]:
    """Return the tables at or below a place, each with its keys.

    The place is the path of a table ("imu", "flight.legs"), or of a key or its beginning in it ("imu.gyro_bias"); then
    only the keys with this beginning are returned.
    """
    tables = list(key_tables())
    below = [table for table in tables if f"{table.path}.".startswith(f"{place}.")]
    holder, _, begin = place.rpartition(".")
    for table in tables:
        if table.path == holder and (keys := tuple(key for key in table.keys if begin and key.name.startswith(begin))):
            below.append(KeyTable(table.path, table.array, table.kind, table.model, table.tag, table.about, keys))
    if below:
        return below
    paths = {table.path for table in tables} | {
        f"{table.path}.{key.name}".lstrip(".") for table in tables for key in table.keys
    }
    near = difflib.get_close_matches(place, sorted(paths - {""}), 5, cutoff=0.0)
    raise InputError(f"a scenario has no table or key {shortened(repr(place))}; the nearest: {', '.join(near)}.")


def toml_lines(
    table: KeyTable, value_of: Callable[[Key], Any] | None = None, chosen: Collection[str] = ()
) -> Iterator[str]:
    """Yield a table in the notation of TOML, each key with its meaning; one without a default is a comment.

    `value_of` returns the value of a key that is shown, by default its default, and `chosen` names the keys without a
    default that are no comments.
    """
    rows = []
    for key in table.keys:
        value = key.default if value_of is None else value_of(key)
        text = f"{key.name} = {value_text(value, key.field)}"
        shown = key.required or key.default is not None or key.name in chosen
        rows.append((text if shown else f"# {text}", key.notes))
    width = min(44, max((len(text) for text, _ in rows), default=0))
    if table.about:
        yield f"# {table.about}"
    if table.path:
        yield f"[[{table.path}]]" if table.array else f"[{table.path}]"
    yield from (f"{text:<{width}}  # {notes}".rstrip(" #") for text, notes in rows)
    yield ""


def value_text(value: Any, field: dict[str, Any] | None = None) -> str:
    """Return a value in the notation of TOML; of None, zeros of the field's type."""
    field = field or {}
    if value is None:
        count = field.get("minItems", 0)
        value = [0.0] * count if field.get("type") == "array" else 0.0 if field.get("type") == "number" else 0
    if isinstance(value, dict):
        return "{ " + ", ".join(f'"{key}" = {value_text(item)}' for key, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(value_text(item) for item in value) + "]"
    return tomli_w.dumps({"x": value}).removeprefix("x = ").strip()


def _resolve(schema: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    """Follow a reference, and drop the "or nothing" of an optional value."""
    for option in schema.get("anyOf", []):
        if option.get("type") != "null":
            return {**_resolve(option, definitions), **{k: v for k, v in schema.items() if k != "anyOf"}}
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[-1]
        return {**definitions[name], "model": name, **{k: v for k, v in schema.items() if k != "$ref"}}
    return schema


def _about(docstring: str) -> tuple[str, dict[str, str]]:
    """Split a docstring into what stands before its attributes, and the attributes' explanations."""
    text, _, attributes = docstring.partition("Attributes:")
    explanations = {}
    for names, explanation in re.findall(r"^    ([\w*, ]+): (.*(?:\n {8}.*)*)", attributes, re.MULTILINE):
        for name in names.split(", "):
            explanations[name] = " ".join(explanation.split()).rstrip(".").replace("None: ", "default: ")
    return " ".join(text.split()), explanations


def _limits(schema: dict[str, Any]) -> str:
    if "enum" in schema:
        return " or ".join(f'"{value}"' for value in schema["enum"])
    low, high, above = (schema.get(key) for key in ("minimum", "maximum", "exclusiveMinimum"))
    if low is not None and high is not None:
        return f"{low:g} … {high:g}"
    words = [("at least", low), ("more than", above), ("at most", high)]
    return ", ".join(f"{word} {value:g}" for word, value in words if value is not None)


def _is_table(field: dict[str, Any]) -> bool:
    items = field.get("items", {})
    return "properties" in field or "oneOf" in field or "oneOf" in items or "$ref" in items


def _table(
    path: str, model: dict[str, Any], definitions: dict[str, Any], *, array: bool = False, tag: str = "", kind: int = 0
) -> Iterator[KeyTable]:
    """Yield one table, then the tables in it."""
    about, attributes = _about(model.get("description", ""))
    keys: list[Key] = []
    inner: list[tuple[str, dict[str, Any]]] = []
    for name, raw in model["properties"].items():
        field = _resolve(raw, definitions)
        if _is_table(field):
            inner.append((name, field))
            continue
        explanation = raw.get("description") or attributes.get(name, "")
        if not explanation:  # the sensor block explains all its "_sigma_" keys in one sentence
            explanation = attributes.get("*_sigma_*", "") if "_sigma_" in name else ""
        limits = _limits(field)
        if limits in explanation or ("enum" in field and all(option in explanation for option in field["enum"])):
            limits = ""
        default = tag if name in _TAGS and tag else raw.get("default")
        keys.append(Key(name, field, name in model.get("required", []), default, limits, explanation))
    # What a table is comes first, the patience it is given last.
    keys.sort(key=lambda key: (key.name not in _TAGS, key.name.startswith("timeout_s")))
    yield KeyTable(path, array, kind, model.get("model", ""), tag, about, tuple(keys))
    for name, field in inner:
        yield from _inner(f"{path}.{name}".lstrip("."), field, definitions)


def _inner(path: str, field: dict[str, Any], definitions: dict[str, Any]) -> Iterator[KeyTable]:
    items = field.get("items")
    union = items or field
    members = [option["$ref"].rsplit("/", 1)[-1] for option in union.get("oneOf", [])]
    if members:
        mapping = union["discriminator"]["mapping"]
        tags = {mapping[tag].rsplit("/", 1)[-1]: tag for tag in reversed(mapping)}
        for number, name in enumerate(members):
            model = {**definitions[name], "model": name}
            yield from _table(path, model, definitions, array=bool(items), tag=tags[name], kind=number)
    elif items:
        yield from _table(path, _resolve(items, definitions), definitions, array=True)
    else:
        yield from _table(path, field, definitions)
