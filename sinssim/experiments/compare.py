"""Runs a study of either kind: `sinssim.compare`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import overload

from sinssim.errors import InputError
from sinssim.experiments.duration import LIMIT_MINUTES
from sinssim.experiments.load import load_any_study
from sinssim.experiments.studies.compare import compare as compare_algorithms
from sinssim.experiments.studies.results import StudyResult
from sinssim.experiments.studies.schema import Study
from sinssim.experiments.trades.result import TradeResult
from sinssim.experiments.trades.running.run import trade
from sinssim.experiments.trades.schema import TradeStudy
from sinssim.progress import Progress
from sinssim.scenario.load import Overrides

Say = Callable[[str], None]


@overload
def compare(
    study: TradeStudy, directory: Path | str | None = None, *, resume: bool = False, overwrite: bool = False,
    limit_minutes: float = LIMIT_MINUTES, threads: int | None = None, progress: Progress | bool | None = None,
    say: Say | None = None,
) -> TradeResult: ...  # fmt: skip


@overload
def compare(
    study: Study, directory: Path | str | None = None, *, resume: bool = False, overwrite: bool = False,
    limit_minutes: float = LIMIT_MINUTES, threads: int | None = None, progress: Progress | bool | None = None,
    say: Say | None = None,
) -> StudyResult: ...  # fmt: skip


@overload
def compare(
    study: str | Path, directory: Path | str | None = None, *, overrides: Overrides = (), resume: bool = False,
    overwrite: bool = False,
    limit_minutes: float = LIMIT_MINUTES, threads: int | None = None, progress: Progress | bool | None = None,
    say: Say | None = None,
) -> TradeResult | StudyResult: ...  # fmt: skip


def compare(
    study: str | Path | Study | TradeStudy,
    directory: Path | str | None = None,
    *,
    overrides: Overrides = (),
    resume: bool = False,
    overwrite: bool = False,
    limit_minutes: float = LIMIT_MINUTES,
    threads: int | None = None,
    progress: Progress | bool | None = None,
    say: Say | None = None,
) -> TradeResult | StudyResult:
    """Run a study: a comparison of algorithms, or a trade study over a scenario's keys.

    Args:
        study: the study, its file, or a name from `sinssim list studies`.
        directory: directory to write; by default nothing is written.
        overrides: settings "key=value" of a study's file, such as "axes.1.values=[1.0, 2.0]".
        resume: whether a trade study in the directory is continued, or extended by further values of its axes.
        overwrite: whether a study in the directory is replaced.
        limit_minutes: expected duration above which the study is refused.
        threads: number of runs of a trade study's ensembles computed at a time; by default the number of cores.
        progress: called with a description of the current work and the fraction done; True shows a bar.
        say: called with remarks, such as the expected duration.

    Returns:
        A `TradeResult` for a trade study, a `StudyResult` for a comparison of algorithms.

    Raises:
        InputError: the study or the directory cannot be used, or the study would take too long.
        RunError: a flight cannot be flown, every cell failed, or the results cannot be written.
    """
    if overrides and not isinstance(study, str | Path):
        raise InputError("overrides change the file of a study; this study is loaded already.")
    plan = load_any_study(study, overrides) if isinstance(study, str | Path) else study
    if isinstance(plan, TradeStudy):
        return trade(
            plan, directory, resume=resume, overwrite=overwrite, limit_minutes=limit_minutes, threads=threads,
            progress=progress, say=say,
        )  # fmt: skip
    if not isinstance(plan, Study):
        raise InputError(f"study = {plan!r} must be a study, its file, or a name from `sinssim list studies`.")
    for name, value in (("resume", resume), ("threads", threads is not None)):
        if value:
            raise InputError(
                f"{name} (--{name}) belongs to trade studies, which have axes; the study {plan.name} compares "
                "algorithms, and has parts. Run it again from the beginning."
            )
    return compare_algorithms(
        plan, directory, overwrite=overwrite, limit_minutes=limit_minutes, progress=progress, say=say
    )
