"""What every kind of result shows and writes: the methods of `sinssim.result.Result`."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sinssim.alignment.report import AlignmentResult
from sinssim.calibration.result import CalibrationResult
from sinssim.ensembles.result import EnsembleResult
from sinssim.error_budget.result import BudgetResult
from sinssim.errors import InputError
from sinssim.recording.store.directory import write_directory
from sinssim.recording.store.run_streams import Streams
from sinssim.recording.streams import Stream, Vector
from sinssim.result import Result
from sinssim.simulation.result import PlaneRun, Run
from sinssim.studies.results import StudyResult
from sinssim.trades.result import TradeResult


def summary_of(result: Result) -> dict[str, Any]:
    """Return the contents of the JSON file of a result's directory; those of a run and of an alignment are its own.

    Args:
        result: any kind of result but a run and an alignment.
    """
    match result:
        case EnsembleResult():
            from sinssim.recording.store.ensemble import to_json as of_ensemble

            return of_ensemble(result)
        case TradeResult():
            from sinssim.trades.running.write import to_json as of_trade

            return of_trade(result)
        case StudyResult():
            from sinssim.recording.store.study import results

            return results(result)
        case BudgetResult():
            from sinssim.recording.store.budget import to_json as of_budget

            return of_budget(result, result.answers(), result.times)
        case CalibrationResult():
            from sinssim.recording.store.calibration import to_json as of_calibration

            return of_calibration(result)
    raise TypeError(type(result))


def streams_of(result: Result) -> Streams:
    """Return the tables over time of a result.

    Args:
        result: any kind of result.
    """
    return Streams(_streams(result))


def _streams(result: Result) -> Iterator[Stream]:
    match result:
        case Run():
            from sinssim.recording.store.run_streams import streams_of_run

            yield from streams_of_run(result)
        case EnsembleResult():
            circles = {"cep": result.cep, "r95": result.r95}
            columns = {f"{name}_m": one.value for name, one in circles.items()}
            columns |= {f"{name}_low_m": one.low for name, one in circles.items()}
            columns |= {f"{name}_high_m": one.high for name, one in circles.items()}
            yield Stream("circles", result.time, tuple(Vector(k, (k,), v[:, None]) for k, v in columns.items()))
        case BudgetResult():
            from sinssim.recording.store.budget import streams

            yield from streams(result)
        case AlignmentResult():
            from sinssim.recording.store.streams import imu_stream

            yield imu_stream("measured", result.imu)


def figure_of(result: Result, quantity: str | None = None) -> Any:
    """Draw a result.

    Args:
        result: any kind of result.
        quantity: of a trade study, such as "r95(end)"; by default the first that its report draws.

    Returns:
        The figure, which a notebook shows without pyplot.

    Raises:
        InputError: the result has nothing to draw, or the study does not have the quantity.
    """
    from sinssim.recording.figures.canvas import to_png

    figure = _figure(result, quantity)
    figure._repr_png_ = lambda: to_png(figure)
    return figure


def _figure(result: Result, quantity: str | None) -> Any:
    match result:
        case Run():
            from sinssim.recording.figures.run import run_figure

            return run_figure(result)
        case EnsembleResult():
            from sinssim.recording.figures.ensemble import overview

            return overview(result)
        case TradeResult():
            from sinssim.recording.figures.studies.trade import trade_figure
            from sinssim.requirements.quantity import parse_quantity

            if quantity is not None:
                result.values(quantity)  # refuses a quantity that the study does not have
            return trade_figure(result, result.study.drawn[0] if quantity is None else parse_quantity(quantity))
        case StudyResult():
            return _study_figure(result)
        case BudgetResult():
            from sinssim.recording.figures.budget import growth_figure

            return growth_figure(result, result.answers())
        case CalibrationResult():
            from sinssim.recording.figures.calibration import parameters_figure

            return parameters_figure(result)
        case AlignmentResult():
            from sinssim.recording.figures.alignment import session_figure

            return session_figure(result)
    raise TypeError(type(result))


def _study_figure(result: StudyResult) -> Any:
    """Draw the errors of a study's first part with results, as its report does."""
    from sinssim.recording.figures.studies.study import against_rate, bars, palette
    from sinssim.studies.naming import labeller, line_labeller, over_rates

    paint = palette(result)
    for part in result.study.parts:
        rows = [row for row in result.of_part(part.title) if row.status == "done"]
        if rows and over_rates(part):
            return against_rate(rows, labeller(rows), paint)
        if rows:
            return bars(rows, labeller(rows, pace=True), line_labeller(part, rows), paint)
    raise InputError(f"the study {result.study.name} has no finished navigation to draw.")


def save(result: Result, directory: Path, overwrite: bool) -> Path:
    """Write the directory of a result, or copy the one that its computation wrote.

    Args:
        result: any kind of result.
        directory: the directory to write.
        overwrite: whether an existing result in it may be replaced.

    Returns:
        The directory.

    Raises:
        InputError: the directory is taken or cannot be written.
    """
    if result.directory is not None:
        there = result.directory
        return write_directory(
            directory, lambda folder: shutil.copytree(there, folder, dirs_exist_ok=True), overwrite=overwrite
        )
    match result:
        case Run() | PlaneRun():
            from sinssim.simulation.execute import run

            place = run(result.scenario, directory, overwrite=overwrite).directory
            assert place is not None
            return place
        case EnsembleResult():
            from sinssim.ensembles.running.run import write_result

            return write_result(result, directory, overwrite=overwrite)
        case TradeResult():
            from sinssim.trades.running.run import write_result as write_trade

            return write_trade(result, directory, overwrite=overwrite)
        case StudyResult():
            from sinssim.recording.store.study import write_study

            return write_directory(directory, lambda folder: write_study(result, folder), overwrite=overwrite)
        case BudgetResult():
            from sinssim.recording.store.budget import write_budget

            return write_budget(result, result.answers(), directory, times=result.times, overwrite=overwrite)
        case CalibrationResult():
            from sinssim.recording.store.calibration import write_calibration

            return write_calibration(result, directory, overwrite=overwrite)
        case AlignmentResult():
            from sinssim.recording.store.alignment import write_alignment

            return write_alignment(result, directory, overwrite=overwrite)
    raise TypeError(type(result))
