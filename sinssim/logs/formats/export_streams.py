"""Exports a run in a format of another program: the chosen streams and the date of time 0.

Files are written beside their place and then renamed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.logs.formats import DEFAULT_START, WRITERS
from sinssim.logs.gps_time import date_from_gps, parse_date
from sinssim.logs.log_settings import outage_spans
from sinssim.logs.recorded_log import withheld
from sinssim.logs.recorded_streams import FixStream, InertialStream, SolutionStream
from sinssim.logs.stored_run import RecordedRun
from sinssim.system.files import Draft, draft, publish
from sinssim.system.registries import load_entry


@dataclass(frozen=True)
class Content:
    """What is written of a run."""

    run: RecordedRun  # the run
    start_gps_s: float  # GPS time of the run's time 0, to the microsecond
    solution_name: str = "truth"  # "truth" or the reference of a log, a solution, or a satellite receiver for its fixes
    imu_name: str | None = None  # "measured", "ideal" or "compensated"; None if the run has no inertial readings
    rate_hz: float | None = None  # most samples a second of a solution, None for all
    outages: tuple[tuple[float, float], ...] = ()  # beginning and end of the spans whose fixes are withheld, s

    @cached_property
    def solution(self) -> SolutionStream:
        """The chosen solution; fixes of a receiver as a solution without attitude."""
        if self.solution_name in self.run.fixes:
            return self._thinned(self.fix(self.solution_name).as_solution())
        return self._thinned(self.run.solution(self.solution_name))

    @cached_property
    def imu(self) -> InertialStream:
        """The chosen inertial readings."""
        if self.imu_name is None:
            raise InputError(f"{self.run.path} has no inertial data with three gyros; this format needs them.")
        return self.run.increments(self.imu_name)

    @cached_property
    def fixes(self) -> dict[str, FixStream]:
        """The fixes of the run's satellite receivers, by name."""
        return {name: self.fix(name) for name in self.run.fixes}

    def fix(self, name: str) -> FixStream:
        """Return the fixes of a receiver that are not withheld."""
        fixes = self.run.fix(name)
        return fixes.rows(~withheld(fixes.time, self.outages)) if self.outages else fixes

    @cached_property
    def motion(self) -> SolutionStream:
        """The truth; of a run on recorded sensors the reference or the best solution."""
        return self.run.solution(self.run.motion)

    @cached_property
    def origin(self) -> tuple[float, float, float]:
        """The true place at the start: latitude, longitude, rad, and height, m; origin of local axes."""
        truth = self.motion
        return float(truth.latitude[0]), float(truth.longitude[0]), float(truth.height[0])

    def with_rate(self, most_hz: float) -> Content:
        """Return the same content with at most so many samples a second, unless a rate was given."""
        return self if self.rate_hz is not None else replace(self, rate_hz=most_hz)

    def _thinned(self, stream: SolutionStream) -> SolutionStream:
        """Leave out samples above the rate; kept ones are unchanged."""
        if self.rate_hz is None or len(stream) < 2:
            return stream
        step = float(np.median(np.diff(stream.time)))
        every = max(1, int(np.ceil(1.0 / (self.rate_hz * step) - 1e-6)))
        if every == 1:
            return stream
        rows = slice(None, None, every)
        parts: dict[str, Any] = {n: v[rows] for n, v in vars(stream).items() if isinstance(v, np.ndarray)}
        return replace(
            stream,
            **parts,
        )

    def stamps(self, time: Array) -> tuple[Array, Array]:
        """Return the run's own times, (N,) s, as whole GPS seconds and nanoseconds, (N,) int64 each, without loss of
        digits."""
        whole = int(self.start_gps_s // 1.0)
        ns = np.round(time * 1e9).astype(np.int64) + 1000 * round(1e6 * (self.start_gps_s - whole))
        seconds, rest = np.divmod(ns, 1_000_000_000)
        return seconds + whole, rest


def choose(run: RecordedRun, start_gps_s: float, names: list[str], rate_hz: float | None) -> Content:
    """Return the content that names choose, of a solution, a receiver, and a kind of inertial readings, each at most
    once: by default the truth (of a log the reference, or the best solution), and the measured readings. Time 0 of the
    run is a GPS time."""
    imus = run.inertial
    imu: str | None = next((kind for kind in ("measured", "ideal") if kind in imus), None)
    solution = run.motion
    known = [*run.solutions, *run.fixes, *imus]
    chosen: dict[str, str] = {}
    for name in names:
        if name not in known:
            raise unknown_name(f"stream of {run.path}", name, known)
        what = "inertial data" if name in imus else "solution"
        if what in chosen:
            raise InputError(f"--solution {chosen[what]} and --solution {name} both choose the {what}; give one.")
        chosen[what] = name
        if name in imus:
            imu = name
        else:
            solution = name
    return Content(run, start_gps_s, solution, imu, rate_hz)


@dataclass(frozen=True)
class Export:
    """A format that runs are exported in."""

    suffix: str  # suffix of its file, "" if it is a folder
    holds: str  # what goes into it: "solution" for one solution, "run" for the truth or a solution, readings and fixes
    write: Callable[[Content, Path], list[str]]  # writes it, and says in sentences what is where


@dataclass(frozen=True)
class Exported:
    """An export."""

    place: Path  # the file or folder
    files: tuple[Path, ...]  # the files written, relative to the place's parent
    sentences: tuple[str, ...]  # what is where, with units, axes and clock


def export_of(name: str) -> Export:
    """Return a format of exports by its name."""
    loaded = load_entry(WRITERS, name, "sinssim.logs.formats", ("SUFFIX", "HOLDS", "write"))
    return loaded if isinstance(loaded, Export) else Export(loaded.SUFFIX, loaded.HOLDS, loaded.write)


def export(
    run: Path | str,
    to: str,
    out: Path | str | None = None,
    *,
    solution: list[str] | tuple[str, ...] = (),
    start: str | None = None,
    rate_hz: float | None = None,
    outages: Sequence[str] = (),
    overwrite: bool = False,
) -> Exported:
    """Write a run in another program's format.

    Args:
        to: key of `WRITERS`.
        out: the file or folder; beside the run directory if not given.
        solution: what is written: "truth" (of a log "reference"), a solution, a satellite receiver, and a kind of
            inertial readings.
        start: date of the run's time 0, UTC; by default that of the log, or `DEFAULT_START`.
        outages: spans whose fixes are withheld, as `sinssim run --outage` takes them.
    """
    writer = export_of(to)
    recorded = RecordedRun(Path(run))
    if rate_hz is not None and not rate_hz > 0.0:
        raise InputError(f"--rate {rate_hz:g}: the rate of samples must be positive, in hertz.")
    start_gps = date_of_run(recorded, start)
    content = choose(recorded, start_gps, list(solution), rate_hz)
    if len(content.motion) < 2:
        raise InputError(f"{run} has fewer than two samples.")
    content = _with_outages(content, outages, to, writer)
    place = Path(out) if out is not None else _default_place(recorded, to, writer.suffix)
    _check_place(place, folder=not writer.suffix, overwrite=overwrite)
    try:
        sentences, files = _write(writer, content, place)
    except OSError as error:
        raise InputError(f"{place} cannot be written: {error.strerror or error}. Nothing was changed.") from error
    return Exported(place, tuple(files), (*sentences, *_of_all(content)))


_WHOLE = ("parquet", "euroc")
"""Formats of whole runs that have no fixes, or contain every stream as it is."""


def _with_outages(content: Content, written: Sequence[str], to: str, writer: Export) -> Content:
    """Return the content without the fixes of outages."""
    if not written:
        return content
    if not content.run.fixes:
        raise InputError(f"--outage: {content.run.path} has no GNSS fixes that could be withheld.")
    if to in _WHOLE or (writer.holds == "solution" and content.solution_name not in content.run.fixes):
        raise InputError(
            f"--outage: this export to {to} contains no fixes from which any could be withheld. Export to another "
            f"format, or the fixes as a solution (--solution {next(iter(content.run.fixes))})."
        )
    time = content.motion.time
    return replace(content, outages=outage_spans(written, float(time[0]), float(time[-1])))


def date_of_run(run: RecordedRun, start: str | None) -> float:
    """Return the GPS time of a run's time 0: seconds; of a log to the microsecond. `start`: its date, UTC; None for
    that of its log, or for `DEFAULT_START` if it has none."""
    if start is None and run.start_gps_s is not None:
        return run.start_gps_s
    return parse_date(DEFAULT_START if start is None else start, "--start")


def _of_all(content: Content) -> list[str]:
    """Return sentences that hold for every format."""
    date = f"{date_from_gps(content.start_gps_s):%Y-%m-%dT%H:%M:%SZ}"
    sentences = [f"The run's time 0 is {date} (--start)."]
    if content.run.of_log:
        part = f"{content.start_gps_s % 1.0:.3f}"[1:]
        sentences = [
            f"The run's time 0 is {date[:-1]}{part}Z, the first row of the log." if part != ".000" else sentences[0]
        ]
        sentences.append(
            f"It is a run on recorded sensors without a true motion: {content.solution_name} stands for it."
            if content.solution_name == content.run.motion
            else "It is a run on recorded sensors."
        )
        sentences += [
            f"The velocities of {name} have other times than its positions, and are left out."
            for name, fixes in content.fixes.items()
            if fixes.velocity_ned is None and f"{name}_velocity" in content.run.streams("aiding_")
        ]
    if content.outages:
        spans = ", ".join(f"{begin:g} to {end:g} s" for begin, end in content.outages)
        count = ", ".join(
            f"{len(content.run.fix(name)) - len(fixes)} of {name}" for name, fixes in content.fixes.items()
        )
        sentences.append(f"The fixes in {spans} are withheld (--outage): {count}.")
    if content.run.ellipsoid != "wgs84":
        sentences.append(f"Its coordinates are on the ellipsoid {content.run.ellipsoid}, and are written as they are.")
    return sentences


def _default_place(run: RecordedRun, to: str, suffix: str) -> Path:
    parent = run.path.resolve().parent
    return parent / (f"{run.name}{suffix}" if suffix else f"{run.name}-{to}")


def _check_place(place: Path, *, folder: bool, overwrite: bool) -> None:
    """Refuse a place that is taken."""
    if not folder and place.is_dir():
        raise InputError(f"{place} is a folder; give the name of a file with -o.")
    if folder and place.exists() and not place.is_dir():
        raise InputError(f"{place} is a file; this format is a folder. Give another name with -o.")
    taken = place.exists() and (not folder or any(place.iterdir()))
    if taken and not overwrite:
        raise InputError(f"{place} exists. Give another name with -o, or replace it with --overwrite.")


def _write(writer: Export, content: Content, place: Path) -> tuple[list[str], list[Path]]:
    """Write beside the place and rename; return the sentences and the files."""
    place.parent.mkdir(parents=True, exist_ok=True)
    if writer.suffix:
        with draft(place) as beside:
            return writer.write(content, beside), [Path(place.name)]
    with Draft(place.parent, place.name) as folder:
        sentences = writer.write(content, folder.path)
        files = publish(folder, place.resolve())
    return sentences, [Path(place.name, file) for file in files]
