"""The directory of an ensemble: a manifest, and a Parquet file for each group of runs that is finished.

A file has a row for each run; errors over the epochs are lists. Its metadata hold the digest of the ensemble and one of
the contents, so that a damaged file is found, whatever byte is wrong. Files are written to a temporary name, renamed
into place, and never changed. An ensemble is continued by computing what is missing, and extended by further runs.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, RunError
from sinssim.experiments.ensembles.ensemble_errors import COMPONENTS, EVERYTHING, Errors, RunErrors, empty, errors_for
from sinssim.experiments.ensembles.ensemble_plan import Plan
from sinssim.experiments.experiment_directory import (
    Kind,
    Store,
    other_scenario,
    other_software,
    read_manifest,
    software,
)
from sinssim.system.files import draft, write_text

MANIFEST = "ensemble.json"
_NAME = re.compile(r"(\d{7,})-(\d{7,})\.parquet$")


class DamagedChunkError(RunError):
    """The file of a group of runs cannot be read, or its contents are not what was written."""


def chunk_name(runs: range) -> str:
    """Return the file name of a group of runs, for example "0000064-0000127.parquet"."""
    return f"{runs.start:07d}-{runs.stop - 1:07d}.parquet"


def runs_of(path: Path) -> range | None:
    """Return the numbers of the runs of a file by its name, None if it is no such name."""
    match = _NAME.match(path.name)
    return range(int(match[1]), int(match[2]) + 1) if match else None


def write_chunk(errors: Errors, plan: Plan, folder: Path, runs: slice = EVERYTHING) -> Path:
    """Write the errors of consecutive runs, which are some rows of `errors`; the same errors give the same bytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns, failure, numbers = _columns(errors, runs), errors.failure[runs], errors.number[runs]
    about = {"digest": plan.digest, "contents": _digest(columns, failure)}
    arrays = {name: _array(values) for name, values in columns.items()}
    arrays["failure"] = pa.array(failure, pa.string())
    table = pa.table(arrays).replace_schema_metadata({"sinssim": json.dumps(about, sort_keys=True)})
    path = folder / chunk_name(range(int(numbers[0]), int(numbers[-1]) + 1))
    split = {
        f"{name}.list.element" if values.ndim > 1 else name: "BYTE_STREAM_SPLIT"
        for name, values in columns.items()
    }  # fmt: skip
    with draft(path) as beside:
        pq.write_table(
            table, beside, compression="zstd", compression_level=1, use_dictionary=False, write_statistics=False,
            column_encoding=split,
        )  # fmt: skip
    return path


def read_chunk(path: Path, plan: Plan) -> RunErrors:
    """Read the errors of a group of runs."""
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path, use_threads=False)
        about = json.loads(table.schema.metadata[b"sinssim"])
        columns = {name: _values(table.column(name)) for name in table.column_names if name != "failure"}
        failure = table.column("failure").to_pylist()
    except Exception as error:  # whatever a reader makes of damaged bytes
        reason = (str(error).splitlines() or [type(error).__name__])[0].rstrip(".")
        raise DamagedChunkError(f"{path} cannot be read: {reason}.") from error
    if about.get("contents") != _digest(columns, failure):
        raise DamagedChunkError(f"{path} is damaged: its contents are not those that were written.")
    if about.get("digest") != plan.digest:
        raise DamagedChunkError(f"{path} belongs to another ensemble.")
    return _errors(columns, failure, plan)


def _columns(errors: Errors, runs: slice) -> dict[str, Array]:
    """Return the columns of a file, (R,) or (R, K) each."""
    columns: dict[str, Any] = {"run": errors.number[runs], "seed": errors.seed[runs], "end_s": errors.end[runs]}
    columns |= {f"vary {key}": values[runs] for key, values in errors.values.items()}
    columns |= {f"final_{name}": errors.final[runs, i] for i, name in enumerate(COMPONENTS)}
    columns |= {name: errors.column(name, runs=runs) for name in errors.names}
    return {name: np.ascontiguousarray(values) for name, values in columns.items()}


def _errors(columns: dict[str, Array], failure: list[str], plan: Plan) -> RunErrors:
    """Return what `_columns` was made of."""
    errors = empty(len(failure), len(plan.epochs), plan.keys, tuple(plan.blocks), plan.sensors, plan.path)
    errors.number[:], errors.seed[:], errors.end[:] = (columns[name] for name in ("run", "seed", "end_s"))
    errors.failure = failure
    for key, values in errors.values.items():
        values[:] = columns[f"vary {key}"]
    for i, name in enumerate(COMPONENTS):
        errors.final[:, i] = columns[f"final_{name}"]
    for name in errors.names:
        errors.column(name)[:] = columns[name]
    return errors


def _digest(columns: dict[str, Array], failure: list[str]) -> str:
    digest = hashlib.sha256(json.dumps(failure).encode())
    for name, values in columns.items():
        digest.update(f"{name} {values.dtype} {values.shape}".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _array(values: Array) -> Any:
    import pyarrow as pa

    if values.ndim == 1:
        return pa.array(values)
    return pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])


def _values(column: Any) -> Array:
    import pyarrow as pa

    array = column.combine_chunks()
    if pa.types.is_fixed_size_list(array.type):
        return np.asarray(array.flatten().to_numpy(zero_copy_only=False)).reshape(-1, array.type.list_size)
    return np.asarray(array.to_numpy(zero_copy_only=False))


class EnsembleDirectory(Store):
    """The directory of an ensemble: the file of each group of runs that is finished."""

    KIND = Kind(
        MANIFEST, ("scenario.toml",), "runs", "sinssim ensemble", "an", "ensemble", "group of runs", "runs"
    )  # fmt: skip

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
        """Return the runs that are finished, in order; a damaged file is named and removed."""
        finished = []
        files = ((path, runs_of(path)) for path in self.folder.glob("*.parquet"))
        end = 0
        for path, runs in sorted(((p, r) for p, r in files if r is not None), key=lambda item: item[1].start):
            if runs.start < end:
                continue  # runs of two files, which two processes wrote without a lock
            try:
                read_chunk(path, self.plan)
                finished.append(runs)
                end = runs.stop
            except DamagedChunkError as damage:
                with suppress(OSError):
                    path.unlink()
                if say is not None:
                    say(f"{damage} Its runs {runs.start} to {runs.stop - 1} are computed again.")
        return finished

    def load(self, groups: Sequence[range]) -> Errors:
        """Return the errors of finished runs; many are kept in a file without a name in the directory."""
        plan, count = self.plan, sum(map(len, groups))
        failed, then = f"the errors of {count} runs could not be combined in", " All runs are kept; --resume continues."
        with self.writing(failed, then):
            keys, blocks = plan.keys, tuple(plan.blocks)
            errors = errors_for(count, len(plan.epochs), keys, blocks, plan.sensors, self.path, plan.path)
            first = 0
            for runs in groups:
                errors.put(read_chunk(self.folder / chunk_name(runs), plan), first)
                first += len(runs)
        return errors


def kept_epochs(path: Path) -> list[float] | None:
    """Return the epochs that requirements have added to an ensemble, s; None if the directory holds no ensemble."""
    try:
        manifest = read_manifest(path, EnsembleDirectory.KIND)
    except InputError:
        return None
    epochs = manifest.get("epochs_of_requirements_s", [])
    return [float(t) for t in epochs if isinstance(t, float | int)] if isinstance(epochs, list) else []


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
