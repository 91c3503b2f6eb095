"""Inspects files of any known format, and text files whose columns nobody has described: `inspect`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from sinssim import rotation
from sinssim.errors import InputError
from sinssim.inspection.columns import Layout, guess_layout, other_gyro_units
from sinssim.inspection.description import suggested_scenario
from sinssim.inspection.finding import doubt, fact
from sinssim.inspection.inspection import Described, Inspection, inspect_streams
from sinssim.inspection.text_table import TextTable, read_table
from sinssim.logs.aiding import quality_factor
from sinssim.logs.clocks import file_clock, gps_instant
from sinssim.logs.files import fix_stream, inertial_stream, solution_stream
from sinssim.logs.read import candidates, read_file
from sinssim.logs.streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.scenario.sections.log import LogFile, LogReference
from sinssim.truth.source import block_mounting

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

_Stream = TypeVar("_Stream", InertialStream, FixStream, SolutionStream)


@dataclass(frozen=True)
class Inspected:
    """The result of `inspect`.

    Attributes:
        inspection: findings and numbers.
        files: what was read of each file.
        scenario: text of a scenario to start from; None without inertial readings.
    """

    inspection: Inspection
    files: tuple[Streams, ...]
    scenario: str | None


def inspect(paths: Sequence[Path | str], folder: Path | str = ".", *, land: bool = False) -> Inspected:
    """Inspect recorded files before anybody relies on them.

    Args:
        paths: files of one inertial unit, one satellite receiver, or both; or a scenario (.toml) that describes them.
        folder: where the suggested scenario will be; its paths are relative to it.
        land: whether the vehicle moves on wheels; the scenario then has the constraint of wheels, and stops.

    Returns:
        What the data are, what is doubtful, and a scenario to start from.

    Raises:
        InputError: a file cannot be read, or nothing in the files can be inspected.
    """
    if not paths:
        raise InputError("inspect needs at least one file.")
    files: list[Streams] = []
    said = Described()
    guessed: dict[Path, tuple[TextTable, Layout]] = {}
    for path in map(Path, paths):
        if path.suffix == ".toml":
            described, said = _described(path)
            files += described
            continue
        if candidates(path):
            known = read_file(path)
        else:
            table = read_table(path)
            layout = guess_layout(table)
            guessed[path] = table, layout
            clock = Clock("machine", None, "times without a date")
            known = Streams(path, "text", clock, inertial={"imu": layout.stream(table)})
        files.append(known)
    result = inspect_streams(files, said)
    for path, (table, layout) in guessed.items():
        result, layout = _decided(result, files, path, table, layout)
        guessed[path] = table, layout
        result.findings.insert(1, fact(str(path), _words(table, layout)))
    return Inspected(result, tuple(files), _scenario(result, files, guessed, Path(folder), land))


def _described(path: Path) -> tuple[list[Streams], Described]:
    """Return the streams that a scenario with [log] describes, without refused fixes, and what else it says."""
    from sinssim.scenario import load_scenario

    scenario = load_scenario(str(path))
    log = scenario.log
    if log is None:
        raise InputError(f"{path} has no table [log]: inspect recorded files, or a scenario that describes them.")
    stream, clock, notes = inertial_stream(log.imu)
    clock, stream = _on_described_clock(log.imu, clock, stream)
    found = [Streams(Path(log.imu.file), "text", clock, inertial={"imu": stream}, notes=notes)]
    if log.gnss is not None:
        fixes, clock, notes = fix_stream(log.gnss)
        clock, fixes = _on_described_clock(log.gnss, clock, fixes)
        fixes = fixes.rows(np.isfinite(quality_factor(fixes, log.gnss)))
        found.append(Streams(Path(log.gnss.file), "text", clock, fixes={"gnss": fixes}, notes=notes))
    delay = 0.0 if log.gnss is None else log.gnss.velocity_delay_s
    return found, Described(delay, None if log.reference is None else _reference(log.reference, scenario))


def _reference(section: LogReference, scenario: Scenario) -> tuple[Clock, SolutionStream] | None:
    """Return the clock of a reference, and the solution with the attitude of the unit; None without attitude."""
    stream, clock, _ = solution_stream(section)
    if not isinstance(stream, SolutionStream) or stream.q_nb is None:
        return None
    clock, stream = _on_described_clock(section, clock, stream)
    assert stream.q_nb is not None
    return clock, replace(stream, q_nb=rotation.multiply(stream.q_nb, block_mounting(scenario)))


def _on_described_clock(section: LogFile, clock: Clock, stream: _Stream) -> tuple[Clock, _Stream]:
    """Return clock and stream with the first row and the time offset that a scenario gives."""
    first = None if section.first_row is None else gps_instant(section.first_row, section.clock)
    zero = file_clock(clock, float(stream.time[0]), first).zero
    if zero is None:
        return clock, replace(stream, time=stream.time + section.time_offset_s)
    own = Clock(clock.kind if first is None else "gps", zero.seconds, clock.note)
    return own, replace(stream, time=stream.time + (zero.fraction + section.time_offset_s))


def _decided(
    result: Inspection, files: list[Streams], path: Path, table: TextTable, layout: Layout
) -> tuple[Inspection, Layout]:
    """Return the inspection with the unit of the gyros that fits the fixes, if nothing else gives it."""
    if layout.gyro_unit_sure:
        return result, layout
    own = next((f for f in result.findings if f.subject == "units and axes"), None)
    if own is None or own.grade == "doubt":
        text = f"Neither names nor fixes tell the unit of the gyros: {layout.gyro_unit} was assumed from their size."
        result.findings.append(doubt("units and axes", text, "Take it from the unit's manual."))
        return result, layout
    if own.grade == "fact":
        return result, layout
    for unit in other_gyro_units(layout)[1:]:
        other = replace(layout, gyro_unit=unit)
        for k, streams in enumerate(files):
            if streams.path == path:
                files[k] = replace(streams, inertial={"imu": other.stream(table)})
        again = inspect_streams(files)
        if any(f.subject == "units and axes" and f.grade == "fact" for f in again.findings):
            return again, other
    for k, streams in enumerate(files):
        if streams.path == path:
            files[k] = replace(streams, inertial={"imu": layout.stream(table)})
    return result, layout


def _words(table: TextTable, layout: Layout) -> str:
    """Return the sentence on the columns."""

    def three(first: int) -> str:
        return ", ".join(str(table.label(first + k)) for k in range(3))

    return (
        f"Columns, by their numbers{'' if table.names is None else ' and names'}: time {table.label(layout.time)} "
        f"[{layout.time_unit}], gyros {three(layout.gyro)} [{layout.gyro_unit}], accelerometers {three(layout.accel)} "
        f"[{layout.accel_unit}], {layout.kind}."
    )


def _scenario(
    result: Inspection, files: list[Streams], guessed: dict[Path, tuple[TextTable, Layout]], folder: Path, land: bool
) -> str | None:
    unit = next((f for f in files if f.inertial), None)
    if unit is None or (unit.format == "text" and unit.path not in guessed):  # described already
        return None
    receiver = next((f for f in files if f.fixes), None)
    keys: dict[str, Any] = {"format": unit.format}
    if unit.path in guessed:
        table, layout = guessed[unit.path]
        keys |= layout.description(table)
    of_receiver = None if receiver is None else (receiver.path, {"format": receiver.format}, receiver.clock)
    return suggested_scenario(result, (unit.path, keys, unit.clock), of_receiver, folder, land=land)
