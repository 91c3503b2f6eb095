"""Inspects files of any known format, and text files whose columns nobody has described."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sinssim import rotation
from sinssim.analyses.inspection.clock_offset import even_times
from sinssim.analyses.inspection.file_layouts import (
    Guessed,
    fix_words,
    guess_files,
    opposite,
    other_units,
    relative_sign,
)
from sinssim.analyses.inspection.inertial_columns import Layout
from sinssim.analyses.inspection.log_corrections import changes, corrected_columns, corrected_scenario
from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact, wrong
from sinssim.analyses.inspection.stream_inspection import MAY_BE_WORSE, Described, Inspection, inspect_streams
from sinssim.analyses.inspection.suggested_scenario import suggested_scenario
from sinssim.analyses.inspection.text_columns import TextTable, read_table
from sinssim.analyses.inspection.unit_axes import WORSE
from sinssim.content import list_content
from sinssim.errors import InputError, SinssimError
from sinssim.logs.formats import candidates, folder_of, read_file
from sinssim.logs.gps_time import file_clock, gps_instant
from sinssim.logs.log_files import fix_stream, inertial_stream, solution_stream
from sinssim.logs.log_settings import LogFile, LogReference
from sinssim.logs.recorded_log import quality_factor
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.progress import Progress, silent
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.true_motion import mounting

_Stream = TypeVar("_Stream", InertialStream, FixStream, SolutionStream)


@dataclass(frozen=True)
class Inspected:
    """The result of `inspect`."""

    inspection: Inspection  # findings and numbers
    files: tuple[Streams, ...]  # what was read of each file
    # text of a scenario to start from, or of the described one with corrections; None if there is none
    scenario: str | None
    why: str = ""  # why there is none


def inspect(
    paths: Sequence[Path | str],
    folder: Path | str = ".",
    *,
    land: bool = False,
    trial: bool = False,
    progress: Progress = silent,
) -> Inspected:
    """Inspect recorded files before anybody relies on them: those of one inertial unit, one satellite receiver, or
    both; or a scenario (.toml) that describes them. Return what the data are, what is doubtful, and a scenario to start
    from, for a folder to which its paths are relative. On `land` it has the constraint of wheels, and stops. The
    `trial` runs it without the fixes of some outages, and follows what they show."""
    if not paths:
        raise InputError("inspect needs at least one file.")
    files: list[Streams] = []
    of_scenario = Described()
    scenario: Scenario | None = None
    tables: list[TextTable] = []
    unread: list[InputError] = []
    for path in _whole_folders([Path(path) for path in paths]):
        if path.suffix == ".toml":
            scenario, described, of_scenario = _described(path)
            files += described
            source = path
        elif [name for name in candidates(path) if name != "track-csv"]:  # a track of any names is read as fixes
            files.append(read_file(path))
        else:
            try:
                tables.append(read_table(path))
            except InputError as error:
                unread.append(error)
    spans = [float(np.ptp(fixes.time)) for file in files for fixes in file.fixes.values()]
    guessed = guess_files(tables, unit_known=any(file.inertial for file in files), lasts=max(spans, default=None))
    files += guessed.streams()
    if unread and not any(file.inertial for file in files):
        raise unread[0]
    if guessed.unit is not None and guessed.unit[1].gravity is not None:
        result, guessed = _of_sum(files, guessed)
    else:
        result = inspect_streams(_with_fixes(files), of_scenario)
    if guessed.unit is not None:
        if guessed.unit[1].gravity is None:
            _decided(result, guessed.unit[1])
        result.findings.insert(1, fact(str(guessed.unit[0].path), _words(*guessed.unit)))
        result.findings += _uneven(*guessed.unit)
    for table, layout in guessed.fixes:
        result.findings.insert(1, fact(str(table.path), f"The columns of the fixes are: {fix_words(table, layout)}."))
    if land and scenario is None and any(file.inertial for file in files) and result.mounting is None:
        text = (
            "--vehicle land has no effect: the constraint of wheels needs the mounting of the unit, which is not known."
        )
        result.findings.append(doubt("vehicle", text, "Give a drive with fixes at more than 5 m/s."))
    left = (*guessed.left, *(f"{error} The file is not used." for error in unread))
    result.findings += [doubt("files", text, "Omit the file.") for text in left]
    if scenario is None:
        suggested = _scenario(result, files, guessed, Path(folder), land)
        if suggested is not None and trial and result.usable:
            suggested = _after_trial(result, suggested, Path(folder), progress)
        return Inspected(result, tuple(files), suggested)
    return Inspected(result, tuple(files), *_corrected(result, files, scenario, source, Path(folder), land=land))


def _after_trial(result: Inspection, text: str, folder: Path, progress: Progress) -> str:
    """Return a suggested scenario with the settings that its trial shows to be needed; add the trial's finding."""
    from sinssim.analyses.inspection.suggestion_trial import try_suggestion

    trial = try_suggestion(text, folder, result, progress)
    if trial is None:
        if result.fixes is not None:
            judged = "No outage of 5 s can be judged: the suggested scenario is not compared with the fixes alone."
            result.findings.append(doubt("trial", judged, "Give a longer log, or one with more samples a second."))
        return text
    if isinstance(trial, SinssimError):
        fix = "Complete the scenario, or give files with fixes from the beginning on."
        result.findings.append(doubt("trial", f"The suggested scenario does not run: {trial}", fix))
        return text
    if trial.chosen.good:
        result.findings = [
            replace(f, fix=f.fix.removeprefix(WORSE), text=f.text.replace(MAY_BE_WORSE, "")) for f in result.findings
        ]
    result.findings.append(trial.finding)
    return trial.written(text)


def _corrected(
    result: Inspection, files: list[Streams], scenario: Scenario, path: Path, folder: Path, *, land: bool
) -> tuple[str | None, str]:
    """Return the text of a described scenario with what was found, and a sentence on it; None without a change."""
    unit = next(f.clock for f in files if f.inertial)
    corrections, cannot = changes(result, scenario, (unit, next((f.clock for f in files if f.fixes), None)))
    if land and getattr(scenario.aiding, "land_vehicle", None) is None:
        result.findings.append(
            doubt(
                "vehicle",
                "--vehicle land does not change a scenario that describes the log.",
                "Add [aiding.land_vehicle] to it, see docs/estimation.md.",
            )
        )
    beyond = [
        f for f in result.findings if f.grade == "wrong" and f.subject not in ("units and axes", "accelerometers")
    ]
    if cannot or beyond:
        why = " ".join([*cannot, *(f.sentence for f in beyond)])
        return None, f"There is no corrected scenario. {why}"
    if not corrections:
        return None, f"{path.name} needs no correction."
    return corrected_scenario(path, folder, corrections), ""


def _whole_folders(paths: Sequence[Path]) -> list[Path]:
    """Return the paths, with the folder in place of the files of a format that is a folder."""
    whole_paths: list[Path] = []
    for path in paths:
        whole = (folder_of(path) if path.is_file() else None) or path
        if whole not in whole_paths:
            whole_paths.append(whole)
    return whole_paths


def _with_fixes(files: list[Streams]) -> list[Streams]:
    """Return files in which, if none has fixes, the positions of a solution stand for them."""
    if any(file.fixes for file in files) or not any(file.inertial for file in files):
        return files
    for k, file in enumerate(files):
        for name, s in file.solutions.items():
            if np.isfinite(s.latitude).any():
                fixes = FixStream(
                    s.time, s.latitude, s.longitude, s.height, s.datum, s.position_sigma, s.velocity_ned,
                    s.velocity_sigma,
                )  # fmt: skip
                note = f"There are no fixes; the comparison uses the {name} of {file.path.name} instead."
                other = replace(file, fixes={name: fixes}, notes=(*file.notes, note))
                return [*files[:k], other, *files[k + 1 :]]
    return files


def _described(path: Path) -> tuple[Scenario, list[Streams], Described]:
    """Return a scenario with [log], the streams that it describes, without refused fixes, and what else it says."""
    scenario = load_scenario(str(path))
    log = scenario.log
    if log is None:
        raise InputError(f"{path} has no table [log]: inspect recorded files, or a scenario that describes them.")
    stream, clock, notes = inertial_stream(log.imu)
    even = even_times(stream.time, 1e-6 * log.imu.clock_drift_ppm)
    clock, stream = _on_described_clock(log.imu, clock, replace(stream, time=even, axes=None))  # turned
    streams = [Streams(Path(log.imu.file), "text", clock, inertial={"imu": stream}, notes=notes)]
    if log.gnss is not None:
        fixes, clock, notes = fix_stream(log.gnss)
        clock, fixes = _on_described_clock(log.gnss, clock, fixes)
        fixes = fixes.rows(np.isfinite(quality_factor(fixes, log.gnss)))
        streams.append(Streams(Path(log.gnss.file), "text", clock, fixes={"gnss": fixes}, notes=notes))
    delay = 0.0 if log.gnss is None else log.gnss.velocity_delay_s
    return (
        scenario,
        streams,
        Described(delay, log.imu.matrix, None if log.reference is None else _reference(log.reference, scenario)),
    )


def _reference(section: LogReference, scenario: Scenario) -> tuple[Clock, SolutionStream] | None:
    """Return the clock of a reference, and the solution with the attitude of the unit; None without attitude."""
    stream, clock, _ = solution_stream(section)
    if not isinstance(stream, SolutionStream) or stream.q_nb is None:
        return None
    clock, stream = _on_described_clock(section, clock, stream)
    assert stream.q_nb is not None
    return clock, replace(stream, q_nb=rotation.multiply(stream.q_nb, mounting(scenario).q_bs))


def _on_described_clock(section: LogFile, clock: Clock, stream: _Stream) -> tuple[Clock, _Stream]:
    """Return clock and stream with the first row and the time offset that a scenario gives."""
    first = None if section.first_row is None else gps_instant(section.first_row, section.clock)
    zero = file_clock(clock, float(stream.time[0]), first).zero
    if zero is None:
        return clock, replace(stream, time=stream.time + section.time_offset_s)
    described = Clock(clock.kind if first is None else "gps", zero.seconds, clock.note)
    return described, replace(stream, time=stream.time + (zero.fraction + section.time_offset_s))


def _decided(result: Inspection, layout: Layout) -> None:
    """Say of the readings of columns that nobody described what the scenario corrects, and what it assumes."""
    of_reading = [f for f in result.findings if f.subject == "units and axes"]
    for finding in of_reading:
        if finding.grade == "wrong":
            text = (
                f"In the unchanged file, {finding.numbers['best_other']}: {finding.text[0].lower()}{finding.text[1:]}"
            )
            corrected = replace(finding, grade="doubt", text=text, fix="The scenario contains the correction.")
            if not layout.gyro_unit_sure and finding.numbers["best_other"].startswith("the rates are in"):
                corrected = replace(
                    finding, grade="fact", text=f"By the fixes, {finding.text[0].lower()}{finding.text[1:]}", fix=""
                )
            result.findings[result.findings.index(finding)] = corrected
    if not layout.gyro_unit_sure and not any(f.grade != "doubt" for f in of_reading):
        text = f"Neither names nor fixes give the unit of the gyros. Is it {layout.gyro_unit}, as their size suggests?"
        result.findings.append(doubt("units and axes", text, "See the manual of the IMU."))


def _of_sum(files: list[Streams], guessed: Guessed) -> tuple[Inspection, Guessed]:
    """Return the inspection of a sum of acceleration and gravity, with the sign and the unit that the data show."""
    assert guessed.unit is not None
    table, layout = guessed.unit
    sign = relative_sign(table, layout)
    first = opposite(layout) if sign < 0 else layout
    tried = []
    for candidate in (first, *other_units(table, first)):
        changed = replace(guessed, unit=(table, candidate))
        streams = [s for s in files if s.path not in guessed.paths] + changed.streams()
        inspection = inspect_streams(_with_fixes(streams))
        _decided(inspection, candidate)
        tried.append((inspection, changed, streams))
        if any(f.subject == "units and axes" and f.grade == "fact" for f in tried[-1][0].findings):
            break  # another unit is tried only if this one does not fit the fixes
    else:
        tried = tried[:1]
    result, guessed, files[:] = tried[-1]
    text = "The specific force is the sum of a gravity vector and an acceleration without gravity"
    if sign:
        text += f", with {'the same sign' if sign > 0 else 'opposite signs'}: gravity slowly follows that sum."
        result.findings.append(fact("accelerometers", text))
    else:
        text += ". The data do not show whether both have the same sign convention, which is assumed."
        fix = "If possible, record the accelerometers with gravity."
        result.findings.append(doubt("accelerometers", text, fix))
    if not any(f.subject == "units and axes" and f.grade == "fact" for f in result.findings):
        text = "The data do not show whether the sum points up or down at rest; up, as in Android, is assumed."
        fix = "For down, as in iOS, reverse the signs of log.imu.accel and log.imu.gravity."
        result.findings.append(doubt("accelerometers", text, fix))
    return result, guessed


_SHOWN = 5  # lines named one by one


def _uneven(table: TextTable, layout: Layout) -> Iterator[Finding]:
    """Yield what is wrong with files of a unit in which rows have another width, which a run does not read."""
    others = (other[0] for other in (layout.other, layout.gravity) if other is not None)
    for path, of in {part.path: part for part in (table, *others)}.items():
        if of.uneven and not of.rows:  # a run that selects rows does not see the others
            lines, count = [str(line) for line in of.uneven[:_SHOWN]], len(of.uneven)
            named = ", ".join(lines) + (f" and {count - _SHOWN} more" if count > _SHOWN else "")
            text = (
                f"{count} row{'s' * (count > 1)} {'have' if count > 1 else 'has'} another number of fields than the "
                f"{of.values.shape[1]} of the others: line{'s' * (count > 1)} {named}."
            )
            fix = "The inspection leaves them out, and a run refuses the file: repair or remove them."
            yield wrong(str(path), text, fix, uneven_rows=count)


def _words(table: TextTable, layout: Layout) -> str:
    """Return the sentence on the columns."""

    def three(name: str) -> str:
        of, columns = layout.columns(table, name)
        signs = layout.gyro_signs if name == "gyro" else layout.accel_signs
        words = ", ".join(f"{'-' * (s < 0)}{of.label(k)}" for k, s in zip(columns, signs, strict=True))
        return words if of is table else f"{words} of {of.path.name}"

    time = "dates" if layout.time in table.dates else layout.time_unit
    added = ""
    if layout.gravity is not None:
        at, of = layout.gravity
        added = (
            f" plus gravity {', '.join(str(at.label(k)) for k in of.accel or ())} of {at.path.name} [{of.accel_unit}]"
        )
    return (
        f"Columns, by their numbers{'' if table.names is None else ' and names'}: time {table.label(layout.time)} "
        f"[{time}], gyros {three('gyro')} [{layout.gyro_unit}], accelerometers {three('accel')} "
        f"[{layout.accel_unit}]{added}, {layout.kind}."
    )


def _scenario(result: Inspection, files: list[Streams], guessed: Guessed, folder: Path, land: bool) -> str | None:
    unit = next((f for f in files if f.inertial), None)
    if unit is None or (unit.format == "text" and guessed.unit is None):  # described already
        return None
    keys: dict[str, Any] = {"format": unit.format, **_stream_key(unit.inertial)}
    if guessed.unit is None and (np.diff(next(iter(unit.inertial.values())).time) == 0.0).any():
        keys["stamps"] = "even"
    if guessed.unit is not None:
        keys |= guessed.unit[1].description(guessed.unit[0], folder)
        keys |= corrected_columns(result, keys) or {}
    receiver = next((f for f in files if f.fixes), None)
    of_receiver = None
    if receiver is not None:
        of_fixes = next((layout.description(table) for table, layout in guessed.fixes), {})
        of_receiver = (
            receiver.path,
            {"format": receiver.format, **_stream_key(receiver.fixes), **of_fixes},
            receiver.clock,
        )
    solution = next(
        (f for f in files if any(np.isfinite(track.latitude).any() for track in f.solutions.values())), None
    )
    reference = None if solution is None else (solution.path, solution.format, solution.clock)
    return suggested_scenario(result, (unit.path, keys, unit.clock), of_receiver, folder, reference, land=land)


def _stream_key(streams: Mapping[str, object]) -> dict[str, str]:
    """Return the key that names the first of several streams of a file, which is the inspected one."""
    return {"stream": next(iter(streams))} if len(streams) > 1 else {}


NAME = "suggested.toml"
"""File of the suggested scenario in the run directory."""


@dataclass(frozen=True)
class Suggestion:
    """A scenario for recorded files."""

    text: str  # of the scenario's file; its paths are absolute
    doubts: tuple[str, ...] = ()  # sentences on what is doubtful in the files


def are_raw(names: Sequence[str]) -> bool:
    """Return whether the arguments of a run are recorded files, and not a scenario."""
    if len(names) == 1:
        (name,) = names
        if Path(name).suffix not in ("", ".toml") and not Path(name).exists():
            raise InputError(f"{name} does not exist; give a scenario, or recorded files.")
        return not name.endswith(".toml") and Path(name).exists() and name not in list_content("scenarios")
    scenario = next((name for name in names if name.endswith(".toml")), None)
    if scenario is not None:
        raise InputError(
            f"run takes one scenario, or recorded files. {scenario} is a scenario, one of {len(names)} arguments."
        )
    return True


def suggest(paths: Sequence[Path], progress: Progress = silent, *, trial: bool = True) -> Suggestion:
    """Return the scenario that recorded files suggest: their navigation, or a simulated unit on their track. `paths`:
    files of an inertial unit and a receiver, or one file of fixes or of a solution; `trial`: as for `inspect`."""
    for path in paths:
        if path.is_dir() and (path / "summary.json").is_file():
            raise InputError(
                f"{path} is a run directory: `sinssim run {path / 'scenario.toml'} -o DIR` repeats the run, and "
                f"`sinssim view {path}` shows it."
            )
        if path.is_dir() and not candidates(path):
            raise InputError(f"{path} is a folder, but of no format that is a folder. Give the recorded files in it.")
    if len(paths) == 1 and candidates(paths[0]):
        streams = read_file(paths[0])
        if not streams.inertial:
            return Suggestion(_track(paths[0], streams.format))
    inspected = inspect(paths, Path("/nowhere"), trial=trial, progress=progress)
    wrong = [finding.sentence for finding in inspected.inspection.findings if finding.grade == "wrong"]
    if wrong:
        raise InputError(
            f"the files cannot be used as they are: {' '.join(wrong)} `sinssim inspect {' '.join(map(str, paths))}` "
            "tells all findings."
        )
    if inspected.scenario is None:
        named = ", ".join(map(str, paths))
        raise InputError(
            f"{named}: there are no inertial data. A single file of fixes or of a solution is run as a track "
            "(sinssim run drive.gpx); a table needs the names time_s, latitude_deg, longitude_deg and height_m."
        )
    doubts = [f for f in inspected.inspection.findings if f.grade == "doubt"]
    doubts.sort(key=lambda f: f.subject != "trial")  # what it means for the navigation comes first
    return Suggestion(inspected.scenario, tuple(f.sentence for f in doubts))


def _track(path: Path, name: str) -> str:
    """Return a scenario with the motion of a track and a simulated unit."""
    stem = "".join(c if c.isalnum() and c.isascii() else "_" for c in path.stem.lower()).strip("_") or "track"
    return "\n".join(
        [
            f"name = {json.dumps(stem)}",
            f"description = {json.dumps(f'Along the track {path.name}', ensure_ascii=False)}",
            "",
            "[track]",
            f"file = {json.dumps(path.resolve().as_posix(), ensure_ascii=False)}",
            f'format = "{name}"',
            'vehicle = "land"  # assumed; "aircraft" or "sea" have other attitudes',
            "",
            "[imu]",
            'grade = "mems-tactical"  # assumed; see `sinssim list grades`',
            "",
        ]
    )
