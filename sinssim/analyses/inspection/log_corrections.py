"""What an inspection changes in the description of a log: units, signs, order and axes of columns, clocks, gaps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from sinssim.analyses.inspection.stream_inspection import Inspection
from sinssim.data import Array
from sinssim.logs.column_description import DIRECTIONS
from sinssim.logs.column_names import UNITS
from sinssim.logs.recorded_streams import GAP, Clock
from sinssim.sensors.aiding.standstill import LEAST_S
from sinssim.system.files import read_text

if TYPE_CHECKING:
    from sinssim.logs.log_settings import Log, LogImu
    from sinssim.scenario import Scenario


Kind = Literal["rates", "increments"]
_SAME = 0.05
"""Relative difference of two factors that mean one unit: the interval of increments varies by as much, and units differ
by a factor of two or more."""


@dataclass(frozen=True)
class Reread:
    """A right triad as columns of the stated one: right_i = scale · sign_i · stated_source(i)."""

    source: tuple[int, ...]
    signs: tuple[int, ...]
    scale: float

    def unit(self, name: str, kind: Kind, unit: str, interval: float) -> tuple[Kind, str] | None:
        """Return the kind and the unit with which the stated numbers of "gyro" or "accel" are the right ones at the
        usual interval of the samples, s; None if there are none."""
        size = self.scale * UNITS[name, kind][unit]
        other: Kind = "rates" if kind == "increments" else "increments"
        for of, factor in ((kind, 1.0), (other, interval if kind == "increments" else 1.0 / interval)):
            for candidate, si in UNITS[name, of].items():
                if abs(si * factor / size - 1.0) < _SAME:
                    return of, candidate
        return None


def reread(matrix: Array) -> Reread | None:
    """Return a matrix from stated to right readings as a scale, an order and signs; None if it is another one."""
    scale = float(np.abs(matrix).max())
    if not np.allclose(np.sort(np.abs(matrix), axis=1), [[0.0, 0.0, scale]] * 3, atol=1e-9 * scale):
        return None
    source = tuple(int(np.argmax(np.abs(row))) for row in matrix)
    return Reread(source, tuple(int(np.sign(matrix[i, j])) for i, j in enumerate(source)), scale)


def description_of(
    kind: Kind, triads: dict[str, dict[str, Any]], matrices: dict[str, Array], interval: float
) -> tuple[Kind, dict[str, dict[str, Any]]] | None:
    """Return kind and triads of the description of a log after a correction; None if no unit, order and signs of
    columns express it. The triads are the tables gyro and accel, and gravity if there is one, as stated; the matrices
    (3, 3) lead from their readings, in the order of their columns, to the right ones; the interval of the samples is
    the usual one, s."""
    kinds, right = set(), {}
    for name, keys in triads.items():
        of = "gyro" if name == "gyro" else "accel"
        right_triad = reread(matrices[of])
        unit = None if right_triad is None else right_triad.unit(of, kind, keys["unit"], interval)
        if right_triad is None or unit is None:
            return None
        kinds.add(unit[0])
        right[name] = {**keys, "unit": unit[1]}
        stated: Sequence[int] = keys.get("signs", (1, 1, 1))
        signs = [sign * stated[j] for sign, j in zip(right_triad.signs, right_triad.source, strict=True)]
        if isinstance(keys["columns"], str) and right_triad.source != (0, 1, 2):
            return None  # one array of three columns has a fixed order
        if right_triad.source != (0, 1, 2):
            right[name]["columns"] = [keys["columns"][j] for j in right_triad.source]
        if signs != [1, 1, 1] or "signs" in keys:
            right[name]["signs"] = signs
    return (kinds.pop(), right) if len(kinds) == 1 else None


_EPOCH = datetime(1980, 1, 6)
LONGEST_BRIDGE = 10.0
"""Longest gap that `max_gap_s` can bridge, s."""
Change = tuple[tuple[str, ...], Any, str]
"""Keys down to a value, the value, and the reason."""


def corrected_columns(inspection: Inspection, keys: dict[str, Any], axes: Array | None = None) -> dict[str, Any] | None:
    """Return the keys of columns, the stated kind and the tables gyro, accel and gravity, that differ from the stated
    ones in the right reading of the inertial data: empty if these are right, None if the keys cannot express it. The
    matrix (3, 3) leads from the columns to the axes that were inspected, by default the same."""
    if inspection.reading is None:
        return {}
    assert inspection.inertial is not None
    turn = np.eye(3) if axes is None else axes
    gyro, accel = (turn.T @ matrix @ turn for matrix in inspection.reading)
    triads = {name: keys[name] for name in ("gyro", "accel", "gravity") if keys.get(name) is not None}
    interval = float(np.median(np.diff(inspection.inertial.time)))
    description = description_of(keys["kind"], triads, {"gyro": gyro, "accel": accel}, interval)
    if description is None or "gyro" not in triads or "accel" not in triads:
        return None
    kind, right = description
    changed: dict[str, Any] = {name: table for name, table in right.items() if table != triads[name]}
    return changed if kind == keys["kind"] else {"kind": kind, **changed}


def bridges(time: Array, accepted: float) -> tuple[float | None, tuple[float, float] | None]:
    """Return what gaps in the inertial data, of stamps (N,) s, need: the gap to bridge, s, None if the accepted one is
    enough; and the longest part of the log without a gap that cannot be bridged, s since the first stamp, None if that
    is the whole log."""
    steps = np.diff(time)
    usual = float(np.median(steps[steps > 0.0]))
    lacking = np.where(steps > GAP * usual, steps - usual, 0.0)
    cuts = np.flatnonzero(lacking > LONGEST_BRIDGE)
    begins, ends = np.append(0, cuts + 1), np.append(cuts, len(time) - 1)
    part = int(np.argmax(time[ends] - time[begins]))
    first, last = int(begins[part]), int(ends[part])
    longest = float(np.max(lacking[first:last], initial=0.0))
    span = (float(time[first] - time[0]), float(time[last] - time[0])) if len(cuts) else None
    return (float(np.ceil(20.0 * longest + 0.1) / 20.0) if longest > accepted else None), span


def clock_keys(
    inspection: Inspection, unit: Clock, receiver: Clock | None, stated: float = 0.0
) -> Iterator[tuple[str, Any, str]]:
    """Yield the keys of [log.imu] that put the unit's times on the receiver's clock, their values, and the reasons; the
    stated offset is added to the unit's times already, s."""
    if inspection.offset is None or inspection.inertial is None:
        return
    if unit.origin_gps_s is None and receiver is not None and receiver.origin_gps_s is not None:
        first = receiver.origin_gps_s + float(inspection.inertial.time[0]) - inspection.offset - stated
        instant = _EPOCH + timedelta(seconds=round(first, 3))
        text = f"{instant:%Y-%m-%d %H:%M:%S}.{instant.microsecond // 1000:03d}"
        yield "first_row", text, "GPS time by the match with the fixes"
    elif abs(inspection.late) > 1e-3:  # a smaller offset is as uncertain as it is large
        word = "late" if inspection.late > 0.0 else "early"
        yield "time_offset_s", round(stated - inspection.late, 3), f"the unit's stamps are {word}"


_LATEST_FIX_S = 1.5
"""Time before the first fix from which on the run begins later, s: navigation starts from a fix of the last 2 s."""


def since(inspection: Inspection, time: float) -> float:
    """Return a time of the fixes as time since the first row of the unit, s. `time`: on the clock of the fixes, s."""
    assert inspection.inertial is not None
    offset = inspection.stated if inspection.offset is None else inspection.offset
    return time + (offset or 0.0) - float(inspection.inertial.time[0])


def starts(inspection: Inspection, *, of_reference: bool = False) -> float:
    """Return when the run has to begin, s since the first row of the unit: at the first fix if that comes late.
    `of_reference`: whether a reference gives the start, which has to contain the first instant."""
    if inspection.fixes is None or (inspection.offset is None and inspection.stated is None):
        return 0.0
    fixes = inspection.fixes
    known = fixes.time[np.isfinite(fixes.latitude) & np.isfinite(fixes.longitude) & np.isfinite(fixes.height)]
    first = since(inspection, float(known[0])) if len(known) else 0.0
    if of_reference and inspection.inertial is not None:
        steps = np.diff(inspection.inertial.time)
        late = first > 0.0 or bool((steps == 0.0).any())  # even stamps begin a little before the first one
        return max(first, 0.0) + 2.0 * float(np.mean(steps)) if late else 0.0
    # a start from the first fix needs no key, unless wrong ones come before it
    return first if first > (_LATEST_FIX_S if inspection.sound is None else 0.0) else 0.0


SHORTEST_STOP = LEAST_S + 1.0
"""Shortest stop from which the noise at rest is learned, s: what a run needs, and a second for its windows and for the
digits of the times."""


def first_stop(inspection: Inspection) -> tuple[float, float] | None:
    """Return the first quiet span within the run, in which the fixes show no motion, s since the first row."""
    if inspection.quiet is None or inspection.inertial is None or inspection.fixes is None:
        return None
    zero, start = float(inspection.inertial.time[0]), starts(inspection)
    spans = ((max(begin - zero, start), end - zero) for begin, end in inspection.quiet.spans)
    return next((span for span in spans if span[1] - span[0] >= SHORTEST_STOP), None)


def changes(
    inspection: Inspection, scenario: Scenario, clocks: tuple[Clock, Clock | None]
) -> tuple[list[Change], list[str]]:
    """Return what an inspection changes in a scenario with [log]. `clocks`: of the unit and of the receiver, with what
    the scenario says of them."""
    log = scenario.log
    assert log is not None
    assert inspection.inertial is not None
    changed: list[Change] = []
    cannot: list[str] = []
    imu = ("log", "imu")
    of_columns = _columns(inspection, log.imu)
    if of_columns is None:
        cannot.append(
            "The right reading of the inertial data cannot be described: "
            + (
                "the format of the file defines its units and axes. Write the data as a text file, and inspect that."
                if log.imu.gyro is None
                else "no unit, order and signs of the columns express it."
            )
        )
    else:
        others = [
            f.numbers["best_other"] for f in inspection.findings if f.grade == "wrong" and "best_other" in f.numbers
        ]
        gravity = "the specific force at rest is gravity in this unit"
        for key, value in of_columns.items():
            if not isinstance(value, dict):
                changed.append(((*imu, key), value, ", ".join(others) or gravity))
                continue
            stated = _lists(getattr(log.imu, key).model_dump(exclude_none=True))
            for inner, item in value.items():
                if stated.get(inner) != item:
                    why = gravity if key != "gyro" and inner == "unit" else ", ".join(others)
                    changed.append(((*imu, key, inner), item, why))
    changed += _placed(inspection, scenario)
    changed += _of_clocks(inspection, log, clocks)
    time = inspection.inertial.time
    bridge, span = bridges(time, log.imu.max_gap_s)
    if bridge is not None:
        changed.append(((*imu, "max_gap_s"), bridge, "the longest gap in the inertial data, which is bridged"))
    if span is not None and (span[0] > (log.from_s or 0.0) or span[1] < (log.to_s or np.inf)):
        why = f"the longest part without a gap of more than {LONGEST_BRIDGE:g} s"
        changed.append((("log", "from_s"), round(max(span[0], log.from_s or 0.0), 3), why))
        changed.append((("log", "to_s"), round(min(span[1], log.to_s or np.inf), 3), why))
    if log.imu.stamps == "as-given" and (np.diff(time) == 0.0).any():
        changed.append(((*imu, "stamps"), "even", "stamps repeat"))
    return changed, cannot


def _columns(inspection: Inspection, section: LogImu) -> dict[str, Any] | None:
    if inspection.reading is None:
        return {}
    if section.gyro is None or section.accel is None:
        return None
    keys = section.model_dump(include={"kind", "gyro", "accel", "gravity"}, exclude_none=True, exclude_defaults=False)
    keys["kind"] = section.kind
    return corrected_columns(inspection, _lists(keys), section.matrix)


def _lists(value: Any) -> Any:
    """Return a value with lists in place of tuples, without signs that are all +1."""
    if isinstance(value, dict):
        return {k: _lists(v) for k, v in value.items() if not (k == "signs" and tuple(v) == (1, 1, 1))}
    return [_lists(item) for item in value] if isinstance(value, tuple | list) else value


def _placed(inspection: Inspection, scenario: Scenario) -> Iterator[Change]:
    """Yield the mounting if the scenario has none and the motion shows it."""
    mounting = inspection.mounting
    if mounting is None or scenario.imu.mounting_deg is not None:
        return
    assert scenario.log is not None
    rows = [DIRECTIONS[name] for name in mounting.axes]
    named = np.zeros((3, 3))
    for column, (row, sign) in enumerate(rows):
        named[row, column] = sign
    if not np.array_equal(named, np.eye(3)):  # small angles are within the 1σ of the start
        right = named @ scenario.log.imu.matrix
        axes = [name for column in right.T for name, (row, sign) in DIRECTIONS.items() if column[row] == sign]
        yield ("log", "imu", "axes"), axes, "direction of motion and gravity"


def _of_clocks(inspection: Inspection, log: Log, clocks: tuple[Clock, Clock | None]) -> Iterator[Change]:
    """Yield offset and drift of the unit's clock, and the delay of the velocities."""
    for key, value, why in clock_keys(inspection, *clocks, log.imu.time_offset_s):
        yield ("log", "imu", key), value, why
    if inspection.drift:
        ppm = 1e6 * ((1.0 + 1e-6 * log.imu.clock_drift_ppm) * (1.0 + inspection.drift) - 1.0)
        yield ("log", "imu", "clock_drift_ppm"), round(ppm, 1), "match of the velocities over the whole log"
    if log.gnss is not None and inspection.velocity_delay is not None:
        doubted = any("velocity_delay_s" in f.numbers and f.grade == "doubt" for f in inspection.findings)
        if doubted:
            delay = round(inspection.velocity_delay, 3)
            yield ("log", "gnss", "velocity_delay_s"), delay, "velocities are older than positions"
    codes = [code for f in inspection.findings for code in f.numbers.get("doubtful_codes", ())]
    if log.gnss is not None and codes and inspection.fixes is not None and inspection.fixes.quality is not None:
        stated = log.gnss.quality_factors or {str(code): 1.0 for code in np.unique(inspection.fixes.quality)}
        left = {code: factor for code, factor in stated.items() if int(code) not in codes}
        if left:
            yield ("log", "gnss", "quality_factors"), left, "steps contradict the σ of the other codes"


def corrected_scenario(path: Path, folder: Path, corrections: list[Change]) -> str:
    """Return the text of a scenario with changes, each with its reason before the first line; what is not changed stays
    as it is, comments included. The paths of recorded files are relative to the folder where the new one will be."""
    import tomlkit

    document = tomlkit.parse(read_text(path))
    for keys, value, _ in corrections:
        table: Any = document
        for key in keys[:-1]:
            if key not in table:
                table[key] = tomlkit.table()
            table = table[key]
        table[keys[-1]] = value
    if folder.resolve() != path.resolve().parent:
        _moved(document["log"], path.resolve().parent, folder)
    lines = [f"# Corrected from {path.name} by sinssim inspect:"]
    lines += [f"#   {'.'.join(keys)} = {tomlkit.item(value).as_string()}: {why}" for keys, value, why in corrections]
    return "\n".join(lines) + "\n" + tomlkit.dumps(document)


def _moved(log: Any, before: Path, folder: Path) -> None:
    """Replace the paths of a log's files, relative to one folder, by paths that hold in another."""
    for key, value in log.items():
        for table in value if isinstance(value, list) else [value]:
            if not isinstance(table, dict):
                continue
            if isinstance(table.get("file"), str):
                whole = (before / table["file"]).resolve()
                inside = whole.is_relative_to(folder.resolve())
                table["file"] = whole.relative_to(folder.resolve()).as_posix() if inside else whole.as_posix()
            if key == "imu":
                _moved(table, before, folder)
