"""Loads and runs a study of either kind.

A comparison of algorithms, with parts, or a trade study, with axes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar, overload

from sinssim.content import find_content, list_content
from sinssim.errors import InputError
from sinssim.experiments.studies.algorithm_comparison import compare as compare_algorithms
from sinssim.experiments.studies.study_results import StudyResult
from sinssim.experiments.studies.study_schema import Study
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_run import trade
from sinssim.experiments.studies.trade_schema import TradeStudy
from sinssim.experiments.workload import LIMIT_MINUTES
from sinssim.progress import Progress
from sinssim.scenario.load import Overrides, resolved_use
from sinssim.scenario.overrides import override
from sinssim.toml_mistakes import parse_toml, read_toml, validate

Kind = TypeVar("Kind", Study, TradeStudy)


def load_study(path: str | Path, overrides: Sequence[str] = ()) -> Study | TradeStudy:
    """Load and check a study of either kind, a TOML file or a name of `sinssim list studies`: a `Study` if it has
    parts, a `TradeStudy` if it has axes. Overrides replace values, for example "axes.1.values=[1.0, 2.0]" (axes, parts
    and motions are counted from 1)."""
    if str(path) in list_content("scenarios") and str(path) not in list_content("studies"):
        raise InputError(f"{path} is a scenario, not a study; vary its keys with --vary KEY=VALUES.")
    file = find_content("studies", str(path))
    text, data = read_toml(file)
    return _study(data, file, text, str(path), overrides)


def study_of_text(text: str, file: Path) -> Study | TradeStudy:
    """Return the checked study of a text as in a file."""
    return _study(parse_toml(text, file.name), file, text, file.name, ())


def _study(data: dict[str, Any], file: Path, text: str, path: str, overrides: Sequence[str]) -> Study | TradeStudy:
    if "parts" in data and ("axes" in data or "scenario" in data):
        raise InputError(
            f"{path} has parts and {'axes' if 'axes' in data else 'a scenario'}: a study either compares algorithms on "
            "motions, by [[parts]], or varies the keys of a scenario, by [[axes]]. Make two studies of it."
        )
    if "axes" in data or "scenario" in data:
        return _checked(TradeStudy, file, text, data, path, overrides)
    if "parts" not in data:
        raise InputError(
            f"{path} is not a study: it has neither [[parts]], which compare algorithms on motions, nor a scenario "
            "with [[axes]], which vary its keys. The keys of a scenario are varied without a file by --vary KEY=VALUES."
        )
    resolved_use(data, file.parent, views=False)
    return _checked(Study, file, text, data, path, overrides)


def _checked(
    kind: type[Kind], file: Path, text: str, data: dict[str, Any], path: str, overrides: Sequence[str]
) -> Kind:
    """Return the study of a file's contents; scenarios beside the file are found from any folder."""
    data.setdefault("name", file.stem)
    for table in _with_scenario(data):
        name = table.get("scenario")
        if isinstance(name, str) and name.endswith(".toml") and not Path(name).exists():
            beside = file.parent / name
            if beside.is_file():
                table["scenario"] = str(beside.resolve())
    overridden = {override(data, setting) for setting in overrides}
    return validate(kind, data, text, path, overridden)


def _with_scenario(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the tables of a file that may name a scenario: the study's own, and those of the motions of its parts."""
    yield data
    for part in data["parts"] if isinstance(data.get("parts"), list) else ():
        motions = part.get("motions") if isinstance(part, dict) else None
        yield from (motion for motion in (motions if isinstance(motions, list) else ()) if isinstance(motion, dict))


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
        resume: whether the study in the directory is continued, or extended by further parts or values of its axes.
        overwrite: whether a study in the directory is replaced.
        limit_minutes: expected duration above which the study is refused.
        threads: number of navigations, or of runs of a trade study's ensembles, computed at a time; by default two, or
            the number of cores.
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
    plan = load_study(study, overrides) if isinstance(study, str | Path) else study
    if isinstance(plan, TradeStudy):
        return trade(
            plan, directory, resume=resume, overwrite=overwrite, limit_minutes=limit_minutes, threads=threads,
            progress=progress, say=say,
        )  # fmt: skip
    if not isinstance(plan, Study):
        raise InputError(f"study = {plan!r} must be a study, its file, or a name from `sinssim list studies`.")
    return compare_algorithms(
        plan, directory, resume=resume, overwrite=overwrite, limit_minutes=limit_minutes, threads=threads,
        progress=progress, say=say,
    )  # fmt: skip
