"""Writes the directory of a covariance budget: numbers as JSON and Parquet, the report, the recording."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.error_budget.inputs.sources import Source
from sinssim.error_budget.limits import Allowance, Answer
from sinssim.error_budget.result import COMPONENTS, BudgetResult
from sinssim.recording.store.directory import RunDirectory
from sinssim.recording.store.parquet import write_table
from sinssim.recording.store.summary import versions
from sinssim.requirements.exceeded import NEVER
from sinssim.system.outputs import write_text
from sinssim.units import NAUTICAL_MILE

_SI = ("m", "m", "m", "mps", "mps", "mps", "rad", "rad", "rad")


def to_json(result: BudgetResult, answers: Sequence[Answer] = (), times: Sequence[float] = ()) -> dict[str, Any]:
    """Return a budget as plain numbers with units in the names.

    Args:
        result: the budget.
        answers: answers to requirements.
        times: instants of the table beside the usual ones, s.

    Returns:
        What JSON can hold.
    """
    end = len(result.time) - 1
    hours = float(result.time[-1]) / 3600.0
    sigma, bias, cep, r95 = result.sigma(), result.bias, result.cep, result.r95

    def components(values: Any) -> dict[str, float]:
        return {f"{name}_{unit}": float(value) for name, unit, value in zip(COMPONENTS, _SI, values, strict=True)}

    ranked = []
    for one in result.improvements():
        source = one.source
        ranked.append(
            {
                **_about(source),
                "r95_alone_m": one.alone,
                "r95_gain_if_halved_m": one.gain,
                "share_of_horizontal_mean_square": one.share,
                "sigma": components(result.sigma(source.name)[end]) if source.kind == "random" else None,
                "mean": None if source.kind == "random" else components(_heading(result.mean[source.name][end])),
            }
        )
    return {
        "name": result.scenario.name,
        "description": result.scenario.description,
        "solution": result.solution,
        "duration_s": float(result.time[-1]),
        "cep_m": float(cep[end]),
        "r95_m": float(r95[end]),
        "r95_over_time_nmi_per_h": float(r95[end]) / NAUTICAL_MILE / hours,
        "table": [
            {
                "time_s": float(result.time[row]),
                "cep_m": float(cep[row]),
                "r95_m": float(r95[row]),
                "sigma": components(sigma[row]),
                "mean": components(_heading(bias[row])),
            }
            for row in result.table_rows(times)
        ],
        "sources": ranked,
        "requirements": [_answer(one) for one in answers],
        "versions": versions(),
    }


def _heading(values: Any) -> Any:
    """Return errors with the heading's sign, −φ_down."""
    return values * np.array([1.0] * 8 + [-1.0])


def _about(source: Source) -> dict[str, Any]:
    value = None if math.isnan(source.value) else source.value
    return {
        "source": source.name, "label": source.label, "group": source.group, "kind": source.kind, "value": value,
        "unit": source.unit,
    }  # fmt: skip


def _allowance(one: Allowance, size: float) -> dict[str, Any]:
    return {
        "sources": [source.name for source in one.sources],
        "possible": one.possible,
        "factor": one.factor if math.isfinite(one.factor) else None,
        "largest": [
            {"value": value if math.isfinite(value) else None, "unit": source.unit}
            for source, value in zip(one.sources, one.values, strict=True)
        ],
        "without_them": one.without / size,
    }


def _answer(answer: Answer) -> dict[str, Any]:
    one, size = answer.requirement, answer.requirement.unit_size
    return {
        "requirement": one.text,
        "meaning": one.meaning,
        "met": answer.met,
        "value": answer.value / size,
        "limit": one.limit / size,
        "margin": answer.margin / size,
        "unit": one.unit,
        "time_s": answer.time,
        **(answer.exceeded.numbers if answer.exceeded else NEVER),
        "sources": [_allowance(allowance, size) for allowance in answer.allowances],
        "free_together": None if answer.joint is None else _allowance(answer.joint, size),
        "factor_of_all_sources": answer.everything.factor if math.isfinite(answer.everything.factor) else None,
    }


def _write_parquet(result: BudgetResult, path: Path) -> None:
    """Write one row for each instant and source; the source "total" is all of them."""
    import pyarrow as pa

    count = len(result.time)
    names: list[str] = []
    kinds: list[str] = []
    numbers = []
    for source in (None, *result.sources):
        name = None if source is None else source.name
        mean = result.bias if source is None else result.mean.get(source.name, np.zeros((count, 9)))
        names += [name or "total"] * count
        kinds += ["total" if source is None else source.kind] * count
        radii = np.column_stack([result.radius(0.5, name), result.radius(0.95, name)])
        numbers.append(np.column_stack([result.time, radii, result.sigma(name), _heading(mean)]))
    values = np.vstack(numbers)
    heads = ["time_s", "cep_m", "r95_m"]
    for what in ("sigma", "mean"):
        heads += [f"{what}_{name}_{unit}" for name, unit in zip(COMPONENTS, _SI, strict=True)]
    columns: dict[str, Any] = {"source": pa.array(names), "kind": pa.array(kinds)}
    columns |= {head: pa.array(values[:, k].copy()) for k, head in enumerate(heads)}
    write_table(pa.table(columns), path)


def write_budget(
    result: BudgetResult,
    answers: Sequence[Answer],
    directory: Path,
    *,
    times: Sequence[float] = (),
    overwrite: bool = False,
) -> Path:
    """Write a budget's directory: budget.json, budget.parquet, report.html, recording.rrd, scenario.toml.

    Args:
        result: the budget.
        answers: answers to requirements.
        directory: the place.
        times: instants of the table beside the usual ones, s.
        overwrite: whether existing results there may be replaced.

    Returns:
        The directory.

    Raises:
        InputError: the place is taken or cannot be written.
    """
    from sinssim.recording.report.budget import budget_report
    from sinssim.recording.rerun.budget import record

    folder = RunDirectory(directory, overwrite=overwrite)
    try:
        with folder.writing():
            contents = to_json(result, answers, times)
            write_text(folder.path / "budget.json", json.dumps(contents, indent=2, ensure_ascii=False) + "\n")
            write_text(folder.path / "scenario.toml", result.scenario.to_toml())
            _write_parquet(result, folder.path / "budget.parquet")
            write_text(folder.path / "report.html", budget_report(result, answers, times))
            record(result, answers, folder.path / "recording.rrd")
            return folder.keep()
    except BaseException:
        if folder.path.exists():
            folder.discard()
        raise
