"""Loads a study of either kind: a comparison of algorithms, with parts, or a trade study, with axes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sinssim.content import find_content, list_content
from sinssim.errors import InputError
from sinssim.experiments.studies.load import load_study
from sinssim.experiments.studies.schema import Study
from sinssim.experiments.trades.cells import scenario_beside
from sinssim.experiments.trades.schema import TradeStudy
from sinssim.scenario.load import override
from sinssim.toml_file import read_toml, validate


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


def load_trade_study(path: str | Path, overrides: Sequence[str] = ()) -> TradeStudy:
    """Load and check a trade study.

    Args:
        path: as for `load_any_study`.
        overrides: as for `load_any_study`.

    Returns:
        The study.

    Raises:
        InputError: as for `load_any_study`.
    """
    file = find_content("studies", str(path))
    text, data = read_toml(file)
    data.setdefault("name", file.stem)
    _scenario_beside(data, file.parent)
    overridden = {override(data, setting) for setting in overrides}
    return validate(TradeStudy, data, text, str(path), overridden)


def _scenario_beside(data: dict[str, Any], folder: Path) -> None:
    if isinstance(data.get("scenario"), str):
        data["scenario"] = scenario_beside(data["scenario"], folder)
