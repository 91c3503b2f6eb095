"""Scores solutions of other programs against the truth of a run, as if they were algorithms of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.ellipsoids import Ellipsoid, ellipsoid_by_name
from sinssim.earth.geodetic_coordinates import geodetic_about, q_en
from sinssim.errors import InputError, unknown_name
from sinssim.logs.formats import read_file
from sinssim.logs.gps_time import match_clock
from sinssim.logs.recorded_streams import SolutionStream, Streams
from sinssim.logs.reference_solution import Reference, TruthAt, interpolation_error, reference_of
from sinssim.logs.stored_run import RecordedRun
from sinssim.strapdown.navigation_error import NavError, axes_of, navigation_error

Rows = NDArray[np.intp]
_EDGE = 1e-6  # s: a solution's stamps may lie this far outside the run, by rounding


@dataclass(frozen=True)
class Score:
    """A solution scored against a run."""

    name: str  # of the algorithm
    path: Path  # the file
    format: str  # of the file
    solution: NavSolution  # its rows within the run, on the run's clock; what it lacks is NaN
    error: NavError  # against the truth; what it lacks is NaN
    seconds: float | None  # time that it took to compute, if told, s
    sentences: tuple[str, ...]  # on clock, datum, axes, rows, interpolation
    # σ that the file gives: of position and velocity (north, east, down, m and m/s), of tilt (never given) and of the
    # heading, rad; (N, 9), NaN where it gives none, None if it gives none at all
    sigma: Array | None = None


@dataclass(frozen=True)
class Judge:
    """Scores solutions against one run: its truth, or the reference of a run on recorded sensors."""

    run: RecordedRun  # the run
    start_gps_s: float  # GPS time of its time 0, as it was exported

    @cached_property
    def ellipsoid(self) -> Ellipsoid:
        """Of the run's coordinates."""
        return ellipsoid_by_name(self.run.ellipsoid)

    @cached_property
    def _samples(self) -> SolutionStream:
        return self.run.solution(self.run.motion)

    @cached_property
    def reference(self) -> Reference | None:
        """What a run on recorded sensors is compared with; None for a simulated run, which has a truth."""
        return reference_of(self.run) if self.run.of_log else None

    @property
    def against(self) -> str:
        """What solutions are compared with: "the truth", or the name of the reference."""
        return "the truth" if self.reference is None else f"the reference {self.reference.name}"

    @cached_property
    def truth(self) -> TruthAt:
        """The truth at any instant."""
        return TruthAt(self._samples, self.ellipsoid)

    @cached_property
    def interpolation(self) -> tuple[float, float]:
        """Error of interpolating the truth: m, rad."""
        return interpolation_error(self._samples, self.ellipsoid)

    @property
    def axes(self) -> str:
        """Axes in which errors are compared, as in the run."""
        frame = str(self.run.scenario.get("navigation", {}).get("frame", "north"))
        return axes_of(frame, self._samples.latitude)

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the run, s."""
        if self.reference is not None:
            return float(self.reference.time[0]), float(self.reference.time[-1])
        return float(self.truth.time[0]), float(self.truth.time[-1])

    def score(
        self,
        path: Path,
        *,
        name: str | None = None,
        format_name: str | None = None,
        antenna: str | None = None,
        seconds: float | None = None,
    ) -> Score:
        """Score one file as an algorithm of a name, by default the file's, and in a format, by default found from the
        file. The solution is for the antenna of a satellite receiver, or else for the sensor block."""
        streams = read_file(path, format_name)
        stream, about_format = _solution_in(streams)
        stream, placed = self._on_earth(stream)
        match = match_clock(streams.clock, stream.time, self.start_gps_s, self.span, str(path))
        time = stream.time + match.offset
        first, last = self.span
        rows = np.flatnonzero((time >= first - _EDGE) & (time <= last + _EDGE) & np.isfinite(stream.latitude))
        if len(rows) < 2:
            raise InputError(
                f"{path} has {len(rows)} rows within the run, from {first:g} s to {last:g} s; 2 are needed."
            )
        if (np.diff(time[rows]) <= 0.0).any():
            k = int(rows[int(np.argmax(np.diff(time[rows]) <= 0.0)) + 1])
            raise InputError(f"{path}, row {k + 1}: its time is not after that of the row before.")
        time = time[rows].clip(first, last)
        if self.reference is not None:
            known, solution = _filled(stream, rows, time, _nothing(len(rows)))
            error = self._against_reference(solution, known, antenna)
        else:
            truth = self._truth_at(time, antenna)
            known, solution = _filled(stream, rows, time, truth)
            error = navigation_error(truth, solution, self.ellipsoid, self.axes)
        solution, error = _without(known, solution, error)
        sentences = [
            *about_format, match.sentence, *placed, *self._about_rows(stream, rows, time), *_lacking(known),
            *self._about_comparison(error, antenna),
            *streams.notes,
        ]  # fmt: skip
        return Score(
            name or path.stem, path, streams.format, replace(solution, algorithm=name or path.stem), error, seconds,
            tuple(sentences), _sigma(stream, rows),
        )  # fmt: skip

    def _against_reference(self, solution: NavSolution, known: _Known, antenna: str | None) -> NavError:
        """Return the differences from the reference, NaN where it is not known."""
        reference = self.reference
        assert reference is not None
        arm = np.array(reference.lever_arm)
        if antenna is not None:
            if antenna not in self.run.fixes:
                raise unknown_name(f"GNSS receiver of {self.run.path}", antenna, self.run.fixes)
            if np.abs(arm - self.run.lever_arm(antenna)).max() > 1e-9:
                raise InputError(
                    f"--antenna {antenna}: its lever arm is not that of the reference, which has the positions of "
                    "another point; score a solution of the sensor block."
                )
            reference = replace(reference, lever_arm=(0.0, 0.0, 0.0))
        elif arm.any() and not known.attitude:
            raise InputError(
                f"the reference {reference.name} has a lever arm of {np.linalg.norm(arm):.3g} m, and the solution has "
                "no attitude to turn it with: give --antenna if it is one of that antenna, or a solution with attitude."
            )
        return reference.error_of(solution)

    def _about_comparison(self, error: NavError, antenna: str | None) -> list[str]:
        """Say what a solution is compared with, and how exactly that is known."""
        place = f"the antenna of {antenna}" if antenna else "the sensor block"
        reference = self.reference
        if reference is None:
            return [f"It is compared with the truth of {place}."]
        rows = np.asarray(np.isfinite(error.position_ned).all(axis=1))
        missing = [what for what in ("velocity", "attitude") if what not in reference.knows]
        sentences = [
            f"It is compared with the reference {reference.name}"
            + (f", which has no {' and no '.join(missing)}" if missing else "")
            + f". The reference is interpolated, and known at {int(rows.sum())} of {len(rows)} rows."
        ]
        sigma = reference.sigma_at(error.time[rows])
        if sigma is not None and len(sigma):
            level = float(np.sqrt(np.nanmean(np.sum(sigma[:, :2] ** 2, axis=1))))
            sentences.append(
                f"The reference's own σ is {level:.2g} m horizontally (rms); smaller errors are insignificant."
            )
        return sentences

    def _truth_at(self, time: Array, antenna: str | None) -> NavState:
        if antenna is None:
            return self.truth.state(time)
        if antenna not in self.run.fixes:
            raise unknown_name(f"GNSS receiver of {self.run.path}", antenna, self.run.fixes)
        return self.truth.antenna(time, np.array(self.run.lever_arm(antenna)))

    def _on_earth(self, stream: SolutionStream) -> tuple[SolutionStream, list[str]]:
        """Return a solution with coordinates; local positions are placed at the run's true start."""
        if stream.local_enu is None:
            return stream, []
        t = self._samples
        origin = float(t.latitude[0]), float(t.longitude[0]), float(t.height[0])
        latitude, longitude, height = geodetic_about(origin, stream.local_enu)
        sentence = "Its positions are east, north, up from the run's true start, the origin of sinssim's own exports."
        # axes of the origin's level to those of the place's
        turn = rotation.multiply(rotation.conjugate(q_en(latitude, longitude)), q_en(*origin[:2]))
        velocity = None if stream.velocity_ned is None else rotation.rotate(turn, stream.velocity_ned)
        q_nb = None if stream.q_nb is None else rotation.multiply(turn, stream.q_nb)
        place = replace(stream, latitude=latitude, longitude=longitude, height=height, datum="ellipsoid")
        return replace(place, velocity_ned=velocity, q_nb=q_nb), [sentence]

    def _about_rows(self, stream: SolutionStream, rows: Rows, time: Array) -> list[str]:
        """Say how many rows are used, and how exact the truth is at them."""
        left = len(stream) - len(rows)
        outside = f"; {left} outside the run or without a position are left out" if left else ""
        sentences = [f"{len(rows)} rows, from {time[0]:.3f} s to {time[-1]:.3f} s{outside}."]
        if self.reference is not None:
            return sentences
        exact = int(self.truth.at_samples(time).sum())
        if exact == len(time):
            sentences.append("All rows are at samples of the truth.")
        else:
            position, angle = self.interpolation
            sentences.append(
                f"{exact} rows are at samples of the truth; between them it is interpolated, to about {position:.1g} m "
                f"and {np.degrees(angle) * 3600.0:.1g} arcsec."
            )
        return sentences

    def run_errors(self, span: tuple[float, float]) -> dict[str, NavError]:
        """Return the errors of the run's own algorithms within a span. `span`: first and last time, s."""
        errors = {}
        for name in self.run.algorithms:
            rows = self.run.errors(name)
            part = rows[:, (rows[0] >= span[0] - _EDGE) & (rows[0] <= span[1] + _EDGE)]
            if part.shape[1]:
                errors[name] = NavError(part[0], part[1:4].T.copy(), part[4:7].T.copy(), part[7:10].T.copy())
        return errors


def _solution_in(streams: Streams) -> tuple[SolutionStream, list[str]]:
    """Return the solution of a file, or its fixes as one."""
    solutions = {**{n: f.as_solution() for n, f in streams.fixes.items()}, **streams.solutions}
    if not solutions:
        raise InputError(
            f"{streams.path} ({streams.format}) holds no positions that could be scored; a solution has time and "
            "position."
        )
    name, stream = list(solutions.items())[-1]
    sentences = [
        f"Format {streams.format}" + (f", stream {name!r} of {', '.join(solutions)}." if len(solutions) > 1 else ".")
    ]
    sentences.append(
        {
            "ellipsoid": "Heights are above the ellipsoid.",
            "mean sea level": "Heights are above mean sea level: the height error contains the geoid's undulation.",
            "unknown": "The file does not state the datum of its heights; they are taken as above the ellipsoid.",
        }[stream.datum]
    )
    if stream.q_nb is not None:
        sentences.append("The attitude is that of forward-right-down axes to north-east-down.")
    return stream, sentences


def _sigma(stream: SolutionStream, rows: Rows) -> Array | None:
    """Return what `Score.sigma` holds. The σ of roll and pitch are about body axes, and are left out."""
    if stream.position_sigma is None and stream.velocity_sigma is None and stream.attitude_sigma is None:
        return None
    sigma = np.full((len(rows), 9), np.nan)
    for columns, given in ((slice(0, 3), stream.position_sigma), (slice(3, 6), stream.velocity_sigma)):
        if given is not None:
            sigma[:, columns] = given[rows]
    if stream.attitude_sigma is not None:
        sigma[:, 8] = stream.attitude_sigma[rows, 2]
    return sigma


def _nothing(count: int) -> NavState:
    """Return states that stand for what a solution lacks where there is no truth; their errors are never shown."""
    zero, q_nb = np.zeros(count), np.tile((1.0, 0.0, 0.0, 0.0), (count, 1))
    return NavState(zero, zero, zero, np.zeros((count, 3)), q_nb)


@dataclass(frozen=True)
class _Known:
    """What a solution has."""

    height: bool
    velocity: bool
    vertical_velocity: bool
    attitude: bool


def _filled(stream: SolutionStream, rows: Rows, time: Array, truth: NavState) -> tuple[_Known, NavSolution]:
    """Return a whole solution in which the truth stands for what the file lacks, and what it has."""
    height = stream.height[rows]
    velocity = truth.velocity_ned if stream.velocity_ned is None else stream.velocity_ned[rows]
    q_nb = truth.q_nb if stream.q_nb is None else stream.q_nb[rows]
    known = _Known(
        bool(np.isfinite(height).any()),
        stream.velocity_ned is not None and bool(np.isfinite(velocity[:, :2]).any()),
        stream.velocity_ned is not None and bool(np.isfinite(velocity[:, 2]).any()),
        stream.q_nb is not None,
    )
    velocity = velocity.copy()
    if known.velocity and not known.vertical_velocity:
        velocity[:, 2] = truth.velocity_ned[:, 2]
    if not known.height:
        height = truth.height
    defect = np.abs(np.linalg.norm(q_nb, axis=1) - 1.0) if known.attitude else np.zeros(len(rows))
    return known, NavSolution(time, stream.latitude[rows], stream.longitude[rows], height, velocity, q_nb, defect)


def _without(known: _Known, solution: NavSolution, error: NavError) -> tuple[NavSolution, NavError]:
    """Put NaN where the file has nothing, so that no error of 0 is claimed."""
    if not known.height:
        error.position_ned[:, 2] = np.nan
        solution = replace(solution, height=np.full(len(solution.time), np.nan))
    if not known.velocity:
        error.velocity_ned[:] = np.nan
        solution = replace(solution, velocity_ned=np.full((len(solution.time), 3), np.nan))
    if not known.attitude:
        error.attitude[:] = np.nan
        solution = replace(solution, q_nb=np.full((len(solution.time), 4), np.nan))
    return solution, error


def _lacking(known: _Known) -> list[str]:
    """Say what the solution lacks."""
    missing = [
        name for name, has in (("height", known.height), ("velocity", known.velocity), ("attitude", known.attitude))
        if not has
    ]  # fmt: skip
    sentences = [f"It has no {' and no '.join(missing)}; it is scored by what it has."] if missing else []
    if known.velocity and not known.vertical_velocity:
        sentences.append("It has no vertical velocity; its velocity error is the horizontal one.")
    return sentences


def common_span(scores: list[Score]) -> tuple[float, float]:
    """Return the time that all scored solutions cover, over which they are ranked: first and last time, s."""
    first = max(float(s.error.time[0]) for s in scores)
    last = min(float(s.error.time[-1]) for s in scores)
    if not last > first:
        raise InputError("the solutions have no time in common; score them one by one.")
    return first, last
