"""The tables of an ensemble as Parquet files: errors by run and epoch, and a row for each run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.experiments.ensembles.run_errors import COMPONENTS
from sinssim.experiments.ensembles.stored_errors import Errors
from sinssim.statistics.rates import to_nmi_h
from sinssim.system.drafts import draft


def write_tables(errors: Errors, epochs: Array, mean_rates: Array, end_rates: Array, folder: Path) -> tuple[Path, Path]:
    """Write `errors.parquet` and `runs.parquet`, with the runs' rates in both definitions, (N,) m/s.

    Raises:
        InputError: they cannot be written.
    """
    import pyarrow as pa

    by_epoch = (pa.table(_by_epoch(errors, epochs, runs)) for runs in errors.groups())
    by_run = iter([pa.table(_by_run(errors, mean_rates, end_rates))])
    return _write(by_epoch, folder / "errors.parquet"), _write(by_run, folder / "runs.parquet")


def _write(parts: Iterator[Any], path: Path) -> Path:
    """Write the parts of a table, one after another."""
    import pyarrow.parquet as pq

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        first = next(parts)
        with draft(path) as beside, pq.ParquetWriter(beside, first.schema, compression="zstd") as writer:
            writer.write_table(first)
            for part in parts:
                writer.write_table(part)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}.") from error
    return path


def _by_epoch(errors: Errors, epochs: Array, runs: slice) -> dict[str, Any]:
    number = errors.number[runs]
    return {
        "run": np.repeat(number, len(epochs)),
        "time_s": np.tile(epochs, len(number)),
        **{name: errors.column(name, runs=runs).ravel() for name in errors.names},
    }


def _by_run(errors: Errors, mean_rates: Array, end_rates: Array) -> dict[str, Any]:
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
