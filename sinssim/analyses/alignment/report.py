"""The alignment of one session with its expected errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.alignment.axes import Angles
from sinssim.alignment.base_motion import motion_errors, stillness
from sinssim.alignment.budget import (
    MOTION,
    Method,
    bias_takes_over,
    error_budget,
    expected_errors,
    reading_errors,
    total,
)
from sinssim.alignment.determination import Determination, determine, doubt, solve
from sinssim.alignment.disturbed import align_disturbed
from sinssim.alignment.session import mean_readings
from sinssim.alignment.theory import coefficients, linear
from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.recording.result import Result
from sinssim.system.short_repr import html_table, short_repr
from sinssim.units import ARCMIN, DEG, DEG_H

if TYPE_CHECKING:
    from sinssim.sensors.imu.errors import ImuErrors
    from sinssim.sensors.imu.imu import Imu


@short_repr
@dataclass(frozen=True, eq=False)
class AlignmentResult(Result):
    """One session's alignment.

    Attributes:
        source: name of the scenario or of the log's file.
        method: method of alignment.
        imu: the session.
        determination: the angles and the latitude; the heading in the range of the scenario's [output], if it has one.
        sigma: standard deviations of the sensor block's errors, if known.
        mean: known part of the determination's error (from errors that a scenario fixes), rad, if known.
        budget: standard deviations by source, if known and if the theory holds, rad.
        crossing: session lengths from which bias dominates, s, likewise.
        truth: heading, roll, pitch and latitude of a simulated session, rad.
        residual: root mean square of the residual velocity on a disturbed base, m/s.
        residual_velocity: residual velocity over time, in the block's axes at the first instant, (N+1, 3) m/s.
        mean_angles: result of eq. (1) for a disturbed session, for comparison, rad.
        warmed: time from when the sensors were switched on to the session's first sample, s.
        directory: directory of the alignment; None if none was written.
    """

    source: str
    method: Method
    imu: ImuData
    determination: Determination
    sigma: ImuErrors | None = None
    mean: Angles | None = None
    budget: dict[str, Angles] | None = None
    crossing: Angles | None = None
    truth: Angles | None = None
    residual: float | None = None
    residual_velocity: Array | None = None
    mean_angles: Angles | None = None
    warmed: float = 0.0
    directory: Path | None = None

    def _repr_html_(self) -> str:
        sigma = None if self.budget is None else total(self.budget)
        rows = [
            (name, f"{float(getattr(self.determination, name)) / DEG:.5f}",
             "" if sigma is None else f"{float(getattr(sigma, name)) / ARCMIN:.3g}")
            for name in Angles._fields
        ]  # fmt: skip
        title = f"Alignment of {self.source}, {self.duration:g} s"
        return html_table(title, rows, ("", "determined, deg", "expected error (1σ), arcmin"))

    @property
    def duration(self) -> float:
        """Length of the session, s."""
        return float(self.imu.time[-1] - self.imu.time[0])

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.imu)

    @property
    def error(self) -> Angles | None:
        """Determined minus true angles, rad."""
        if self.truth is None:
            return None
        d = self.determination
        determined = (d.heading, d.roll, d.pitch, d.latitude)
        return Angles(*((a - b + np.pi) % (2.0 * np.pi) - np.pi for a, b in zip(determined, self.truth, strict=True)))

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Plain numbers with units in the names; undetermined values are None."""
        d = self.determination
        result: dict[str, Any] = {
            "source": self.source,
            "method": self.method,
            "duration_s": self.duration,
            "samples": self.samples,
            **{f"{name}_deg": _plain(getattr(d, name) / DEG) for name in Angles._fields},
            "earth_rate_deg_h": _plain(d.earth_rate / DEG_H),
            "gravity_mps2": _plain(d.gravity),
            "warnings": list(d.warnings),
        }
        if self.residual is not None:
            result["residual_velocity_mps"] = self.residual
        if self.mean_angles is not None:
            result["eq_1_on_the_same_data_deg"] = _by_name(self.mean_angles, DEG)
        for name, angles in (("error", self.error), ("known_error", self.mean)):
            if angles is not None:
                result[f"{name}_arcmin"] = _by_name(angles, ARCMIN)
        if self.budget is not None:
            result["sigma_arcmin"] = _by_name(total(self.budget), ARCMIN)
            result["sigma_by_source_arcmin"] = {source: _by_name(self.budget[source], ARCMIN) for source in self.budget}
        if self.crossing is not None:
            result["bias_takes_over_s"] = _by_name(self.crossing, 1.0)
        return result


# Long: checks, determination, budget and report of one session in sequence.
def align_session(
    imu: ImuData,
    source: str,
    sensors: Imu | None = None,
    *,
    method: Method = "quiet",
    latitude: float | None = None,
    truth: Angles | None = None,
    warmed: float = 0.0,
) -> AlignmentResult:
    """Align one session and state the expected errors.

    Args:
        imu: the session.
        source: name of the session.
        sensors: the sensor block's grade and errors, if known.
        method: "quiet" for eq. (1), otherwise gravity's cone, for a moving base.
        latitude: rad, if known; used by the disturbed method.
        truth: true heading, roll, pitch and latitude of a simulated session, rad.
        warmed: time from when the sensors were switched on to the session's first sample, s.

    Returns:
        The report.

    Raises:
        InputError: the increments are unusable, or the vehicle moved and the method does not allow it.
    """
    expected = None if sensors is None else expected_errors(sensors)
    residual = residual_velocity = mean_angles = still = None
    if method == "quiet":
        determination = determine(*mean_readings(imu), None if expected is None else expected.instrument_sigmas)
        still = stillness(imu, expected, warmed)
        still.require()
    else:
        alignment = align_disturbed(imu, latitude)
        determination, residual = alignment.determination, alignment.residual
        residual_velocity = alignment.residual_velocity
        mean_angles, _, _ = solve(*mean_readings(imu))
        method = "disturbed" if latitude is None else "disturbed, latitude known"
    report = AlignmentResult(
        source,
        method,
        imu,
        determination,
        truth=truth,
        residual=residual,
        residual_velocity=residual_velocity,
        mean_angles=mean_angles,
        warmed=warmed,
    )
    where = determination.latitude if latitude is None else np.asarray(latitude)
    if expected is None or not all(map(np.isfinite, (*determination.attitude, where))):
        return report
    known: dict[str, Any] = {
        "method": method,
        "gravity": determination.gravity,
        "start": warmed,
        "rate_hz": len(imu) / report.duration,
    }
    try:
        budget = error_budget(determination.attitude, where, expected.sigma, report.duration, **known)
        crossing = bias_takes_over(determination.attitude, where, expected.sigma, **known)
    except InputError:  # too near a singularity for a first-order theory; the determination has its own warnings
        return report
    by_reading = coefficients(determination.attitude, where, gravity=determination.gravity)
    if still is not None:
        budget[MOTION] = motion_errors(by_reading, still)
    mean = linear(
        by_reading,
        *reading_errors(expected.mean, *mean_readings(imu), report.duration, warmed),
    )
    return replace(
        report,
        determination=doubt(determination, total(budget)),
        sigma=expected.sigma,
        mean=mean,
        budget=budget,
        crossing=crossing,
    )


def _plain(value: Array) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None


def _by_name(angles: Angles, unit: float) -> dict[str, float | None]:
    return {name: _plain(np.asarray(value) / unit) for name, value in zip(Angles._fields, angles, strict=True)}
