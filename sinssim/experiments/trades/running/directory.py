"""The directory of a trade study: a manifest, and a file or a folder for each cell that is finished.

The name of a cell is the digest of its scenario and of what is asked for. A study whose axes have got further values
therefore goes on with the cells that it has.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.errors import InputError
from sinssim.experiments.ensembles.running.directory import MANIFEST as ENSEMBLE
from sinssim.experiments.ensembles.running.directory import NUMERIC, all_files, difference, other_versions
from sinssim.experiments.trades.measure import CellNumbers, CellVerdict
from sinssim.experiments.trades.schema import TradeStudy
from sinssim.recording.store.growing_directory import GrowingDirectory, Kind
from sinssim.recording.store.summary import plain, versions
from sinssim.scenario.load import load_scenario
from sinssim.scenario.own_files import own_digests
from sinssim.system.outputs import MARK, remove, write_text

MANIFEST, CELLS = "trade.json", "cells"
_KIND = Kind(MANIFEST, (), CELLS, "sinssim trade study", "a", "trade study")
_LETTERS = 24
"""Letters of a digest in the name of a cell: two of 1000 cells share them with a probability of 1e-23."""


class TradeDirectory(GrowingDirectory):
    """The directory of a trade study, locked while it is used."""

    KIND = _KIND

    def __init__(self, path: Path, study: TradeStudy, *, resume: bool = False, overwrite: bool = False) -> None:
        """Begin a directory, or continue one.

        Args:
            path: the directory.
            study: the study.
            resume: whether a study in it is continued; a missing or empty directory is begun in any case.
            overwrite: whether a study in it is removed.

        Raises:
            InputError: the directory holds something else, another study, or cannot be written; or another process uses
                it.
        """
        self._about = _about(study)
        super().__init__(path, resume=resume, overwrite=overwrite)

    def _check_same(self, found: dict[str, Any], path: Path) -> None:
        _check_same(found, self._about, path)

    def _computed(self) -> list[str]:
        found = []
        for cell in self.folder.glob("*"):
            if cell.suffix == ".json" and len(cell.stem) == _LETTERS:
                found.append(f"{CELLS}/{cell.name}")
            elif len(cell.name) == _LETTERS and (cell.is_symlink() or (cell / ENSEMBLE).is_file()):
                inside = [] if cell.is_symlink() else [f"/{name}" for name in (*all_files(cell), MARK)]
                found += [f"{CELLS}/{cell.name}{name}" for name in inside or [""]]
        return found

    def _begin(self) -> None:
        write_text(self.path / MANIFEST, json.dumps(self._about, indent=1) + "\n")

    def cell(self, digest: str) -> Path:
        """Return the folder of an ensemble, or without its ending the file of a budget, by the digest of its cell."""
        return self.folder / digest[:_LETTERS]

    def read(self, digest: str, say: Callable[[str], None]) -> CellNumbers | None:
        """Return the numbers of a finished budget; a damaged file is named and removed.

        Args:
            digest: digest of the cell.
            say: called with a sentence about a damaged file.

        Returns:
            The numbers; None if there are none.
        """
        file = self.cell(digest).with_suffix(".json")
        if not file.exists():
            return None
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
            if found["contents"] != _digest(found["numbers"]) or found["digest"] != digest:
                raise ValueError("its contents are not those that were written")
            return _numbers(found["numbers"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            say(f"{file} is damaged ({error}). Its cell is computed again.")
            with suppress(OSError):
                file.unlink()
            return None

    def write(self, digest: str, numbers: CellNumbers) -> None:
        """Keep the numbers of a finished budget.

        Args:
            digest: digest of the cell.
            numbers: its numbers.

        Raises:
            OSError: they cannot be written.
        """
        contents = _contents(numbers)
        text = json.dumps({"digest": digest, "contents": _digest(contents), "numbers": contents}, allow_nan=False)
        write_text(self.cell(digest).with_suffix(".json"), text + "\n")

    def ensemble(self, digest: str, say: Callable[[str], None]) -> Path:
        """Return the folder of an ensemble; one whose manifest is damaged is named and removed.

        Args:
            digest: digest of the cell.
            say: called with a sentence about a damaged one.

        Returns:
            The folder, which need not exist.
        """
        folder = self.cell(digest)
        if folder.is_dir():
            try:
                json.loads((folder / ENSEMBLE).read_text(encoding="utf-8"))["digest"]
            except (OSError, ValueError, KeyError, TypeError) as error:
                say(f"{folder / ENSEMBLE} is damaged ({error}). Its cell is computed again.")
                remove(folder, [*all_files(folder), MARK])
        return folder


def _about(study: TradeStudy) -> dict[str, Any]:
    """Return what all cells of a study have in common."""
    without = ("name", "description", "views", "use", "output", "recording")
    scenario = load_scenario(study.scenario, study.set)
    contents = json.loads(json.dumps(scenario.contents(without=without)))
    files = own_digests(scenario)
    return {
        "kind": _KIND.kind,
        "name": study.name,
        "cell": study.cell,
        "versions": {name: versions()[name] for name in NUMERIC},
        "scenario": {**contents, **({"own_content": files} if files else {})},
    }


def _check_same(found: dict[str, Any], about: dict[str, Any], path: Path) -> None:
    """Raise unless a manifest is that of the study; the message names the difference."""
    if found.get("name") != about["name"]:
        other = f"is the study {found.get('name')}, not {about['name']}"
    elif found.get("cell") != about["cell"]:
        other = f"has {found.get('cell')} cells, not {about['cell']} cells"
    elif changed := other_versions(found):
        other = f"was computed by {changed}"
    elif text := difference(found.get("scenario"), about["scenario"]):
        other = f"is of another scenario: {text}"
    else:
        return
    raise InputError(
        f"the study in {path} cannot be continued: it {other}. It stays unchanged; give another folder with -o, or "
        "replace it with --overwrite."
    )


def _contents(numbers: CellNumbers) -> dict[str, Any]:
    """Return numbers as JSON holds them; doubles keep every bit."""
    return {
        "values": plain(numbers.values),
        "verdicts": plain([asdict(one) for one in numbers.verdicts]),
        "time": plain(numbers.time.tolist()),
        "cep": plain(numbers.cep.tolist()),
        "r95": plain(numbers.r95.tolist()),
        "notes": list(numbers.notes),
    }


def _numbers(contents: dict[str, Any]) -> CellNumbers:
    """Return what `_contents` was made of."""

    def known(value: Any) -> float:
        return float("nan") if value is None else float(value)

    verdicts = tuple(
        CellVerdict(**{**one, "value": known(one["value"]), "time_s": known(one["time_s"])})
        for one in contents["verdicts"]
    )
    return CellNumbers(
        {name: known(value) for name, value in contents["values"].items()},
        verdicts,
        np.array([known(v) for v in contents["time"]]),
        np.array([known(v) for v in contents["cep"]]),
        np.array([known(v) for v in contents["r95"]]),
        tuple(contents["notes"]),
    )


def _digest(contents: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(contents, sort_keys=True).encode()).hexdigest()
