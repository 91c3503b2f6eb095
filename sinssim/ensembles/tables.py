"""The tables of an ensemble as Parquet files: errors by run and epoch, and a row for each run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.ensembles.run_errors import COMPONENTS, VECTORS, RunErrors
from sinssim.errors import InputError
from sinssim.statistics.rates import to_nmi_h


def write_tables(
    errors: RunErrors, epochs: Array, mean_rates: Array, end_rates: Array, folder: Path
) -> tuple[Path, Path]:
    """Write the tables.

    Args:
        errors: errors of all runs.
        epochs: the epochs, (K,) s.
        mean_rates, end_rates: rates of the runs in both definitions, (N,) m/s.
        folder: folder to write to; made if it does not exist.

    Returns:
        `errors.parquet` and `runs.parquet`.

    Raises:
        InputError: they cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    written = []
    for name, columns in (("errors", _by_epoch(errors, epochs)), ("runs", _by_run(errors, mean_rates, end_rates))):
        path = folder / f"{name}.parquet"
        beside = folder / f".{name}.parquet.part"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            pq.write_table(pa.table(columns), beside, compression="zstd")
            beside.replace(path)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise InputError(f"{path} cannot be written: {error.strerror or error}.") from error
        written.append(path)
    return written[0], written[1]


def _by_epoch(errors: RunErrors, epochs: Array) -> dict[str, Any]:
    columns: dict[str, Any] = {
        "run": np.repeat(errors.number, len(epochs)),
        "time_s": np.tile(epochs, len(errors)),
    }
    for i, name in enumerate(COMPONENTS):
        columns[name] = getattr(errors, VECTORS[i // 3])[:, :, i % 3].ravel()
        if errors.sigma is not None:
            columns[f"sigma_{name}"] = errors.sigma[:, :, i].ravel()
    for kind in ("nees", "nees_freedom", "nis", "nis_freedom"):
        columns |= {f"{kind} {name}": values.ravel() for name, values in getattr(errors, kind).items()}
    return columns


def _by_run(errors: RunErrors, mean_rates: Array, end_rates: Array) -> dict[str, Any]:
    return {
        "run": errors.number,
        "seed": errors.seed,
        "end_s": errors.end,
        "failure": errors.failure,
        **errors.values,
        "mean_rate_nmi_h": to_nmi_h(mean_rates),
        "end_rate_nmi_h": to_nmi_h(end_rates),
        **{f"final_{name}": errors.final[:, i] for i, name in enumerate(COMPONENTS)},
    }
