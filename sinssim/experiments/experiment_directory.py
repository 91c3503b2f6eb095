"""The directory of an experiment, which several calls fill: begun, continued or replaced, locked while it is used.

A manifest says what it holds. A finished part is a file or a folder that never changes, so that an experiment is
continued by computing the parts that are missing. The report is replaced as a whole, whenever the experiment stops.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self

from sinssim.errors import InputError, shortened
from sinssim.progress import Progress
from sinssim.recording.result import versions
from sinssim.system.files import (
    IN_USE,
    MARK,
    Draft,
    as_directory,
    check_inside,
    publish,
    remove,
    remove_left,
    try_hold,
    write_text,
    written,
)
from sinssim.units import capital

_NUMERIC = ("sinssim", "jsbsim", "numpy", "scipy", "numba", "filterpy")
"""Software whose versions must be the same throughout an experiment."""
_LETTERS = 24
"""Letters of a digest in the name of a part: two of 1000 parts share them with a probability of 1e-23."""


class Experiment(ABC):
    """The computation of an experiment: cases × seeds, of which each part is kept as it is finished."""

    @property
    @abstractmethod
    def finished(self) -> str:
        """What is finished, in words: "64 of 150 runs"; "" without a part."""

    @abstractmethod
    def conclude(self, status: str) -> None:
        """Complete the result of what is finished: the whole is "finished", "interrupted" or "failed"."""

    @abstractmethod
    def write(self, place: Path) -> None:
        """Write report and numbers into a folder."""


class Kind(NamedTuple):
    """What a directory holds."""

    manifest: str
    files: tuple[str, ...]
    """Names of further files beside the manifest from the beginning."""
    folder: str
    """Name of the folder of the parts."""
    kind: str
    """Value of the key `kind` in the manifest."""
    article: str
    name: str
    """The contents in words, such as "trade study", after the article."""
    part: str
    """A part in words, such as "cell"."""
    parts: str
    """The parts in words, such as "finished cells"."""

    @property
    def noun(self) -> str:
        """The last word of the name: "study"."""
        return self.name.rpartition(" ")[2]


class Store(ABC):
    """The directory of an experiment, locked until `close`."""

    KIND: ClassVar[Kind]
    is_draft = False
    """Whether nothing of it is kept."""

    def __init__(self, path: Path, *, resume: bool = False, overwrite: bool = False) -> None:
        """Begin a directory, or continue one with `resume`, for which a missing or empty directory is begun;
        `overwrite` removes its contents unless they are continued."""
        self.path = path.resolve()
        self._lock: int | None = None
        taken = self.path.exists() and (not self.path.is_dir() or any(p.name != IN_USE for p in self.path.iterdir()))
        ours: list[str] = []
        if taken:
            there = read_manifest(self.path, self.KIND)
            if not (resume or overwrite):
                raise InputError(
                    f"{path} already holds {self.KIND.article} {self.KIND.name}. Continue or extend it with --resume, "
                    "give another folder with -o, or replace it with --overwrite."
                )
            if resume and (what := self.difference(there)):
                raise InputError(
                    f"the {self.KIND.noun} in {path} cannot be continued: it {what}. It stays unchanged; give another "
                    "folder with -o, or replace it with --overwrite."
                )
            ours = self.all_files(self.path)
        if self.path.is_dir():
            check_inside(self.path, [IN_USE, MARK, f"{self.KIND.folder}/any", *ours])
        self._begun = not (taken and resume)
        self._made = [place for place in (self.path, *self.path.parents) if not place.exists()]
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock = try_hold(self.path)
            if self._lock is None:
                raise InputError(
                    f"another process is computing the {self.KIND.name} in {path}; wait for it, or give another -o."
                )
            if taken and overwrite and not resume:
                remove(self.path, [*ours, MARK])
            self.folder.mkdir(exist_ok=True)
            remove_left(self.path)
            remove_left(self.folder)
            self.begin()
        except OSError as error:
            self.close()
            if not taken:
                with suppress(OSError):
                    for entry in self.path.iterdir():  # of a folder that was empty, such as a file that is cut short
                        shutil.rmtree(entry, ignore_errors=True) if entry.is_dir() else entry.unlink()
                self._leave_nothing()
            raise InputError(
                f"the directory {path} cannot be made: {error.strerror}. Give a folder that can be written with -o."
            ) from error
        except BaseException:
            self.close()
            raise

    def _leave_nothing(self) -> None:
        """Remove what was begun, and the folders that were made; what else is there stays."""
        with suppress(OSError):
            (self.path / self.KIND.manifest).unlink(missing_ok=True)
            for name in self.KIND.files:
                (self.path / name).unlink(missing_ok=True)
            self.folder.rmdir()
        for place in self._made:
            with suppress(OSError):  # it may not exist, or not be empty
                place.rmdir()

    @classmethod
    def check_options(cls, directory: Path | str | None, *, resume: bool, overwrite: bool) -> None:
        """Raise InputError for options of an experiment that exclude each other."""
        kind = cls.KIND
        if directory is None and (resume or overwrite):
            raise InputError(f"resume and overwrite need the directory of {kind.article} {kind.noun}.")
        if resume and overwrite:
            raise InputError(f"resume and overwrite exclude each other: continue the {kind.noun}, or replace it.")

    @abstractmethod
    def manifest(self) -> dict[str, Any]:
        """Return what the parts have in common; with `software` as `versions`."""

    @abstractmethod
    def difference(self, there: dict[str, Any]) -> str:
        """Return how the experiment of a manifest differs: "has the seed 1, not 2"; "" for this one."""

    @classmethod
    @abstractmethod
    def computed(cls, path: Path) -> list[str]:
        """Return the names of the files of the parts in a directory, with slashes."""

    @classmethod
    def all_files(cls, path: Path) -> list[str]:
        """Return the names of the files that sinssim wrote in a directory, with slashes."""
        return [*written_files(path, cls.KIND), *cls.computed(path)]

    def begin(self) -> None:
        """Write the manifest."""
        contents = {"kind": self.KIND.kind, **self.manifest()}
        write_text(self.path / self.KIND.manifest, json.dumps(contents, indent=1) + "\n")

    @property
    def folder(self) -> Path:
        """Folder of the parts."""
        return self.path / self.KIND.folder

    def part(self, digest: str) -> Path:
        """Return the folder of a part, or without its ending its file, by the digest of what determines its numbers."""
        return self.folder / digest[:_LETTERS]

    def read_part(self, digest: str, say: Callable[[str], None]) -> dict[str, Any] | None:
        """Return the numbers of a finished part; None without its file. A damaged file is named and removed."""
        file = self.part(digest).with_suffix(".json")
        if not file.exists():
            return None
        try:
            contents = json.loads(file.read_text(encoding="utf-8"))
            if contents["contents"] != contents_digest(contents["numbers"]) or contents["digest"] != digest:
                raise ValueError("its contents are not those that were written")
            return dict(contents["numbers"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            say(f"{file} is damaged ({error}). It is computed again.")
            with suppress(OSError):
                file.unlink()
            return None

    def write_part(self, digest: str, numbers: dict[str, Any]) -> None:
        """Keep the numbers of a finished part, as Python's JSON holds them, in a file."""
        with self.writing(f"the {self.KIND.folder} of the {self.KIND.noun} could not be written to"):
            text = json.dumps({"digest": digest, "contents": contents_digest(numbers), "numbers": numbers})
            write_text(self.part(digest).with_suffix(".json"), text + "\n")

    def free(self) -> float:
        """Return the free space of the disk, MB."""
        return shutil.disk_usage(self.path).free / 1e6

    @contextmanager
    def writing(self, failed: str, then: str = "") -> Iterator[None]:
        """Turn an error of the system inside the block, such as a full disk, into an `InputError`.

        It says what `failed`, "the runs of the ensemble could not be written to", and `then` what there is.
        """
        try:
            yield
        except OSError as error:
            raise InputError(
                f"{failed} {self.path}: {error.strerror or error} ({self.free():.0f} MB are free).{then}"
            ) from error

    def keep(self, write: Callable[[Path], object]) -> None:
        """Write the results, in place of those of before; the files of others stay."""
        remains = f" All {self.KIND.parts} are kept; --resume writes it."
        with (
            self.writing(f"the report of the {self.KIND.noun} could not be written to", remains),
            Draft(self.path, "results") as place,
        ):
            write(place.path)
            publish(place, self.path, [self.KIND.manifest, *self.KIND.files])

    @classmethod
    @contextmanager
    def opened(cls, directory: Path | str | None, *what: Any, **how: bool) -> Iterator[Self]:
        """Open the directory of an experiment as the class does; without one, a folder that is then removed."""
        with ExitStack() as stack:
            place = stack.enter_context(Draft()).path / "experiment" if directory is None else as_directory(directory)
            store = cls(place, *what, **how)
            stack.enter_context(store)
            store.is_draft = directory is None
            yield store

    @contextmanager
    def reported(self, experiment: Experiment, report: Progress) -> Iterator[None]:
        """Write the report of an experiment, which is computed in the block, also if it stops early."""
        try:
            yield
        except BaseException as stop:
            if not self.is_draft:
                self._leave(experiment, stop, "interrupted" if isinstance(stop, KeyboardInterrupt) else "failed")
            raise
        report("Writing the report", 1.0)
        experiment.conclude("finished")
        if not self.is_draft:
            try:
                self.keep(experiment.write)
            except KeyboardInterrupt as stop:  # it is written all the same
                self._leave(experiment, stop, "finished")
                raise

    def _leave(self, experiment: Experiment, stop: BaseException, status: str) -> None:
        """Say in the notes of what stops an experiment what is finished, and write a report of it."""
        finished = experiment.finished
        if not finished:
            stop.add_note(f"No {self.KIND.part} had finished.")
            return
        stop.add_note(f"{finished} are finished, in {self.path}; --resume continues.")
        try:
            if status != "finished":
                experiment.conclude(status)
            self.keep(experiment.write)
            stop.add_note(f"Their report is {self.path / 'report.html'}.")
        except InputError as error:  # for example on a full disk: the finished parts are safe
            stop.add_note(capital(str(error)))  # which says what could not be written
        except Exception as error:
            stop.add_note(f"Their report could not be written: {error}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        """Unlock the directory; one that was begun in vain is removed, so that it is begun again without --resume."""
        in_vain = kind is not None and self._begun and not self.computed(self.path) and written(self.path) is None
        self.close()
        if in_vain:
            self._leave_nothing()

    def close(self) -> None:
        """Unlock the directory."""
        if self._lock is not None:
            with suppress(OSError):
                (self.path / IN_USE).unlink(missing_ok=True)
            os.close(self._lock)
            self._lock = None


def contents_digest(contents: Any) -> str:
    """Return the SHA-256 of what JSON can hold."""
    return hashlib.sha256(json.dumps(contents, sort_keys=True).encode()).hexdigest()


def is_part(name: str) -> bool:
    """Return whether a file or folder has the name of a part."""
    return re.fullmatch(rf"[0-9a-f]{{{_LETTERS}}}(\.json)?", name) is not None


def written_files(path: Path, kind: Kind) -> list[str]:
    """Return the files that sinssim wrote in a directory, beside the folder of the parts."""
    if os.path.lexists(path / MARK) and written(path) is None:
        raise InputError(
            f"{path / MARK}, by which sinssim recognises its own files, is damaged. The folder stays unchanged; give "
            "another one with -o."
        )
    return list(dict.fromkeys([kind.manifest, *kind.files, *(written(path) or ())]))


def read_manifest(path: Path, kind: Kind) -> dict[str, Any]:
    """Return the manifest of a directory."""
    if not path.is_dir():
        raise InputError(f"{path} is a file; give the name of a folder with -o.")
    try:
        there = json.loads((path / kind.manifest).read_text(encoding="utf-8"))
        if there["kind"] != kind.kind:
            raise KeyError("kind")
        return dict(there)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"the folder {path} is not empty and holds no {kind.name}: it lacks a readable "
            f"{kind.manifest}. It stays unchanged; give another folder with -o."
        ) from error


def software() -> dict[str, str]:
    """Return the versions that must be the same throughout an experiment."""
    return {name: versions()[name] for name in _NUMERIC}


def other_software(there: dict[str, Any]) -> str:
    """Return by which other versions a manifest's experiment was computed: "was computed by numpy 1.0 instead of …"."""
    then = there.get("versions", {})
    different = [
        f"{name} {then.get(name)} instead of {now}" for name, now in software().items() if then.get(name) != now
    ]
    return f"was computed by {', '.join(different)}" if different else ""


def other_scenario(then: Any, now: Any) -> str:
    """Return the first difference of two scenarios' contents: "is of another scenario: imu.rate_hz was 100.0, …"."""
    text = _difference(then, json.loads(json.dumps(now)), "")
    return f"is of another scenario: {text}" if text else ""


def _difference(then: Any, now: Any, path: str) -> str:
    """Describe the first difference of two tables, arrays or values at a path."""
    if isinstance(then, dict) and isinstance(now, dict):
        pairs = [(key, then.get(key), now.get(key)) for key in sorted({*then, *now})]
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        pairs = [(str(number), *both) for number, both in enumerate(zip(then, now, strict=True), start=1)]
    elif then == now:
        return ""
    else:
        shown = [shortened("left out" if value is None else json.dumps(value), 60) for value in (then, now)]
        return f"{path} was {shown[0]}, now {shown[1]}"
    texts = (_difference(a, b, f"{path}.{key}".lstrip(".")) for key, a, b in pairs)
    return next(filter(None, texts), "")
