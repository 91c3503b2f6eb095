"""The registries of what can be chosen by name, and how files outside the package are added to them.

A file outside the package is not run before it is chosen, see `sinssim.system.extensions`.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from pkgutil import resolve_name
from types import FunctionType, SimpleNamespace
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from sinssim.errors import InputError, check_name
from sinssim.system.extensions import Item, Outline, drop_module, explained, file_digest, items_of, load_module, outline

T = TypeVar("T")

NAMED = ("algorithms", "frames", "aiding", "filters", "legs", "formats", "writers")
"""Kinds of own content that are chosen by name: folders of a project, each with its registry."""

_items: dict[tuple[str, str], Item] = {}
_digests: dict[tuple[str, str], str] = {}
_lock = threading.RLock()

on_change: list[Callable[[], None]] = []
"""Functions that drop what was made from files that have changed since, called after such a change."""

REGISTRIES: dict[str, Registry[Any]] = {}
"""The registries by kind."""


class Entry(NamedTuple):
    """An entry that is loaded when it is used."""

    home: str  # where its object is, "module:NAME" below the package of its registry; "" for a file outside the package
    sentence: str  # description


class Registry(Mapping[str, T]):
    """What can be chosen of one kind by its name: the package's own, and what files outside the package bring.

    Attributes:
        kind: its name, that of the project's folder if files outside the package can bring it.
        word: one entry, in messages.
        shipped: the package's own entries by name.
        reserved: further names that files outside the package cannot have.
    """

    def __init__(
        self,
        kind: str,
        word: str,
        shipped: Mapping[str, T],
        of_file: Callable[[Item, Outline], T] | None = None,
        reserved: Iterable[str] = (),
    ) -> None:
        """Take the package's own entries, and the function that makes the entry of a file without running it."""
        self.kind, self.word, self.shipped, self.reserved = kind, word, dict(shipped), frozenset(reserved)
        self._of_file, self._others = of_file, dict[str, T]()
        REGISTRIES[kind] = self
        for item in _items.values():
            if item.kind == kind:
                _refuse_shipped(item)
                self.take(item)

    def __getitem__(self, name: str) -> T:
        return self.shipped[name] if name in self.shipped else self._others[name]

    def __iter__(self) -> Iterator[str]:
        yield from self.shipped
        yield from (name for name in self._others if name not in self.shipped)

    def __len__(self) -> int:
        return len({*self.shipped, *self._others})

    def take(self, item: Item) -> None:
        """Take the entry of a file outside the package."""
        if self._of_file is not None:
            self._others[item.name] = self._of_file(item, outline(item.file))

    def add(self, name: str, entry: T) -> None:
        """Add an entry that another one brings, in place of one of that name."""
        self._others[name] = entry

    def drop(self, name: str) -> None:
        """Remove an entry from outside the package, if it is there."""
        self._others.pop(name, None)

    def check(self, name: str) -> T:
        """Return an entry, which an installed package may bring."""
        ensure(self.kind, name)
        check_name(self.word, name, self)
        return self[name]


class _Described(Protocol):
    """An entry with a description."""

    @property
    def sentence(self) -> str: ...


D = TypeVar("D", bound=_Described)


class Sentences(Mapping[str, str], Generic[D]):
    """The description of each entry of a registry by its name, as the registry is now, and further names."""

    def __init__(self, registry: Registry[D], further: Mapping[str, str] | None = None) -> None:
        """Take a registry."""
        self._registry, self._further = registry, further or {}

    def _now(self) -> dict[str, str]:
        shipped = {name: entry.sentence for name, entry in self._registry.shipped.items()} | dict(self._further)
        return shipped | {name: entry.sentence for name, entry in self._registry.items() if name not in shipped}

    def __getitem__(self, name: str) -> str:
        return self._now()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._now())

    def __len__(self) -> int:
        return len(self._now())

    def __repr__(self) -> str:
        return repr(self._now())


def entries(kind: str, word: str, shipped: Mapping[str, tuple[str, str]]) -> Registry[Entry]:
    """Return a registry of objects that are loaded when they are used, from place and description of the package's
    own."""
    return Registry(
        kind,
        word,
        {name: Entry(*entry) for name, entry in shipped.items()},
        lambda item, source: Entry("", sentence_of(item, source)),
    )


def load_entry(registry: Registry[Entry], name: str, package: str, needs: Iterable[str]) -> Any:
    """Load what an entry stands for; return the object; of a file outside the package, the file's names, whose failures
    are explained with the file."""
    entry, item = registry.check(name), registered(registry.kind, name)
    if item is None:
        return resolve_name(f"{package}.{entry.home}")
    module = load_module(item)
    if missing := [need for need in needs if not hasattr(module, need)]:
        raise InputError(f"the {item.words} cannot be used: {item.file} defines no {', '.join(missing)}.")
    public = {k: v for k, v in vars(module).items() if not k.startswith("_")}
    return SimpleNamespace(**{k: explained(item, v) if isinstance(v, FunctionType) else v for k, v in public.items()})


def use(*paths: str | Path) -> list[str]:
    """Register own content for this Python process: files, or project folders.

    No file is executed before its content is used. If a changed file is registered again, the new contents are used.

    Args:
        *paths: files or folders, see `docs/own-content.md`; relative ones from the current folder.

    Returns:
        The names of the algorithms, frames, aiding sensors, filters, legs and formats.

    Raises:
        InputError: the path contains no content for sinssim, or a name is that of content of the package or of another
            file.
    """
    items = [item for path in paths for item in items_of(Path(path).expanduser().resolve())]
    register(items)
    return [item.name for item in items if item.kind in NAMED]


def register(items: Iterable[Item]) -> None:
    """Register what is chosen by name among some items; others need no registration."""
    with _lock:
        for item in items:
            if item.kind in NAMED:
                _register(item)


def _register(item: Item) -> None:
    key = (item.kind, item.name)
    before, digest = _items.get(key), file_digest(item.file)
    if before is None:
        _refuse_shipped(item)
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
    if (registry := REGISTRIES.get(item.kind)) is not None:
        registry.take(item)


def _refuse_shipped(item: Item) -> None:
    """Raise for a name of the package's own."""
    if item.name in _shipped(item.kind):
        raise InputError(
            f"{item.file}: sinssim itself has the {item.words}, and results of the two could be confused: rename the "
            "file"
        )


def _shipped(kind: str) -> Iterable[str]:
    """Return the names of a kind that files outside the package cannot have."""
    registry = REGISTRIES.get(kind)
    return () if registry is None else {*registry.shipped, *registry.reserved}


def sentence_of(item: Item, content: Outline | None = None) -> str:
    """Return the description of own content for lists, from its outline if that is known: the first line of its file's
    docstring; of a file that is not Python, the reason why it cannot be used."""
    content = content or outline(item.file)
    return f"(cannot be used: {content.problem})" if content.problem else content.sentence or f"own, {item.file.name}"


def registered(kind: str, name: str) -> Item | None:
    """Return own content of a kind of `NAMED` by its name, None if there is none."""
    return _items.get((kind, name))


def forget(*names: str) -> None:
    """Remove own content of some names, or all, as if it had never been registered."""
    with _lock:
        for kind, name in [key for key in _items if not names or key[1] in names]:
            drop_module(_items.pop((kind, name)))
            del _digests[kind, name]
            if kind in REGISTRIES:
                REGISTRIES[kind].drop(name)
        for drop in on_change:
            drop()


def ensure(kind: str, name: str) -> None:
    """Register own content that a name may mean, from SINSSIM_CONTENT or an installed package.

    A pattern with "*" or "?" registers everything of its kind. Kinds outside of `NAMED` have no own content.
    """
    if kind not in NAMED or not isinstance(name, str) or name in _shipped(kind) or (kind, name) in _items:
        return
    from sinssim.content import offered, warn_once

    pattern = re.search(r"[*?\[]", name)
    for item in offered(kind).values():
        if item.name in _shipped(kind):
            warn_once(f"{item.file} is ignored: sinssim's own content has the name {item.name}. Rename the file.")
        elif pattern or item.name == name:
            register([item])


def described(kind: str) -> dict[str, str]:
    """Return descriptions of the own content of a kind by name, for lists outside of scenarios.

    It is what SINSSIM_CONTENT and installed packages bring, and what is registered.
    """
    from sinssim.content import offered

    items = {**offered(kind), **{name: item for (of, name), item in _items.items() if of == kind}}
    return {
        name: f"{sentence_of(item)} ({item.package or item.file})"
        for name, item in items.items()
        if name not in _shipped(kind) or (kind, name) in _items
    }
