"""The cells of a trade study: their settings, scenarios and digests."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from sinssim.errors import InputError
from sinssim.experiments.trades.keys import toml_text
from sinssim.experiments.trades.schema import TradeStudy
from sinssim.scenario.duration import expected_duration
from sinssim.scenario.load import load_scenario
from sinssim.scenario.schema import Scenario
from sinssim.scenario.true_motion import true_motion
from sinssim.truth.flight.cache import flight_key

_WITHOUT_EFFECT = ("name", "description", "views", "output", "recording")
"""Keys of a scenario that do not change a number of a cell."""


@dataclass(frozen=True)
class Cell:
    """One cell of a grid.

    Attributes:
        number: its number, from 1, the last axis changing fastest.
        place: place of its value on each axis, from 0.
        settings: the varied keys with their values, as for --set.
        scenario: its scenario; None if the values do not go together.
        mistake: why they do not; "" otherwise.
    """

    number: int
    place: tuple[int, ...]
    settings: tuple[str, ...]
    scenario: Scenario | None
    mistake: str = ""

    @cached_property
    def flight(self) -> str:
        """Digest of its flight; "" for another motion."""
        if self.scenario is None or self.scenario.flight is None:
            return ""
        return flight_key(self.scenario.flight, self.scenario.seed)


def digest_of(study: TradeStudy, cell: Cell) -> str:
    """Return the digest of everything that determines the numbers of a cell, except the versions of the software.

    Returns:
        SHA-256. The number of runs of an ensemble is not part of it, because an ensemble can be extended.
    """
    assert cell.scenario is not None
    without = (*_WITHOUT_EFFECT, *(("ensemble",) if study.cell == "budget" else ()))
    contents = cell.scenario.contents(without=without)
    if isinstance(contents.get("ensemble"), dict):
        contents["ensemble"] = {key: value for key, value in contents["ensemble"].items() if key != "runs"}
    if study.cell == "budget":
        asked = [q.text for q in study.quantities]
        how = ["budget", study.inertial, asked, list(study.require)]
    else:
        how = ["ensemble", list(study.instants)]
    return hashlib.sha256(json.dumps([how, contents, cell.flight], sort_keys=True).encode()).hexdigest()


def name_of(study: TradeStudy, cell: Cell) -> str:
    """Return the values of a cell in words.

    Returns:
        "grade tactical, gyro bias sigma 0.01 deg/h".
    """
    return ", ".join(
        f"{axis.title} {axis.name_of(k)} {axis.unit}".rstrip() for axis, k in zip(study.axes, cell.place, strict=True)
    )


def cells_of(study: TradeStudy) -> tuple[Cell, ...]:
    """Return the cells of a study, the last axis changing fastest.

    The scenario of a cell is that of `load_scenario` with the study's fixed keys and then the cell's own.

    Returns:
        The cells. Values that do not go together are the cell's mistake.

    Raises:
        InputError: the scenario cannot be used, a fixed key is wrong, a time lies outside the run, or a value of an
            axis is allowed in no cell; the message names the axis, the value, and the first cell.
        RunError: JSBSim failed.
    """
    load_scenario(study.scenario, study.set)  # mistakes that have nothing to do with the axes
    cells, flown = [], dict[str, float]()
    for number, place in enumerate(itertools.product(*map(range, study.shape)), start=1):
        pairs = [pair for axis, k in zip(study.axes, place, strict=True) for pair in axis.settings(k)]
        settings = tuple(f"{key}={toml_text(value)}" for key, value in pairs)
        scenario, mistake = _scenario_of(study, settings, flown)
        cells.append(Cell(number, place, settings, scenario, mistake))
    _check_values(study, cells, flown)
    return tuple(cells)


def _scenario_of(study: TradeStudy, settings: Sequence[str], flown: dict[str, float]) -> tuple[Scenario | None, str]:
    """Return the scenario of some settings and "", or None and why it cannot be used."""
    try:
        scenario = load_scenario(study.scenario, (*study.set, *settings))
        if study.cell == "budget":
            from sinssim.analyses.error_budget.served import check_kind

            check_kind(scenario, "inertial" if study.inertial else None)
        elif scenario.one_component is not None:
            raise InputError(f"the scenario {scenario.name} has [one_component], which has no ensemble.")
        _check_times(study, scenario, flown)
    except InputError as error:
        return None, str(error)
    return scenario, ""


def _check_times(study: TradeStudy, scenario: Scenario, flown: dict[str, float]) -> None:
    """Raise for a time of a study outside a run; `flown` keeps the durations of flights."""
    if not study.instants or scenario.log is not None:  # which has no ensemble
        return
    lasts = expected_duration(scenario)
    if scenario.flight is not None and study.instants[-1] > lasts:  # of a flight this is an estimate
        key = flight_key(scenario.flight, scenario.seed)
        if key not in flown:
            motion = true_motion(scenario)
            flown[key] = motion.end - motion.start
        lasts = flown[key]
    for one in study.requirements:
        one.check_within(lasts)
    if study.instants[-1] > lasts + 1e-6:
        raise InputError(
            f"t = {study.instants[-1]:g} s lies outside the run, which lasts {lasts:g} s; give a time up to this."
        )


def _check_values(study: TradeStudy, cells: list[Cell], flown: dict[str, float]) -> None:
    """Raise for a value of an axis that is allowed in no cell."""
    mistakes = {cell.mistake for cell in cells}
    if mistakes == {""}:
        return
    if mistakes == {mistake := _scenario_of(study, (), flown)[1]}:  # it has nothing to do with the axes
        raise InputError(f"the study {study.name}: {mistake}")
    wrong = []
    for number, axis in enumerate(study.axes):
        for k in range(len(axis.values)):
            here = [cell for cell in cells if cell.place[number] == k]
            if all(cell.scenario is None for cell in here):
                wrong.append((number, k, here))
    if all(cell.scenario is None for cell in cells):  # values of one axis may spoil those of the others
        alone = [one for one in wrong if _wrong_alone(study, one[0], one[1], flown)]
        wrong = alone or wrong[:1]
    lines: dict[tuple[int, str], str] = {}
    for number, k, here in wrong:
        axis, cell = study.axes[number], here[0]
        if (number, cell.mistake) in lines:  # the key itself is wrong: one value says it all
            continue
        others = f" and {len(here) - 1} more" if len(here) > 1 else ""
        lines[number, cell.mistake] = (
            f"axes.{number + 1} ({', '.join(axis.paths)}): the value {axis.name_of(k)} cannot be used in cell "
            f"{cell.number} ({name_of(study, cell)}){others}: {cell.mistake}"
        )
    if lines:
        several = "\n  - ".join([f"{len(lines)} values of the axes:", *lines.values()])
        found = several if len(lines) > 1 else next(iter(lines.values()))
        raise InputError(f"the study {study.name}: {found}")


def _wrong_alone(study: TradeStudy, number: int, k: int, flown: dict[str, float]) -> bool:
    """Return whether a value of an axis cannot be used even with all other axes left out."""
    settings = [f"{key}={toml_text(value)}" for key, value in study.axes[number].settings(k)]
    return _scenario_of(study, settings, flown)[0] is None


def command_of(study: TradeStudy, cell: Cell, program: str = "sinssim") -> str:
    """Return the command that computes a cell by itself.

    Returns:
        `sinssim budget …` or `sinssim ensemble …`; its numbers are those of the cell, bit for bit.
    """
    import shlex

    words = [program, study.cell, study.scenario]
    if study.runs is not None:
        words += ["--runs", str(study.runs)]
    if study.inertial:
        words.append("--inertial")
    for setting in (*study.set, *cell.settings):
        words += ["--set", setting]
    judged = {one.time for one in study.requirements}
    for time in study.instants:
        words += [] if time in judged else ["--at", f"{time:.15g}"]
    for text in study.require:
        words += ["--require", text]
    return " ".join(map(shlex.quote, words))
