"""Settings "key.path=value" that replace values of a file, as `--set` gives them."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from sinssim.errors import InputError, shortened


def override(data: dict[str, Any], setting: str) -> str:
    """Apply a setting "key.path=value", the value as in TOML, to a file's contents; return the key's path.

    Entries of arrays are counted from 1.
    """
    path, equals, written = setting.partition("=")
    path, written = path.strip(), written.strip()
    setting = shortened(setting)
    if not equals or not path or not written:
        raise InputError(f"--set {setting}: write key.path=value, for example --set imu.rate_hz=200.")
    value = parse_value(written, f"--set {setting}")
    *tables, key = path.split(".")
    here: Any = data
    for index, name in enumerate(tables):
        here = _step(here, name, ".".join(tables[:index]), setting)
    if isinstance(here, list):
        here[_index(here, key, ".".join(tables), setting)] = value
    else:
        if key.startswith("height_"):  # which is another word for it, see `Section`
            here.pop(f"altitude_{key.removeprefix('height_')}", None)
        here[key] = value
    return path


def parse_value(written: str, option: str) -> Any:
    """Return a value that is written as in TOML; a plain word needs no quotes."""
    try:
        return tomllib.loads(f"value = {written}")["value"]
    except (ValueError, RecursionError) as error:
        if re.fullmatch(r"(\d+-)?[A-Za-z][\w.-]*", written):
            return written
        raise InputError(
            f"{option}: {shortened(written)!r} is not a TOML value. Valid are a number, true, a word, "
            '"text in quotes" or an array such as [1, 2, 3]; the shell may have removed quotes.'
        ) from error


def _step(here: Any, name: str, path: str, setting: str) -> Any:
    inner = here[_index(here, name, path, setting)] if isinstance(here, list) else here.setdefault(name, {})
    if not isinstance(inner, dict | list):
        raise InputError(f"--set {setting}: {shortened(f'{path}.{name}'.strip('.'))} is a value, not a table.")
    return inner


def _index(array: list[Any], name: str, path: str, setting: str) -> int:
    if not name.isdecimal() or not 1 <= int(name) <= len(array):
        raise InputError(
            f"--set {setting}: {shortened(path)} has entries 1 to {len(array)}; {shortened(name)!r} is not one of them."
        )
    return int(name) - 1
