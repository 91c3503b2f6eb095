"""Reads a TOML file into a typed model; its mistakes in sentences, with file, line, key, and what would be right."""

from __future__ import annotations

import difflib
import itertools
import math
import re
import tomllib
import types
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from sinssim.errors import InputError, nearest, respelled, shortened
from sinssim.system.files import read_text

ONE_OF_SEVERAL = "one of several"
"""Name of a field whose value is one of several tables, in the locations of mistakes; no file has it."""

_MANY = 40  # more keys than this are no help in a message

# Units that keys may have, as (dimension, factor to the dimension's base unit).
_UNITS: dict[str, tuple[str, float]] = {
    "m": ("length", 1.0),
    "km": ("length", 1000.0),
    "ft": ("length", 0.3048),
    "nmi": ("length", 1852.0),
    "mps": ("speed", 1.0),
    "kt": ("speed", 1852.0 / 3600.0),
    "kts": ("speed", 1852.0 / 3600.0),
    "kmh": ("speed", 1.0 / 3.6),
    "fps": ("speed", 0.3048),
    "fpm": ("speed", 0.3048 / 60.0),
    "deg": ("angle", 1.0),
    "rad": ("angle", math.degrees(1.0)),
    "mrad": ("angle", math.degrees(1e-3)),
    "arcmin": ("angle", 1.0 / 60.0),
    "arcsec": ("angle", 1.0 / 3600.0),
    "s": ("time", 1.0),
    "ms": ("time", 1e-3),
    "min": ("time", 60.0),
    "h": ("time", 3600.0),
    "hz": ("frequency", 1.0),
    "khz": ("frequency", 1000.0),
    "deg_h": ("angular rate", 1.0),
    "deg_s": ("angular rate", 3600.0),
    "rad_s": ("angular rate", math.degrees(3600.0)),
    "ug": ("acceleration", 1.0),
    "mg": ("acceleration", 1000.0),
    "ppm": ("ratio", 1.0),
    "percent": ("ratio", 1e4),
}

_SHOWN = 12  # mistakes listed in one message
_LENGTH = 4000  # characters of all of them: two screens
_DESCRIBED = 200  # mistakes described: twenty thousand in one array would take seconds

_BOUNDS = {
    "greater_than": "greater than",
    "greater_than_equal": "at least",
    "less_than": "less than",
    "less_than_equal": "at most",
}
_TYPES = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": 'text in quotes, like "this"',
    "bool_type": "true or false",
    "tuple_type": "an array, like [1.0, 2.0, 3.0]",
    "list_type": "an array, like [1.0, 2.0, 3.0]",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "finite_number": "a finite number",
}


class Table(BaseModel):
    """A table of a file, with what it knows of keys that are not its fields."""

    model_config = ConfigDict(defer_build=True, protected_namespaces=())  # both for the time of a program's start

    @classmethod
    def file_keys(cls) -> dict[str, FieldInfo]:
        """Return the keys that the table may have in a file."""
        return cls.model_fields

    @classmethod
    def own_table(cls, name: str) -> type[Table] | None:
        """Return the class of a table outside the package, for the words of a mistake in it."""
        return None

    @classmethod
    def key_for(cls, given: str) -> str | None:
        """Return the field for a key in another unit; an `InputError` names the units if it cannot have this one."""
        return None

    @classmethod
    def in_words(cls, unknown: str) -> str | None:
        """Return what to give instead of a key that is a word of data sheets."""
        return None


def report(
    error: ValidationError,
    model: type[Table],
    lines: Mapping[tuple[str, ...], int],
    overridden: Collection[str],
    source: str,
) -> str:
    """Return pydantic's errors as one message; `lines` and `overridden` as for `describe`."""
    mistakes, others = describe(error.errors(include_url=False), model, lines, overridden)
    sentences = [text if text.endswith(("?", ".")) else text + "." for text in dict.fromkeys(mistakes)]
    if len(sentences) == 1:
        return f"{source}{', ' if sentences[0].startswith('line ') else ': '}{sentences[0]}"
    count = len(sentences) + others
    ends = itertools.accumulate(map(len, sentences))
    shown = [text for text, end in zip(sentences, ends, strict=True) if end <= _LENGTH][:_SHOWN] or sentences[:1]
    more = [f"… and {count - len(shown)} more."] if count > len(shown) else []
    return "\n  - ".join([f"{source}: {count} mistakes:", *shown, *more])


def describe(
    errors: Sequence[ErrorDetails],
    model: type[Table],
    lines: Mapping[tuple[str, ...], int],
    overridden: Collection[str],
) -> tuple[list[str], int]:
    """Return pydantic's errors as sentences with line, key, what is wrong and the correct form.

    There is one for each of the first two hundred mistakes, and the number of further ones. `lines` has the line of
    every key and table of the file by its path, from `key_lines`.
    """
    # pydantic also reports an array with a bad entry as too short, a misspelt key as missing, and a number that may be
    # whole or not as both; of an array or a text, it names the mistakes of either.
    errors = [{**error, "loc": tuple(part for part in error["loc"] if part != ONE_OF_SEVERAL)} for error in errors]
    parents = {error["loc"][:length] for error in errors for length in range(len(error["loc"]))}
    meant = {
        (*error["loc"][:-1], key)
        for error in errors[:_DESCRIBED]
        if error["type"] == "extra_forbidden" and (key := _nearest(*_walk(error["loc"], model)))
    }
    places = {error["loc"] for error in errors}
    arrays = {loc[:-1] for loc in {*parents, *places} if loc and str(loc[-1]).startswith("tuple[")}
    mistakes = [
        error
        for error in errors
        if not (error["type"] == "too_short" and error["loc"] in parents)
        and not (error["type"] == "missing" and error["loc"] in meant)
        and not (error["type"] == "no_table" and any(key in meant for key in error["ctx"]["tables"]))
        and not (error["loc"][-1:] == ("int",) and (*error["loc"][:-1], "float") in places)
        and not (error["loc"][-1:] == ("str",) and error["loc"][:-1] in arrays)
    ]
    return [_place(error, model, lines, overridden) for error in mistakes[:_DESCRIBED]], len(mistakes[_DESCRIBED:])


def _place(
    error: ErrorDetails,
    model: type[Table],
    lines: Mapping[tuple[str, ...], int],
    overridden: Collection[str],
) -> str:
    path, holders = _walk(error["loc"], model)
    text = _sentence(error, model, path, holders)
    if error["type"] == "value_error":  # of a table, about the key that it begins with
        name = re.match(r"[\w.]+", str(error["ctx"]["error"]))
        key = (*path, *key_parts(name[0])) if name else path
        if key != path and (key in lines or ".".join(key) in overridden):
            text, path = text.replace(": ", ".", 1) if path else text, key
            holders = _models(_types(error["loc"], model))
    if several := error.get("ctx", {}).get("given"):  # one table too many: the last of them in the file
        if {key.partition(".")[0] for key in overridden} & {table for (table,) in several} - {key[0] for key in lines}:
            return f"{text} (set from outside the file)"
        path = max(several, key=lambda table: lines.get(table, 0))
    written = _as_written(path, holders, [*lines, *(tuple(key.split(".")) for key in overridden)])
    if written != path:
        text += f" (given as {'.'.join(written)})"
        path = written
    if error["type"] == "union_tag_invalid":
        path = (*path, str(error["ctx"]["discriminator"]).strip("'"))
    dotted = ".".join(path)
    if any(dotted == key or dotted.startswith(key + ".") for key in overridden):
        if error["type"] in ("tuple_type", "list_type") and isinstance(error["input"], str):
            word = shortened(error["input"])
            return f"{text} (set from outside the file: --set '{dotted}=[\"{word}\"]')"
        return f"{text} (set from outside the file)"
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return f"line {lines[path[:length]]}: {text}"
    return text


def _as_written(path: tuple[str, ...], holders: list[type[Table]], keys: Iterable[tuple[str, ...]]) -> tuple[str, ...]:
    """Return the key as written in the file, for a quantity given in another unit than the table's."""
    for key in keys:
        size = len(key)
        if size <= len(path) and key[:-1] == path[: size - 1] and key[-1] != path[size - 1]:
            with suppress(InputError):
                if any(kind.key_for(key[-1]) == path[size - 1] for kind in holders):
                    return (*key, *path[size:])
    return path


def _sentence(error: ErrorDetails, model: type[Table], path: tuple[str, ...], holders: list[type[Table]]) -> str:
    kind, value, context = error["type"], error["input"], error.get("ctx", {})
    name = ".".join(path)
    if kind == "extra_forbidden":
        return _unknown_key(path, value, holders)
    if kind == "missing" and isinstance(error["loc"][-1], int):
        entries = max(len(get_args(option)) for option in _types(error["loc"][:-1], model))
        return f"{'.'.join(path[:-1])} must have {entries} entries, and has {len(value)}"
    if kind == "missing":
        return f"{name} is missing{_explain(path, holders)}"
    if kind == "tuple_type" and any(_models(list(_entries(option))) for option in _types(error["loc"], model)):
        return f"{name} must be an array of tables, each headed [[{name}]], not {_show(value)}"
    if kind in _BOUNDS:
        bound = next(iter(context.values()))
        return f"{name} = {_show(value)} must be {_BOUNDS[kind]} {bound:g}"
    if kind in ("tuple_type", "list_type") and isinstance(value, str):
        return f'{name} must be an array, like ["{shortened(value)}"], not {_show(value)}'
    if kind in _TYPES:
        return f"{name} must be {_TYPES[kind]}, not {_show(value)}"
    if kind in ("too_short", "too_long"):
        wanted = context.get("min_length", context.get("max_length"))
        word = "at least" if kind == "too_short" else "at most"
        noun = "entry" if wanted == 1 else "entries"
        return f"{name} must have {word} {wanted} {noun}, and has {context['actual_length']}"
    if kind == "string_too_long":
        return f"{name} must have at most {context['max_length']} characters, and has {len(value)}"
    if kind == "string_pattern_mismatch":
        allowed = "may contain only letters, digits, '.', '-' and '_', and must begin with a letter or digit"
        return f"{name} = {_show(value)} {allowed}"
    if kind in ("literal_error", "enum", "union_tag_invalid"):
        given = shortened(str(context["tag"] if kind == "union_tag_invalid" else value))
        known = re.findall(r"'([^']*)'", str(context.get("expected", context.get("expected_tags", ""))))
        near = nearest(given, known)
        hint = f" Did you mean '{near}'?" if near else ""
        key = str(context["discriminator"]).strip("'") if kind == "union_tag_invalid" else ""
        return f"{name}{'.' + key if key else ''} = '{given}' is not known.{hint} Known: {', '.join(known)}"
    if kind == "union_tag_not_found":
        key = str(context["discriminator"]).strip("'")
        return f"{name} lacks the key {key}; it must be one of: {', '.join(_kinds(error['loc'], model))}"
    message = str(context["error"]) if kind == "value_error" else error["msg"]
    return shortened(f"{name}: {message}".removeprefix(": "), 1000).removesuffix(".")


def _nearest(path: tuple[str, ...], holders: list[type[Table]]) -> str | None:
    """Return the intended key: the same quantity in another unit, or the nearest spelling."""
    known = sorted({field for holder in holders for field in holder.file_keys()})
    same = [field for field in known if _same_quantity(path[-1], field) and _split_unit(field)[1]]
    return next(iter(same), None) or nearest(path[-1], known)


def _unknown_key(path: tuple[str, ...], value: object, holders: list[type[Table]]) -> str:
    name, table, meant = ".".join(path), ".".join(path[:-1]), _nearest(path, holders)
    fields = {field for holder in holders for field in holder.file_keys()}
    differs = not _same_quantity(path[-1], meant)
    if differs and (words := next(filter(None, (holder.in_words(path[-1]) for holder in holders)), None)):
        return f"unknown key '{name}' (= {_show(value)}): {words}"
    word = respelled(path[-1])
    with suppress(InputError):
        if word != path[-1] and any(holder.key_for(word) for holder in holders):
            return f"unknown key '{name}'. Did you mean '{'.'.join((*path[:-1], word))}'?"
    try:
        for holder in holders:
            holder.key_for(path[-1])
    except InputError as error:  # a known quantity in an unknown unit
        return f"unknown key '{name}' (= {_show(value)}): {str(error).removesuffix('.')}"
    if meant is None:
        place = f"[{table}]" if table else "The file's top level"
        if len(fields) > _MANY:
            near = difflib.get_close_matches(path[-1], sorted(fields), 5, cutoff=0.0)
            most = f"{place} may have {len(fields)} keys, which `sinssim check --keys {table}` lists"
            return f"unknown key '{name}'. {most}; the nearest: {', '.join(near)}"
        return f"unknown key '{name}'. {place} may have: {', '.join(sorted(fields))}"
    (stem, unit), (meant_stem, meant_unit) = _split_unit(path[-1]), _split_unit(meant)
    if respelled(stem) != respelled(meant_stem) or not meant_unit or unit == meant_unit:
        return f"unknown key '{name}'. Did you mean '{'.'.join((*path[:-1], meant))}'?"
    converted = ""
    same = unit and _UNITS[unit][0] == _UNITS[meant_unit][0]
    if same and isinstance(value, int | float) and not isinstance(value, bool):
        converted = f" ({meant} = {value * _UNITS[unit][1] / _UNITS[meant_unit][1]:.10g})"
    return f"unknown key '{name}': the unit is part of the name, use '{meant}'{converted}"


def _same_quantity(key: str, meant: str | None) -> bool:
    """Return whether two keys differ in the unit only, or in another word for the quantity."""
    return meant is not None and respelled(_split_unit(key)[0]) == respelled(_split_unit(meant)[0])


def _split_unit(key: str) -> tuple[str, str]:
    """Split a key into the quantity and its unit, "" if it has none: "gyro_bias_deg_h" → "gyro_bias", "deg_h"."""
    parts = key.split("_")
    for count in (3, 2, 1):
        unit = respelled("_".join(parts[-count:]))
        if len(parts) > count and unit in _UNITS:
            return "_".join(parts[:-count]), unit
    return key, ""


def _explain(path: tuple[str, ...], holders: list[type[Table]]) -> str:
    for holder in holders:
        field = holder.file_keys().get(path[-1])
        if field and field.description:
            return f" ({field.description})"
    return ""


def _show(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f"the text '{shortened(value)}'"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, tuple | list):
        return "an array"
    text = f"{value}"
    return f"{value:.12g}" if isinstance(value, float) and len(text) > 12 else shortened(text, 40)


def _walk(loc: tuple[int | str, ...], model: type[Table]) -> tuple[tuple[str, ...], list[type[Table]]]:
    """Follow a location through the models; return the path as written in the file, with array entries counted from 1,
    and the models that may hold its last key."""
    path: list[str] = []
    here: list[Any] = [model]
    holders = [model]
    for part in loc:
        models = _models(here)
        if isinstance(part, int):
            path.append(str(part + 1))
        elif part in ("int", "float") and float in here and int in here:
            pass  # a number that may be whole or not
        elif _array_of(here, part):
            pass  # an array or a text
        elif any(part in kind.file_keys() for kind in models) or not any(
            part in _tags(kind) for kind in (*models, *(kind.own_table(part) for kind in models)) if kind is not None
        ):
            path.append(shortened(part))
            holders = models or holders
        # else: a location contains the tag of a union's member, a file does not
        here = _below(here, part)
    return tuple(path), holders


def _array_of(here: list[Any], part: int | str) -> list[Any]:
    """Return the members of a union of an array and a text that pydantic means by the name of one of the two."""
    arrays = [kind for kind in here if get_origin(kind) is tuple]
    if not arrays or str not in here:
        return []
    return [str] if part == "str" else arrays if str(part).startswith("tuple[") else []


def _below(here: list[Any], part: int | str) -> list[Any]:
    """Return the types of an entry, a field or a union's member."""
    if member := _array_of(here, part):
        return member
    if isinstance(part, int):
        return [entry for kind in here for entry in _entries(kind)]
    models = _models(here)
    fields = [keys[part].annotation for kind in models if part in (keys := kind.file_keys())]
    fields += [table for kind in models if (table := kind.own_table(part)) is not None]
    fields += [get_args(kind)[1] for kind in here if get_origin(kind) is dict]
    return [option for field in fields for option in _options(field)] or [k for k in models if part in _tags(k)]


def _types(loc: tuple[int | str, ...], model: type[Table]) -> list[Any]:
    """Return the possible types at a location."""
    here: list[Any] = [model]
    for part in loc:
        here = _below(here, part)
    return here


def _kinds(loc: tuple[int | str, ...], model: type[Table]) -> list[str]:
    """Return the tags of the union's members at a location."""
    return [tag for kind in _models(_types(loc, model)) for tag in _tags(kind)]


def _models(types_: list[Any]) -> list[type[Table]]:
    return [kind for kind in types_ if isinstance(kind, type) and issubclass(kind, Table)]


def _options(annotation: Any) -> Iterator[Any]:
    """Unfold Annotated and unions."""
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from _options(get_args(annotation)[0])
    elif origin in (Union, types.UnionType):
        for option in get_args(annotation):
            yield from _options(option)
    else:
        yield annotation


def _entries(annotation: Any) -> Iterator[Any]:
    """Unfold the entry type of a tuple or list."""
    if get_origin(annotation) in (tuple, list):
        for entry in get_args(annotation):
            if entry is not Ellipsis:
                yield from _options(entry)


def _tags(model: type[Table]) -> list[str]:
    """Return the values of `type` or `on` that select a model in a union."""
    fields = [model.model_fields[key] for key in ("type", "on") if key in model.model_fields]
    return [tag for field in fields if get_origin(field.annotation) is Literal for tag in get_args(field.annotation)]


def key_parts(dotted: str) -> tuple[str, ...]:
    """Return the parts of a dotted key of a TOML file, without quotes."""
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))


Model = TypeVar("Model", bound=Table)
_DEEPEST = 20  # nesting depth of tables and arrays; a scenario needs six
_MOST_DOTS = 100  # of a key; more than `_DEEPEST`, because such dots may also lie in a text
_DOTTED, _ENDS, _BLANKS = re.compile(r"[\w\"'-]\.(?=[\w\"'-])"), re.compile(r"[,=\n]"), str.maketrans("", "", " \t\r")
_TOO_DEEP = f"tables or arrays are nested more than {_DEEPEST} deep; a scenario needs six levels."


def read_toml(file: Path) -> tuple[str, dict[str, Any]]:
    """Read a TOML file; return its text and its contents."""
    try:
        text = read_text(file, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{file} is not a text file in UTF-8: byte {error.start} is not valid.") from error
    return text, parse_toml(text, str(file))


def parse_toml(text: str, source: str) -> dict[str, Any]:
    """Return the contents of a TOML text; `source` names it in errors."""
    try:
        if any(len(_DOTTED.findall(part)) > _MOST_DOTS for part in _ENDS.split(text.translate(_BLANKS))):
            raise RecursionError  # tomllib takes the square of the time for a key of so many parts
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{source}: {_TOO_DEEP}") from None
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        lines = text.splitlines()
        place = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)", message)
        what = message[: place.start()] if place else message
        line = int(place[1]) if place and place[1] else len(lines)
        column = f", column {place[2]}" if place and place[2] else ""
        shown = shortened(lines[line - 1].strip()) if 0 < line <= len(lines) else ""
        raise InputError(f"{source}, line {line}{column}: TOML syntax: {shortened(what)}, in:  {shown}") from error
    except ValueError as error:  # an integer of thousands of digits, a 30th of February
        raise InputError(f"{source} cannot be read: {error}.") from error


def validate(
    model: type[Model], data: dict[str, Any], text: str, source: str, overridden: Collection[str] = ()
) -> Model:
    """Check the contents of a TOML file."""
    _check_depth(data, source)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise InputError(report(error, model, key_lines(text), overridden, source)) from error


def _check_depth(data: dict[str, Any], source: str) -> None:
    """Refuse tables nested deeper than the schema allows, before any recursion into them."""
    here: list[Any] = [data]
    for _ in range(_DEEPEST):
        inside = [table.values() if isinstance(table, dict) else table for table in here]
        here = [inner for values in inside for inner in values if isinstance(inner, dict | list | tuple)]
        if not here:
            return
    raise InputError(f"{source}: {_TOO_DEEP}")


_HEADER = re.compile(r"\s*(\[\[?)\s*([\w.\-\s\"']+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"\s*([\w.\-\"']+(?:\s*\.\s*[\w\-\"']+)*)\s*=")


def key_lines(text: str) -> dict[tuple[str, ...], int]:
    """Find the lines of the keys and tables of a TOML text: line number, from 1, by path; tables in an array are
    counted from 1.

    Keys inside inline tables and arrays are not searched; the line of their table is used.
    """
    numbers: dict[tuple[str, ...], int] = {}
    counts: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    inside = ""  # the quotes of the current multi-line string
    for number, line in enumerate(text.splitlines(), start=1):
        if not inside:
            if header := _HEADER.match(line):
                table = ()
                names = key_parts(header[2])
                for index, name in enumerate(names, start=1):
                    table += (name,)
                    if header[1] == "[[" and index == len(names):
                        counts[table] = counts.get(table, 0) + 1
                    if table in counts:
                        table += (str(counts[table]),)
                numbers.setdefault(table, number)
            elif key := _KEY.match(line):
                numbers.setdefault(table + key_parts(key[1]), number)
        for quotes in re.findall(r'"""|\'\'\'', line):
            inside = "" if inside == quotes else inside or quotes
    return numbers
