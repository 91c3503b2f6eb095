"""What an export holds: the streams of a run that were chosen, and the date of its time 0."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.logs.aiding import withheld
from sinssim.logs.recorded_run import RecordedRun
from sinssim.logs.streams import FixStream, InertialStream, SolutionStream


@dataclass(frozen=True)
class Content:
    """What is written of a run.

    Attributes:
        run: the run.
        start_gps_s: GPS time of the run's time 0, to the microsecond.
        solution_name: "truth" or the reference of a log, a solution, or a satellite receiver for its fixes.
        imu_name: "measured", "ideal" or "compensated"; None if the run has no inertial readings.
        rate_hz: most samples a second of a solution, None for all.
        outages: beginning and end of the spans whose fixes are withheld, s.
    """

    run: RecordedRun
    start_gps_s: float
    solution_name: str = "truth"
    imu_name: str | None = None
    rate_hz: float | None = None
    outages: tuple[tuple[float, float], ...] = ()

    @cached_property
    def solution(self) -> SolutionStream:
        """The chosen solution; fixes of a receiver as a solution without attitude."""
        if self.solution_name in self.run.fixes:
            return self._thinned(solution_of(self.fix(self.solution_name)))
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
        """Return times as whole GPS seconds and nanoseconds, without loss of digits.

        Args:
            time: the run's own time, (N,) s.

        Returns:
            GPS seconds and nanoseconds, (N,) int64 each.
        """
        whole = int(self.start_gps_s // 1.0)
        ns = np.round(time * 1e9).astype(np.int64) + 1000 * round(1e6 * (self.start_gps_s - whole))
        seconds, rest = np.divmod(ns, 1_000_000_000)
        return seconds + whole, rest


def solution_of(fixes: FixStream) -> SolutionStream:
    """Return fixes as a solution without attitude."""
    f = fixes
    return SolutionStream(
        f.time, f.latitude, f.longitude, f.height, f.datum, f.velocity_ned, None, f.position_sigma, f.velocity_sigma
    )


def choose(run: RecordedRun, start_gps_s: float, names: list[str], rate_hz: float | None) -> Content:
    """Return the content that names choose.

    Args:
        start_gps_s: GPS time of its time 0.
        names: names of a solution, a receiver, and a kind of inertial readings; each at most once.

    Returns:
        The content; by default the truth (of a log the reference, or the best solution), and the measured readings.

    Raises:
        InputError: a name is unknown, or two choose the same.
    """
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
