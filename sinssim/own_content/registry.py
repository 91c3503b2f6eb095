"""Registers algorithms, frames and aiding sensors outside the package under their names, without running their files.

Their files run when they are used for the first time, see `sinssim.own_content.modules`.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterable
from dataclasses import fields
from pathlib import Path

from sinssim.algorithms import ALGORITHMS, REGISTRY, SCENARIO_ALGORITHMS, Algorithm
from sinssim.errors import InputError
from sinssim.frames import FRAME_REGISTRY, FRAMES, Frame
from sinssim.own_content.layout import Item, Outline, items_of, outline
from sinssim.own_content.modules import drop_module, file_digest

NAMED = ("algorithms", "frames", "aiding")
"""Kinds with a registry of names."""

AIDING_TABLES: set[str] = set()
"""Tables of the package's own aiding sensors, which are refused as names."""

_items: dict[tuple[str, str], Item] = {}
_digests: dict[tuple[str, str], str] = {}
_lock = threading.RLock()

on_change: list[Callable[[], None]] = []
"""Functions that drop what was made from files that have changed since, called after such a change."""


def use(*paths: str | Path) -> list[str]:
    """Register own content for this Python process: files, or project folders.

    No file is executed before its content is used. If a changed file is registered again, the new contents are used.

    Args:
        *paths: files or folders, see `docs/own-content.md`; relative ones from the current folder.

    Returns:
        The names of the algorithms, frames and aiding sensors.

    Raises:
        InputError: the path contains no content for sinssim, or a name is that of content of the package or of another
            file.
    """
    items = [item for path in paths for item in items_of(Path(path).expanduser().resolve())]
    register(items)
    return [item.name for item in items if item.kind in NAMED]


def register(items: Iterable[Item]) -> None:
    """Register the algorithms, frames and aiding sensors among some items; others need no registration.

    Args:
        items: the items.

    Raises:
        InputError: as for `use`.
    """
    with _lock:
        for item in items:
            if item.kind in NAMED:
                _register(item)


def _register(item: Item) -> None:
    key = (item.kind, item.name)
    before, digest = _items.get(key), file_digest(item.file)
    if before is None and item.name in _shipped(item.kind):
        raise InputError(
            f"{item.file}: sinssim itself has the {item.words}, and results of the two could be confused: rename the "
            "file"
        )
    if before is not None and digest == _digests[key]:
        return  # the same file, or a copy of it
    if before is not None and before.file != item.file:
        raise InputError(
            f"the name {item.name} stands for two files that differ, {before.file} and {item.file}, in one Python "
            "process: rename one of them, or use them in two processes"
        )
    _items[key], _digests[key] = item, digest
    if before is not None:
        drop_module(item)
        for forget in on_change:
            forget()
    found = outline(item.file)
    if item.kind == "algorithms":
        entry = _algorithm(item, found)
        REGISTRY[item.name] = entry
        ALGORITHMS[item.name] = SCENARIO_ALGORITHMS[item.name] = entry.sentence
    elif item.kind == "frames":
        FRAME_REGISTRY[item.name] = _frame(item, found)
        FRAMES[item.name] = FRAME_REGISTRY[item.name].sentence


def _shipped(kind: str) -> Iterable[str]:
    return {"algorithms": SCENARIO_ALGORITHMS, "frames": FRAMES, "aiding": AIDING_TABLES}[kind]


def sentence_of(item: Item, found: Outline | None = None) -> str:
    """Return the description of own content for lists: the first line of its file's docstring.

    Args:
        item: the content, a file of Python code.
        found: its outline, if known.

    Returns:
        The sentence; of a file that is not Python, the reason why it cannot be used.
    """
    found = found or outline(item.file)
    return f"(cannot be used: {found.problem})" if found.problem else found.sentence or f"own, {item.file.name}"


def _algorithm(item: Item, found: Outline) -> Algorithm:
    of_interval = {key: value for key in ("SAMPLES", "PREVIOUS") if (value := found.constant(key, None)) is not None}
    return Algorithm(
        item.name,
        sentence_of(item, found),
        item.file.stem,
        of_interval if "turn_k" in found.names else {},
        windowed="engine" in found.names,
        path=str(item.file),
    )


def _frame(item: Item, found: Outline) -> Frame:
    truths = {one.name: found.constant(one.name.upper(), one.default) for one in fields(Frame) if one.type == "bool"}
    truths["has_three_rates"] = "solve_three_rates" in found.names
    return Frame(sentence_of(item, found), item.file.stem, **truths, path=str(item.file))


def registered(kind: str, name: str) -> Item | None:
    """Return own content by its name, None if there is none of that name.

    Args:
        kind: one of `NAMED`.
        name: the name.

    Returns:
        The item.
    """
    return _items.get((kind, name))


def all_registered() -> list[Item]:
    """Return all own content that is registered.

    Returns:
        The items.
    """
    return list(_items.values())


def forget(*names: str) -> None:
    """Remove own content again, as if it had never been registered.

    Args:
        *names: names; all by default.
    """
    with _lock:
        for kind, name in [key for key in _items if not names or key[1] in names]:
            drop_module(_items.pop((kind, name)))
            del _digests[kind, name]
            if kind == "algorithms":
                for names_of in (ALGORITHMS, SCENARIO_ALGORITHMS):
                    names_of.pop(name, None)
                REGISTRY.pop(name, None)
            elif kind == "frames":
                FRAME_REGISTRY.pop(name, None)
                FRAMES.pop(name, None)
        for drop in on_change:
            drop()


def ensure(kind: str, name: str) -> None:
    """Register own content that a name may mean, from SINSSIM_CONTENT or an installed package.

    Args:
        kind: one of `NAMED`.
        name: a name that may be unknown; a pattern with "*" or "?" registers everything of its kind.

    Raises:
        InputError: as for `use`.
    """
    if not isinstance(name, str) or name in _shipped(kind) or (kind, name) in _items:
        return
    from sinssim.own_content.installed import offered, warn_once

    pattern = re.search(r"[*?\[]", name)
    for item in offered(kind).values():
        if item.name in _shipped(kind):
            warn_once(f"{item.file} is ignored: sinssim's own content has the name {item.name}. Rename the file.")
        elif pattern or item.name == name:
            register([item])


def described(kind: str) -> dict[str, str]:
    """Return the own content of a kind outside of scenarios with a description each, for lists.

    Args:
        kind: one of `NAMED`.

    Returns:
        Descriptions by name: of what SINSSIM_CONTENT and installed packages bring, and of what is registered.
    """
    from sinssim.own_content.installed import offered

    items = {**offered(kind), **{name: item for (of, name), item in _items.items() if of == kind}}
    return {
        name: f"{sentence_of(item)} ({item.package or item.file})"
        for name, item in items.items()
        if name not in _shipped(kind) or (kind, name) in _items
    }
