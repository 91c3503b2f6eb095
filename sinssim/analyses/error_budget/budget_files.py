"""Writes the directory of a covariance budget: numbers as JSON and Parquet, the report, the recording."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.analyses.error_budget.inputs.sources import Source
from sinssim.analyses.error_budget.limits import Allowance, Answer
from sinssim.analyses.error_budget.result import COMPONENTS, BudgetResult
from sinssim.data import Array
from sinssim.recording.store.directory import write_directory
from sinssim.recording.store.parquet import write_table
from sinssim.recording.store.summary import versions
from sinssim.recording.streams import Stream, Vector
from sinssim.statistics.requirements.exceeded import NEVER
from sinssim.system.outputs import write_text
from sinssim.units import NAUTICAL_MILE

_SI = ("m", "m", "m", "mps", "mps", "mps", "rad", "rad", "rad")


def to_json(result: BudgetResult, answers: Sequence[Answer] = (), times: Sequence[float] = ()) -> dict[str, Any]:
    """Return a budget as plain numbers with units in the names.

    Args:
        times: instants of the table beside the usual ones, s.
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


def _columns(result: BudgetResult, name: str | None) -> dict[str, Array]:
    """Return the columns of one source over time, (E,) each; of all sources together if the name is None."""
    mean = result.bias if name is None else result.mean.get(name, np.zeros((len(result.time), 9)))
    columns = {"cep_m": result.radius(0.5, name), "r95_m": result.radius(0.95, name)}
    for what, values in (("sigma", result.sigma(name)), ("mean", _heading(mean))):
        heads = (f"{what}_{part}_{unit}" for part, unit in zip(COMPONENTS, _SI, strict=True))
        columns |= dict(zip(heads, values.T, strict=True))
    return columns


def streams(result: BudgetResult) -> Iterator[Stream]:
    """Yield the growth of the errors over time, by all sources together ("total") and by each."""
    for name in (None, *(source.name for source in result.sources)):
        columns = _columns(result, name)
        yield Stream(name or "total", result.time, tuple(Vector(k, (k,), v[:, None]) for k, v in columns.items()))


def _write_parquet(result: BudgetResult, path: Path) -> None:
    """Write one row for each instant and source; the source "total" is all of them."""
    import pyarrow as pa

    count, kinds = len(result.time), {"total": "total", **{source.name: source.kind for source in result.sources}}
    parts = [{"time_s": result.time, **_columns(result, None if name == "total" else name)} for name in kinds]
    columns: dict[str, Any] = {
        "source": pa.array([name for name in kinds for _ in range(count)]),
        "kind": pa.array([kind for kind in kinds.values() for _ in range(count)]),
    }
    columns |= {head: pa.array(np.concatenate([part[head] for part in parts])) for head in parts[0]}
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
        times: instants of the table beside the usual ones, s.

    Raises:
        InputError: the place is taken or cannot be written.
    """
    from sinssim.analyses.error_budget.budget_exhibits import exhibits_of
    from sinssim.recording.report.exhibits import page_of
    from sinssim.recording.rerun.exhibits import record

    exhibits = exhibits_of(result, answers, times)

    def write(folder: Path) -> None:
        contents = to_json(result, answers, times)
        write_text(folder / "budget.json", json.dumps(contents, indent=2, ensure_ascii=False) + "\n")
        write_text(folder / "scenario.toml", result.scenario.to_toml())
        _write_parquet(result, folder / "budget.parquet")
        write_text(folder / "report.html", page_of(exhibits))
        record(exhibits, folder / "recording.rrd")

    return write_directory(directory, write, overwrite=overwrite)
