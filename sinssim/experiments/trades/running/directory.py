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

from sinssim.experiments.ensembles.running.directory import EnsembleDirectory
from sinssim.experiments.store import Kind, Store, other_scenario, other_software, software
from sinssim.experiments.trades.measure import CellNumbers, CellVerdict
from sinssim.experiments.trades.schema import TradeStudy
from sinssim.recording.store.summary import plain
from sinssim.scenario.load import load_scenario
from sinssim.scenario.own_files import own_digests
from sinssim.system.outputs import MARK, remove, write_text

MANIFEST = "trade.json"
_LETTERS = 24
"""Letters of a digest in the name of a cell: two of 1000 cells share them with a probability of 1e-23."""
_ENSEMBLE = EnsembleDirectory.KIND.manifest


class TradeDirectory(Store):
    """The directory of a trade study: a file or a folder for each cell that is finished."""

    KIND = Kind(MANIFEST, (), "cells", "sinssim trade study", "a", "trade study", "finished cells")

    def __init__(self, path: Path, study: TradeStudy, *, resume: bool = False, overwrite: bool = False) -> None:
        """Begin the directory of a study, or continue it, as `Store` does."""
        without = ("name", "description", "views", "use", "output", "recording")
        scenario = load_scenario(study.scenario, study.set)
        contents = json.loads(json.dumps(scenario.contents(without=without)))
        files = own_digests(scenario)
        self._about = {
            "name": study.name,
            "cell": study.cell,
            "versions": software(),
            "scenario": {**contents, **({"own_content": files} if files else {})},
        }
        super().__init__(path, resume=resume, overwrite=overwrite)

    def manifest(self) -> dict[str, Any]:
        return self._about

    def difference(self, there: dict[str, Any]) -> str:
        about = self._about
        if there.get("name") != about["name"]:
            return f"is the study {there.get('name')}, not {about['name']}"
        if there.get("cell") != about["cell"]:
            return f"has {there.get('cell')} cells, not {about['cell']} cells"
        return other_software(there) or other_scenario(there.get("scenario"), about["scenario"])

    @classmethod
    def computed(cls, path: Path) -> list[str]:
        names = []
        for cell in (path / "cells").glob("*"):
            if cell.suffix == ".json" and len(cell.stem) == _LETTERS:
                names.append(f"cells/{cell.name}")
            elif len(cell.name) == _LETTERS and (cell.is_symlink() or (cell / _ENSEMBLE).is_file()):
                inside = [] if cell.is_symlink() else [f"/{name}" for name in _files_of(cell)]
                names += [f"cells/{cell.name}{name}" for name in inside or [""]]
        return names

    def cell(self, digest: str) -> Path:
        """Return the folder of an ensemble, or without its ending the file of a budget, by the digest of its cell."""
        return self.folder / digest[:_LETTERS]

    def read(self, digest: str, say: Callable[[str], None]) -> CellNumbers | None:
        """Return the numbers of a finished budget; a damaged file is named and removed.

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
        """Keep the numbers of a finished budget."""
        contents = _contents(numbers)
        text = json.dumps({"digest": digest, "contents": _digest(contents), "numbers": contents}, allow_nan=False)
        write_text(self.cell(digest).with_suffix(".json"), text + "\n")

    def ensemble(self, digest: str, say: Callable[[str], None]) -> Path:
        """Return the folder of an ensemble; one whose manifest is damaged is named and removed."""
        folder = self.cell(digest)
        if folder.is_dir():
            try:
                json.loads((folder / _ENSEMBLE).read_text(encoding="utf-8"))["digest"]
            except (OSError, ValueError, KeyError, TypeError) as error:
                say(f"{folder / _ENSEMBLE} is damaged ({error}). Its cell is computed again.")
                remove(folder, _files_of(folder))
        return folder


def _files_of(ensemble: Path) -> list[str]:
    """Return what sinssim wrote in the folder of an ensemble."""
    return [*EnsembleDirectory.all_files(ensemble), MARK]


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
