"""Loads a study of either kind: a comparison of algorithms, with parts, or a trade study, with axes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from sinssim.content import find_content, list_content
from sinssim.errors import InputError
from sinssim.experiments.studies.schema import Study
from sinssim.experiments.trades.schema import TradeStudy
from sinssim.scenario.load import override
from sinssim.scenario.use import resolved_use
from sinssim.toml_file import read_toml, validate

Kind = TypeVar("Kind", Study, TradeStudy)


def load_any_study(path: str | Path, overrides: Sequence[str] = ()) -> Study | TradeStudy:
    """Load and check a study of either kind.

    Args:
        path: path of a TOML file, or the name of a study as in `sinssim list studies`.
        overrides: settings "key.path=value" that replace values of the file, for example "axes.1.values=[1.0, 2.0]"
            (axes, parts and motions are counted from 1).

    Returns:
        A `Study` if the file has parts, a `TradeStudy` if it has axes.

    Raises:
        InputError: the file cannot be read or has mistakes; the message lists all of them, each with its key, its line
            and the correct form.
    """
    if str(path) in list_content("scenarios") and str(path) not in list_content("studies"):
        raise InputError(f"{path} is a scenario, not a study; vary its keys with --vary KEY=VALUES.")
    _, data = read_toml(find_content("studies", str(path)))
    if "parts" in data and ("axes" in data or "scenario" in data):
        raise InputError(
            f"{path} has parts and {'axes' if 'axes' in data else 'a scenario'}: a study either compares algorithms on "
            "motions, by [[parts]], or varies the keys of a scenario, by [[axes]]. Make two studies of it."
        )
    if "axes" in data or "scenario" in data:
        return load_trade_study(path, overrides)
    if "parts" not in data:
        raise InputError(
            f"{path} is not a study: it has neither [[parts]], which compare algorithms on motions, nor a scenario "
            "with [[axes]], which vary its keys. The keys of a scenario are varied without a file by --vary KEY=VALUES."
        )
    return load_study(path, overrides)


def load_study(path: str | Path, overrides: Sequence[str] = ()) -> Study:
    """Load and check a comparison of algorithms, as `load_any_study` does."""
    file = find_content("studies", str(path))
    text, data = read_toml(file)
    if "axes" in data and "parts" not in data:
        raise InputError(
            f"{path} is a trade study, with axes, not a comparison of algorithms, with parts: use `sinssim compare`, "
            "or sinssim.compare from Python."
        )
    resolved_use(data, file.parent, views=False)
    return _checked(Study, file, text, data, str(path), overrides)


def load_trade_study(path: str | Path, overrides: Sequence[str] = ()) -> TradeStudy:
    """Load and check a trade study, as `load_any_study` does."""
    file = find_content("studies", str(path))
    return _checked(TradeStudy, file, *read_toml(file), str(path), overrides)


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
