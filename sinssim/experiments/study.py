"""Loads and runs a study of either kind.

A comparison of algorithms, with parts, or a trade study, with axes; or a sweep of a scenario's keys, with their
values as people write them on a command line.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar, overload

from sinssim.content import find_content, list_content
from sinssim.errors import InputError, shortened
from sinssim.experiments.studies.algorithm_comparison import compare as compare_algorithms
from sinssim.experiments.studies.study_results import StudyResult
from sinssim.experiments.studies.study_schema import Study
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_run import trade
from sinssim.experiments.studies.trade_schema import MOST_CELLS, TradeStudy
from sinssim.experiments.workload import LIMIT_MINUTES
from sinssim.progress import Progress
from sinssim.scenario.load import Overrides, resolved_use
from sinssim.scenario.overrides import override, parse_value
from sinssim.toml_file import parse_toml, read_toml, validate

Kind = TypeVar("Kind", Study, TradeStudy)


def load_study(path: str | Path, overrides: Sequence[str] = ()) -> Study | TradeStudy:
    """Load and check a study of either kind.

    Args:
        path: path of a TOML file, or the name of a study as in `sinssim list studies`.
        overrides: settings "key.path=value" that replace values of the file, for example "axes.1.values=[1.0, 2.0]"
            (axes, parts and motions are counted from 1).

    Returns:
        A `Study` if the file has parts, a `TradeStudy` if it has axes.
    """
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


FORM = (
    "Write values with commas (50,100,200), a range START:STOP:STEP with its stop if it lies on the grid (0.5:2:0.25), "
    "or N values in equal ratios, START:STOP:logN (0.1:10:log5)."
)
"""How values are written."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"({_NUMBER}):({_NUMBER}):(?:log(\d{{1,6}})|({_NUMBER}))")
_PARTS = re.compile(r"""("(?:\\.|[^"\\])*"|'[^']*')|([\[{(])|([\]})])|(,)|[^"'\[{()}\],]+|["']""")
_DIGITS = 4
"""Significant digits of the values between the ends of a range in equal ratios."""


def sweep(scenario: str, vary: Sequence[str], settings: Sequence[str] = ()) -> TradeStudy:
    """Return the trade study of a scenario whose keys take several values.

    Args:
        scenario: a scenario's file, or a name as in `sinssim list scenarios`.
        vary: an axis each, "key.path=values"; the values as in `FORM`, each number, word or array as for `--set`.
        settings: "key.path=value", of the study (cell, runs, times_s, …) or else of the scenario in every cell.

    Returns:
        The study, as from a file with these keys; its name is that of the scenario with "-trade".
    """
    data: dict[str, Any] = {"name": f"{_checked_scenario(scenario)}-trade", "scenario": scenario, "axes": []}
    for written in vary:
        key, _, values = (part.strip() for part in written.partition("="))
        if not key or not values:
            raise InputError(f"--vary {shortened(written)}: write KEY=VALUES, for example imu.rate_hz=50,100. {FORM}")
        data["axes"].append({"key": key, "values": _values(values, shortened(written))})
    overridden = set()
    for setting in settings:
        if setting.partition("=")[0].strip().partition(".")[0] in TradeStudy.model_fields:
            overridden.add(override(data, setting))
        else:
            data.setdefault("set", []).append(setting)
    try:
        return validate(TradeStudy, data, "", scenario, overridden)
    except InputError as error:  # there is no file that counts its axes
        keys = [axis["key"] for axis in data["axes"]]
        raise InputError(re.sub(r"axes\.(\d+)", lambda m: f"--vary {keys[int(m[1]) - 1]}", str(error))) from error


def _checked_scenario(scenario: str) -> str:
    """Return the name of a scenario; raise for a study."""
    if not scenario.endswith(".toml"):
        is_study = scenario in list_content("studies") and scenario not in list_content("scenarios")
    else:
        data = read_toml(find_content("scenarios", scenario))[1]
        is_study = "axes" in data or "parts" in data
    if is_study:
        raise InputError(
            f"--vary varies the keys of a scenario, but {shortened(scenario)} is a study, which has its own values. "
            "Change them with --set, for example --set axes.1.values=[1, 2]."
        )
    return re.sub(r"[^\w.-]", "-", Path(scenario).stem, flags=re.ASCII).lstrip("-_.")[:50] or "scenario"


def _values(written: str, axis: str) -> list[Any]:
    """Return the values of an axis."""
    values: list[Any] = []
    for item in _split(written):
        if not item:
            raise InputError(f"--vary {axis}: a value is missing beside a comma. {FORM}")
        if match := _RANGE.fullmatch(item):
            values += _range(match, axis)
        elif re.fullmatch(r"[^\s\[\"'{:]*:[^\"'\[{]*", item):
            raise InputError(f"--vary {axis}: {shortened(item)!r} is not a range of numbers. {FORM}")
        elif unit := re.fullmatch(rf"{_NUMBER}\s*([A-Za-zµ°%/][^\s]*)", item):
            raise InputError(
                f"--vary {axis}: {shortened(item)!r} has a unit, {unit[1]!r}; the unit is part of the key's name. "
                "Write the number alone."
            )
        else:
            values.append(parse_value(item, f"--vary {axis}"))
        if len(values) > MOST_CELLS:
            break
    return values


def _split(written: str) -> list[str]:
    """Return the parts between commas outside of quotes and brackets."""
    parts, depth = [""], 0
    for match in _PARTS.finditer(written):
        depth += bool(match[2]) - bool(match[3])
        if match[4] and depth <= 0:
            parts.append("")
        else:
            parts[-1] += match[0]
    return [part.strip() for part in parts]


def _range(match: re.Match[str], axis: str) -> list[Any]:
    """Return the values of a range; its steps are exact decimals, so that its stop is met."""
    start, stop = Decimal(match[1]), Decimal(match[2])
    if match[3] is not None:
        count = int(match[3])
        if not (start > 0 and stop > 0) or count < 2 or start == stop:
            raise InputError(
                f"--vary {axis}: {match[0]} needs two different positive ends and at least log2: values in equal "
                "ratios, the ends included."
            )
        _check_count(count, match[0], axis)
        ratio = float(stop) / float(start)
        between = (float(start) * ratio ** (k / (count - 1)) for k in range(1, count - 1))
        return [float(start), *(float(f"{value:.{_DIGITS}g}") for value in between), float(stop)]
    step = Decimal(match[4])
    if step == 0 or (stop - start) / step < 0:
        way = "must not be 0" if step == 0 else f"leads away from {match[2]}, so that there is no value"
        raise InputError(f"--vary {axis}: the step of {match[0]} {way}.")
    count = int((stop - start) / step) + 1
    _check_count(count, match[0], axis)
    whole = all(re.fullmatch(r"[-+]?\d+", text) for text in match.group(1, 2, 4))
    return [(int if whole else float)(start + k * step) for k in range(count)]


def _check_count(count: int, written: str, axis: str) -> None:
    if count > MOST_CELLS:
        raise InputError(
            f"--vary {axis}: {written} has {count} values, and a study has at most {MOST_CELLS} cells; give a larger "
            "step."
        )
