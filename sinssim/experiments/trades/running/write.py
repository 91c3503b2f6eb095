"""Writes the results of a trade study: report.html, its pictures, results.json, .parquet, .md, and the recording."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sinssim.experiments.trades.result import TradeResult
from sinssim.experiments.trades.summary import definitions
from sinssim.recording.store.parquet import write_table
from sinssim.recording.store.summary import plain, versions
from sinssim.system.outputs import write_text


def to_json(result: TradeResult) -> dict[str, Any]:
    """Return a trade study as plain numbers and words.

    Returns:
        The contents of `results.json`; unknown numbers are None.
    """
    study = result.study
    cells = []
    for one in result.cells:
        pairs = [pair for axis, k in zip(study.axes, one.cell.place, strict=True) for pair in axis.settings(k)]
        numbers = one.numbers
        cells.append(
            {
                "cell": one.cell.number,
                "settings": dict(pairs),
                "status": one.status,
                "failure": one.failure,
                "values": {} if numbers is None else numbers.values,
                "requirements": [] if numbers is None else [vars(verdict) for verdict in numbers.verdicts],
                "digest": result.digest(one.cell.number),
                "command": result.command(one.cell.number),
            }
        )
    axes = [
        {"name": axis.title, "keys": list(axis.paths), "unit": axis.unit, "values": list(axis.values),
         "labels": list(axis.labels)}
        for axis in study.axes
    ]  # fmt: skip
    contents = {
        "study": study.name,
        "description": study.description,
        "status": result.status,
        "scenario": study.scenario,
        "set": list(study.set),
        "cell": study.cell,
        "axes": axes,
        "finished": result.finished,
        "failed": len(result.failures),
        "definitions": definitions(result),
        "cells": cells,
        "notes": result.notes,
        "computed": result.computed,
        "seconds": round(result.seconds, 2),
        "versions": versions(),
    }
    return dict(plain(contents))


def write_trade(result: TradeResult, folder: Path) -> list[str]:
    """Write the report of a trade study, its pictures, its numbers and its recording.

    Raises:
        OSError: they cannot be written.
    """
    import tomli_w

    from sinssim.experiments.trades.trade_exhibits import exhibits_of
    from sinssim.recording.figures.canvas import save
    from sinssim.recording.figures.charts import figure_of
    from sinssim.recording.report.exhibits import page_of
    from sinssim.recording.rerun.exhibits import markdown, record

    exhibits = exhibits_of(result)
    contents = result.study.model_dump(exclude_none=True)
    write_text(folder / "study.toml", tomli_w.dumps(_lists(contents)))
    text = json.dumps(to_json(result), indent=2, ensure_ascii=False, allow_nan=False)
    write_text(folder / "results.json", text + "\n")
    write_table(result.to_table(), folder / "results.parquet")
    write_text(folder / "summary.md", markdown(exhibits))
    names = ["study.toml", "results.json", "results.parquet", "summary.md", "report.html"]
    for key in exhibits.pictures:
        picture = figure_of(exhibits.chosen(key))
        for ending in (".svg", ".png"):
            save(picture, folder / f"{key}{ending}")
            names.append(f"{key}{ending}")
    write_text(folder / "report.html", page_of(exhibits))
    record(exhibits, folder / "recording.rrd")
    return [*names, "recording.rrd"]


def _lists(value: Any) -> Any:
    """Turn tuples into arrays, at any depth."""
    if isinstance(value, dict):
        return {key: _lists(item) for key, item in value.items()}
    return [_lists(item) for item in value] if isinstance(value, list | tuple) else value
