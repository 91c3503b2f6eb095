"""Loads a study: reads the TOML file, applies settings, checks everything."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sinssim.content import find_content
from sinssim.errors import InputError
from sinssim.experiments.studies.schema import Study
from sinssim.scenario.load import override
from sinssim.scenario.use import resolved_use
from sinssim.toml_file import read_toml, validate


def load_study(path: str | Path, overrides: Sequence[str] = ()) -> Study:
    """Load and check a study.

    Args:
        path: path of a TOML file, or the name of a study as in `sinssim list studies`.
        overrides: settings "key.path=value" that replace values of the file, for example "parts.1.rates_hz=[50, 100]"
            (parts are counted from 1).

    Returns:
        The study.

    Raises:
        InputError: the file cannot be read or has mistakes; the message lists all of them, each with its key, its line
            and the correct form.
    """
    file = find_content("studies", str(path))
    text, data = read_toml(file)
    if "axes" in data and "parts" not in data:
        raise InputError(
            f"{path} is a trade study, with axes, not a comparison of algorithms, with parts: use `sinssim compare`, "
            "or sinssim.compare from Python."
        )
    data.setdefault("name", file.stem)
    _look_beside(data, file.parent)
    resolved_use(data, file.parent, views=False)
    overridden = {override(data, setting) for setting in overrides}
    return validate(Study, data, text, str(path), overridden)


def _look_beside(data: dict[str, Any], folder: Path) -> None:
    """Replace scenario files that lie beside the study instead of in the current folder by their full path."""
    for part in data["parts"] if isinstance(data.get("parts"), list) else ():
        motions = part.get("motions") if isinstance(part, dict) else None
        for motion in motions if isinstance(motions, list) else ():
            name = motion.get("scenario") if isinstance(motion, dict) else None
            if isinstance(name, str) and name.endswith(".toml") and not Path(name).exists():
                beside = folder / name
                if beside.is_file():
                    motion["scenario"] = str(beside.resolve())
