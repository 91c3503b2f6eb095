"""The directory of an ensemble: a manifest, and a file for each group of runs that is finished.

Files of runs are never changed. An ensemble is continued by computing what is missing, and extended by asking for more
runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from sinssim.errors import InputError
from sinssim.experiments.ensembles.plan import Plan
from sinssim.experiments.ensembles.running.chunk_file import DamagedChunkError, chunk_name, read_chunk, runs_of
from sinssim.experiments.ensembles.stored_errors import Errors, errors_for
from sinssim.experiments.store import Kind, Store, other_scenario, other_software, read_manifest, software
from sinssim.system.outputs import write_text

MANIFEST = "ensemble.json"


class EnsembleDirectory(Store):
    """The directory of an ensemble: the file of each group of runs that is finished."""

    KIND = Kind(MANIFEST, ("scenario.toml",), "runs", "sinssim ensemble", "an", "ensemble", "runs")

    def __init__(self, path: Path, plan: Plan, *, resume: bool = False, overwrite: bool = False) -> None:
        """Begin the directory of a plan, or continue it, as `Store` does."""
        self.plan = plan
        super().__init__(path, resume=resume, overwrite=overwrite)

    def manifest(self) -> dict[str, Any]:
        plan = self.plan
        return {
            "digest": plan.digest,
            "seed": plan.scenario.seed,
            "runs_in_a_file": plan.chunk,
            "solution": plan.solution,
            "versions": software(),
            "flight": plan.flight,
            "epochs_s": plan.epochs.tolist(),
            "epochs_of_requirements_s": list(plan.extra),
            "blocks": plan.blocks,
            "sensors": list(plan.sensors),
            "contents": plan.contents,
        }

    def begin(self) -> None:
        """Write the manifest and the scenario."""
        write_text(self.path / "scenario.toml", self.plan.scenario.to_toml())
        super().begin()

    def difference(self, there: dict[str, Any]) -> str:
        plan = self.plan
        if other := other_software(there):
            return other
        if there.get("digest") == plan.digest:
            return ""
        if there.get("seed") != plan.scenario.seed:
            return f"has the seed {there.get('seed')}, not {plan.scenario.seed}"
        if text := other_scenario(there.get("contents"), plan.contents):
            return text
        if there.get("epochs_s") != plan.epochs.tolist():
            return f"keeps errors at {len(there.get('epochs_s', ()))} other epochs (ensemble.epoch_s)"
        if there.get("flight") != plan.flight:
            return "is of another flight: the aircraft, or the code that flies it, has changed since"
        return "has another format"

    @classmethod
    def computed(cls, path: Path) -> list[str]:
        return [f"runs/{file.name}" for file in (path / "runs").glob("*.parquet") if runs_of(file) is not None]

    def extend(self, plan: Plan) -> None:
        """Go on with a plan of more runs."""
        self.plan = plan
        self.begin()

    def finished(self, say: Callable[[str], None] | None = None) -> list[range]:
        """Return the runs that are finished, in order; a damaged file is named and removed.

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
        """Return the errors of finished runs; many are kept in a file without a name in the directory.

        Raises:
            DamagedChunkError: a file has changed since it was checked.
            InputError: there is no space for the file without a name.
        """
        plan, count = self.plan, sum(map(len, groups))
        failed, then = f"the errors of {count} runs could not be combined in", " All runs are kept; --resume continues."
        with self.writing(failed, then):
            errors = errors_for(count, len(plan.epochs), plan.keys, tuple(plan.blocks), plan.sensors, self.path)
            first = 0
            for runs in groups:
                errors.put(read_chunk(self.folder / chunk_name(runs), plan), first)
                first += len(runs)
        return errors


def kept_epochs(path: Path) -> list[float] | None:
    """Return the epochs that requirements have added to an ensemble.

    Returns:
        Times, s; None if the directory holds no ensemble.
    """
    try:
        found = read_manifest(path, EnsembleDirectory.KIND)
    except InputError:
        return None
    kept = found.get("epochs_of_requirements_s", [])
    return [float(t) for t in kept if isinstance(t, float | int)] if isinstance(kept, list) else []


def missing(finished: list[range], runs: int, chunk: int) -> list[range]:
    """Return the runs that are still to be computed, in groups that end at multiples of `chunk`."""
    groups, start = [], 0
    for there in [*finished, range(runs, runs)]:
        stop = min(there.start, runs)
        while start < stop:
            end = min((start // chunk + 1) * chunk, stop)
            groups.append(range(start, end))
            start = end
        start = max(start, there.stop)
    return groups
