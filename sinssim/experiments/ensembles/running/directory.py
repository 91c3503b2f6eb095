"""The directory of an ensemble: a manifest, and a file for each group of runs that is finished.

Files of runs are never changed. An ensemble is continued by computing what is missing, and extended by asking for more
runs.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from sinssim.errors import InputError, shortened
from sinssim.experiments.ensembles.plan import Plan
from sinssim.experiments.ensembles.run_errors import RunErrors, put
from sinssim.experiments.ensembles.running.chunk_file import DamagedChunkError, chunk_name, read_chunk, runs_of
from sinssim.experiments.ensembles.stored_errors import Errors, errors_for
from sinssim.recording.store.growing_directory import GrowingDirectory, Kind, owned, read_manifest
from sinssim.recording.store.summary import versions
from sinssim.system.outputs import write_text

MANIFEST, CHUNKS = "ensemble.json", "runs"
_KIND = Kind(MANIFEST, ("scenario.toml",), CHUNKS, "sinssim ensemble", "an", "ensemble")
NUMERIC = ("sinssim", "jsbsim", "numpy", "scipy", "numba", "filterpy")
"""Software whose versions must be the same throughout an ensemble."""


class EnsembleDirectory(GrowingDirectory):
    """The directory of an ensemble, locked while it is used."""

    KIND = _KIND

    def __init__(self, path: Path, plan: Plan, *, resume: bool = False, overwrite: bool = False) -> None:
        """Begin a directory, or continue one.

        Args:
            path: the directory.
            plan: the plan of the ensemble.
            resume: whether an ensemble in it is continued; a missing or empty directory is begun in any case.
            overwrite: whether an ensemble in it is removed.

        Raises:
            InputError: the directory holds something else, another ensemble, or cannot be written; or another process
                uses it.
        """
        self.plan = plan
        super().__init__(path, resume=resume, overwrite=overwrite)

    def _check_same(self, found: dict[str, Any], path: Path) -> None:
        _check_same(found, self.plan, path)

    def _computed(self) -> list[str]:
        return _computed(self.path)

    def _begin(self) -> None:
        self._write_manifest()

    def _write_manifest(self) -> None:
        """Write the manifest and the scenario."""
        contents = {
            "kind": _KIND.kind,
            "digest": self.plan.digest,
            "seed": self.plan.scenario.seed,
            "runs_in_a_file": self.plan.chunk,
            "solution": self.plan.solution,
            "versions": {name: versions()[name] for name in NUMERIC},
            "flight": self.plan.flight,
            "epochs_s": self.plan.epochs.tolist(),
            "epochs_of_requirements_s": list(self.plan.extra),
            "blocks": self.plan.blocks,
            "sensors": list(self.plan.sensors),
            "contents": self.plan.contents,
        }
        write_text(self.path / "scenario.toml", self.plan.scenario.to_toml())
        write_text(self.path / MANIFEST, json.dumps(contents, indent=1) + "\n")

    def extend(self, plan: Plan) -> None:
        """Go on with a plan of more runs.

        Args:
            plan: the plan of the same ensemble.
        """
        self.plan = plan
        self._write_manifest()

    def finished(self, say: Callable[[str], None] | None = None) -> list[range]:
        """Return the runs that are finished, in order; a damaged file is named and removed.

        Args:
            say: called with a sentence about each damaged file.

        Returns:
            Numbers of the runs, one entry for each file.
        """
        found = []
        files = ((path, runs_of(path)) for path in self.folder.glob("*.parquet"))
        end = 0
        for path, runs in sorted(((p, r) for p, r in files if r is not None), key=lambda item: item[1].start):
            if runs.start < end:
                continue  # runs of two files, which two processes wrote without a lock
            try:
                read_chunk(path, self.plan)
                found.append(runs)
                end = runs.stop
            except DamagedChunkError as damage:
                with suppress(OSError):
                    path.unlink()
                if say is not None:
                    say(f"{damage} Its runs {runs.start} to {runs.stop - 1} are computed again.")
        return found

    def load(self, groups: Sequence[range]) -> Errors:
        """Return the errors of finished runs.

        Args:
            groups: numbers of the runs of each file, in order.

        Returns:
            Their errors; many are kept in a file without a name in the directory.

        Raises:
            DamagedChunkError: a file has changed since it was checked.
            InputError: there is no space for the file without a name.
        """
        plan, count = self.plan, sum(map(len, groups))
        try:
            errors = errors_for(count, len(plan.epochs), plan.keys, tuple(plan.blocks), plan.sensors, self.path)
            first = 0
            for runs in groups:
                part = read_chunk(self.folder / chunk_name(runs), plan)
                if isinstance(errors, RunErrors):
                    put(errors, part, first)
                else:
                    errors.put(part, first)
                first += len(runs)
        except OSError as error:
            raise InputError(
                f"the errors of {count} runs could not be combined in {self.path}: {error.strerror or error} "
                f"({self.free():.0f} MB are free). All runs are kept; --resume continues."
            ) from error
        return errors


def kept_epochs(path: Path) -> list[float] | None:
    """Return the epochs that requirements have added to an ensemble.

    Args:
        path: its directory.

    Returns:
        Times, s; None if the directory holds no ensemble.
    """
    try:
        found = read_manifest(path, _KIND)
    except InputError:
        return None
    kept = found.get("epochs_of_requirements_s", [])
    return [float(t) for t in kept if isinstance(t, float | int)] if isinstance(kept, list) else []


def missing(finished: list[range], runs: int, chunk: int) -> list[range]:
    """Return the runs that are still to be computed, in groups.

    Args:
        finished: runs of the files, in order, disjoint.
        runs: number of runs wanted.
        chunk: runs in a file; a group ends at a multiple of it.

    Returns:
        Groups of consecutive runs.
    """
    groups, start = [], 0
    for there in [*finished, range(runs, runs)]:
        stop = min(there.start, runs)
        while start < stop:
            end = min((start // chunk + 1) * chunk, stop)
            groups.append(range(start, end))
            start = end
        start = max(start, there.stop)
    return groups


def _check_same(found: dict[str, Any], plan: Plan, path: Path) -> None:
    """Raise unless a manifest is that of the plan's ensemble; the message names the difference."""
    if found.get("digest") == plan.digest and not other_versions(found):
        return
    if other := other_versions(found):
        what = f"was computed by {other}"
    elif found.get("seed") != plan.scenario.seed:
        what = f"has the seed {found.get('seed')}, not {plan.scenario.seed}"
    elif text := difference(found.get("contents"), json.loads(json.dumps(plan.contents))):
        what = f"is of another scenario: {text}"
    elif found.get("epochs_s") != plan.epochs.tolist():
        what = f"keeps errors at {len(found.get('epochs_s', ()))} other epochs (ensemble.epoch_s)"
    elif found.get("flight") != plan.flight:
        what = "is of another flight: the aircraft, or the code that flies it, has changed since"
    else:
        what = "has another format"
    raise InputError(
        f"the ensemble in {path} cannot be continued: it {what}. It stays unchanged; give another folder with "
        "-o, or replace it with --overwrite."
    )


def other_versions(found: dict[str, Any]) -> str:
    """Return which software of a manifest has another version now.

    Args:
        found: the manifest, with its `versions`.

    Returns:
        "numpy 1.0 instead of 2.0, …"; "" if all are the same.
    """
    now, then = versions(), found.get("versions", {})
    different = [name for name in NUMERIC if then.get(name) != now[name]]
    return ", ".join(f"{name} {then.get(name)} instead of {now[name]}" for name in different)


def difference(then: Any, now: Any, path: str = "") -> str:
    """Describe the first difference of two scenarios' contents.

    Args:
        then, now: tables, arrays or values.
        path: path of their key.

    Returns:
        "imu.rate_hz was 100.0, now 50.0"; "" without a difference.
    """
    if isinstance(then, dict) and isinstance(now, dict):
        for key in sorted({*then, *now}):
            if text := difference(then.get(key), now.get(key), f"{path}.{key}".lstrip(".")):
                return text
        return ""
    if isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        for number, (a, b) in enumerate(zip(then, now, strict=True), start=1):
            if text := difference(a, b, f"{path}.{number}"):
                return text
        return ""
    if then == now:
        return ""
    shown = [shortened("left out" if value is None else json.dumps(value), 60) for value in (then, now)]
    return f"{path} was {shown[0]}, now {shown[1]}"


def all_files(path: Path) -> list[str]:
    """Return the files that sinssim wrote in the directory of an ensemble.

    Args:
        path: the directory.

    Returns:
        Their names, with slashes.
    """
    return [*owned(path, _KIND), *_computed(path)]


def _computed(path: Path) -> list[str]:
    return [f"{CHUNKS}/{file.name}" for file in (path / CHUNKS).glob("*.parquet") if runs_of(file) is not None]
