"""Inspects recorded files: what the data are, what is doubtful, and what to describe: `inspect_streams`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sinssim import earth
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.inspection.channels import channel_findings
from sinssim.inspection.clocks import NEAR, Offset, coarse_offset, fine_offset, velocity_delay
from sinssim.inspection.drift import clock_drift, even_times
from sinssim.inspection.finding import Finding, doubt, fact, wrong
from sinssim.inspection.fixes import fix_findings
from sinssim.inspection.hypotheses import judge_reading
from sinssim.inspection.mounting import Mounting, attitude_finding, mounting
from sinssim.inspection.stamps import time_findings
from sinssim.inspection.standing import (
    AtRest,
    at_rest,
    rates_of,
    rest_findings,
    scale_finding,
    vibration_finding,
)
from sinssim.inspection.velocity_match import Seen, pushed, seen
from sinssim.logs.streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.units import DEG, G0

_UNKNOWN_GRAVITY = 9.80665


@dataclass
class Inspection:
    """What is known of recorded files.

    Attributes:
        findings: all sentences, in the order of the files and then of what joins them.
        inertial: the inertial stream; None without.
        fixes: the fixes; None without.
        quiet: readings in quiet spans.
        offset: the unit's clock minus that of the positions, s; None if unknown.
        drift: how much faster the unit's clock runs than that of the receiver, s/s; 0 if the data show none.
        velocity_delay: age of the velocities at their stamps, s; None if unknown.
        mounting: the unit in its vehicle; None if unknown.
        reading: matrices from the stated readings of gyros and accelerometers to the right ones, (3, 3); None if the
            stated ones are right.
    """

    findings: list[Finding] = field(default_factory=list)
    inertial: InertialStream | None = None
    fixes: FixStream | None = None
    quiet: AtRest | None = None
    offset: float | None = None
    drift: float = 0.0
    velocity_delay: float | None = None
    mounting: Mounting | None = None
    reading: tuple[Array, Array] | None = None

    @property
    def usable(self) -> bool:
        """Whether nothing is wrong."""
        return all(f.grade != "wrong" for f in self.findings)

    def as_dict(self) -> dict[str, Any]:
        """Return findings and numbers as plain data."""
        return {
            "usable": self.usable,
            "findings": [
                {"subject": f.subject, "grade": f.grade, "text": f.text, "fix": f.fix, "numbers": f.numbers}
                for f in self.findings
            ],
            "imu_clock_minus_gnss_clock_s": self.offset,
            "imu_clock_drift_ppm": 1e6 * self.drift,
            "velocity_delay_s": self.velocity_delay,
            "axes": None if self.mounting is None else list(self.mounting.axes),
            "mounting_deg": None if self.mounting is None else np.degrees(self.mounting.angles).tolist(),
        }


@dataclass(frozen=True)
class Described:
    """What a scenario says beside the streams of its files.

    Attributes:
        delay: of the velocities, s.
        reference: clock of a reference solution, and the solution with the attitude of the unit; None if there is none.
    """

    delay: float = 0.0
    reference: tuple[Clock, SolutionStream] | None = None


def inspect_streams(files: Sequence[Streams], described: Described | None = None) -> Inspection:
    """Inspect recorded files together: an inertial unit, a satellite receiver, or both.

    Args:
        files: the streams of each file.
        described: what a scenario says beside the streams.

    Returns:
        The findings.

    Raises:
        InputError: no file has inertial readings or fixes.
    """
    result, said = Inspection(), described or Described()
    for streams in files:
        result.findings += _of_file(streams)
    inertial = [(s, name, i) for s in files for name, i in s.inertial.items()]
    fixes = [(s, name, f) for s in files for name, f in s.fixes.items()]
    if not inertial and not fixes:
        names = ", ".join(str(s.path) for s in files)
        raise InputError(f"{names}: there are neither inertial data nor GNSS fixes to inspect.")
    if fixes:
        result.fixes = fixes[0][2]
        result.findings += time_findings(fixes[0][1], result.fixes.time, "fixes")
        result.velocity_delay = velocity_delay(result.fixes)
        result.findings += _delay_findings(result.fixes, result.velocity_delay, said.delay)
        result.findings += fix_findings(result.fixes, result.velocity_delay or 0.0)
    if inertial:
        result.inertial = inertial[0][2]
        result.findings += time_findings(inertial[0][1], result.inertial.time)
        _inspect_readings(result)
    if inertial and fixes and result.usable:
        _inspect_together(result, inertial[0][0], fixes[0][0], described)
    return result


def _of_file(streams: Streams) -> Iterable[Finding]:
    """Yield findings on a file as such."""
    held = [*streams.inertial, *streams.fixes, *streams.solutions, *(o.name for o in streams.others)]
    name = str(streams.path)
    yield fact(name, f"Format {streams.format}: {', '.join(held) or 'nothing usable'}. {_clock(streams)}")
    for note in streams.notes:
        yield fact(name, note)


def _clock(streams: Streams) -> str:
    clock = streams.clock
    words = {"gps": "GPS time", "utc": "UTC (leap seconds removed)", "machine": "the logger's own clock"}[clock.kind]
    return f"Clock: {words}{f', {clock.note}' if clock.note else ''}."


def _delay_findings(fixes: FixStream, delay: float | None, described: float) -> list[Finding]:
    """Return the finding on the delay of the velocities, which a description may give already."""
    if delay is None:
        return []
    step = float(np.median(np.diff(fixes.time)))
    text = f"The velocities are {1e3 * delay:.0f} ms older than the positions of the same stamp"
    numbers = {"velocity_delay_s": delay}
    if described and abs(delay - described) < 0.1 * step:
        return [fact("fixes", f"{text}; {1e3 * described:.0f} ms are described.", **numbers)]
    if described:
        text += f"; {1e3 * described:.0f} ms are described"
    elif abs(delay) < 0.1 * step:
        return [fact("fixes", f"{text}, a tenth of their interval at most.", **numbers)]
    why = " (half an interval: they are means over it)" if abs(delay / step - 0.5) < 0.15 else ""
    return [doubt("fixes", f"{text}{why}.", f"Describe a velocity delay of {delay:.3f} s.", **numbers)]


def _inspect_readings(result: Inspection) -> None:
    """Add what the readings say by themselves."""
    stream = result.inertial
    assert stream is not None
    increments = stream.kind == "increments"
    result.findings += channel_findings("gyros", stream.gyro, "°" if increments else "°/s", DEG)
    unit, scale = ("m/s", 1.0) if increments else ("g", G0)
    result.findings += channel_findings("accelerometers", stream.accel, unit, scale)
    if not result.usable:
        return
    time, rate, force = _clean(stream)
    if len(time) < 10:
        result.findings.append(wrong("readings", f"Only {len(time)} rows are usable.", "Give a longer log."))
        return
    result.quiet = at_rest(time, rate, force)
    gravity, fixes = _UNKNOWN_GRAVITY, result.fixes
    if fixes is not None:
        known = np.isfinite(fixes.latitude) & np.isfinite(fixes.height) & (np.abs(fixes.latitude) <= 0.5 * np.pi)
        if known.any():
            place = float(np.median(fixes.latitude[known])), float(np.median(fixes.height[known]))
            gravity = float(np.linalg.norm(earth.gravity_ned(*place)))
    result.findings.append(scale_finding(stream, result.quiet, gravity))
    result.findings += rest_findings(result.quiet, float(np.median(np.diff(time))))
    result.findings += vibration_finding(time, rate, force, result.quiet)


def _clean(stream: InertialStream) -> tuple[Array, Array, Array]:
    """Return times, rates and specific forces of the rows that follow each other in time and have numbers."""
    time, rate, force = rates_of(stream)
    good = np.isfinite(rate).all(axis=1) & np.isfinite(force).all(axis=1) & np.isfinite(time)
    good &= np.append(True, np.diff(np.maximum.accumulate(np.where(np.isfinite(time), time, -np.inf))) > 0.0)
    return time[good], rate[good], force[good]


def _inspect_together(result: Inspection, of_unit: Streams, of_receiver: Streams, described: Described | None) -> None:
    """Add what unit and receiver say of each other: clocks, units and axes, mounting, attitude of a reference."""
    assert result.inertial is not None
    assert result.fixes is not None
    curve_of_fixes = seen(result.fixes)
    if curve_of_fixes is None:
        result.findings.append(doubt("clocks", "Too few fixes are usable.", "The unit cannot be compared with them."))
        return
    time, rate, force = _clean(result.inertial)
    origins = of_unit.clock.origin_gps_s, of_receiver.clock.origin_gps_s
    about: float | None = None
    if origins[0] is not None and origins[1] is not None:
        about = float(origins[1] - origins[0])
    elif origins == (None, None):
        about = 0.0  # files without dates count from the same instant, unless their motion says otherwise
    agreed = _clock_offset(
        (time, rate, force), curve_of_fixes, about, "machine" in (of_unit.clock.kind, of_receiver.clock.kind)
    )
    known = agreed is not None and agreed[1] is not None
    offset = None if agreed is None else agreed[0]
    about = about if agreed is None else agreed[2]
    if about is None or offset is None:
        result.findings.append(
            doubt(
                "clocks",
                "The clocks of unit and receiver have no common origin, and the turns of both show no offset."
                if about is None
                else f"Unit and receiver do not overlap: {time[0]:.6g} to {time[-1]:.6g} s and "
                f"{curve_of_fixes.time[0]:.6g} to {curve_of_fixes.time[-1]:.6g} s on their clocks.",
                "Give the offset of the clocks, and see that the files are of the same day.",
            )
        )
        return
    time, offset = _without_drift(result, (time, rate, force), curve_of_fixes, offset)
    reading = judge_reading(time, rate, force, curve_of_fixes, offset.value, about)
    if reading.gyro is not None and reading.accel is not None:
        result.reading = reading.gyro, reading.accel
    if reading.gyro is not None and reading.accel is not None:  # clocks and mounting follow from the right reading
        rate, force = rate @ reading.gyro.T, force @ reading.accel.T
        offset = fine_offset(pushed(time, rate, force), curve_of_fixes, about) or offset
    result.offset = offset.value + (result.velocity_delay or 0.0)
    result.findings.append(_offset_finding(offset, result.offset, agreed[1] if known and agreed is not None else None))
    result.findings += reading.findings
    result.mounting = mounting(pushed(time, rate, force), curve_of_fixes, offset.match, offset.value)
    if result.mounting is not None:
        result.findings.append(_mounting_finding(result.mounting))
    reference = None if described is None else described.reference
    if reference is not None and reference[1].q_nb is not None:
        clock, given = reference
        shift = clock.origin_gps_s - origins[0] if clock.origin_gps_s is not None and origins[0] is not None else 0
        curve, q_nb = pushed(time, rate, force), reference[1].q_nb
        found = attitude_finding(curve, curve_of_fixes, offset.match, offset.value, given.time + shift, q_nb)
        result.findings += [] if found is None else [found]


def _without_drift(
    result: Inspection, readings: tuple[Array, Array, Array], fixes: Seen, offset: Offset
) -> tuple[Array, Offset]:
    """Return times that run as fast as those of the receiver, with the offset of these times; add the finding."""
    time = readings[0]
    found = clock_drift(readings, fixes, offset, _GOOD * fixes.sigma)
    if found is None:
        return time, offset
    even = even_times(time, found.value)
    late = found.value * float(time[-1] - time[0])
    better = fine_offset(pushed(even, *readings[1:]), fixes, offset.value - 0.5 * late)
    if better is None or better.match.residual > offset.match.residual:
        return time, offset
    result.drift = found.value
    ppm, sigma = 1e6 * found.value, 1e6 * found.sigma
    text = (
        f"The unit's clock runs {'fast' if ppm > 0.0 else 'slow'} by {abs(ppm):.0f} ± {sigma:.0f} ppm relative to that "
        f"of the fixes: {abs(late):.3f} s over the log."
    )
    fix = f"Describe it: clock_drift_ppm = {ppm:.0f}, and the offset at the first row."
    result.findings.append(doubt("clocks", text, fix, imu_clock_drift_ppm=ppm, sigma_ppm=sigma))
    return even, better


_GOOD = 5.0
"""Residual in units of the velocities' σ up to which an offset is trusted without a search for another one."""
_BETTER = 1.5
"""Factor by which another offset must reduce the residual."""
_LEAP = 18.0
"""GPS time minus UTC since 2017, s: dates that do not say which of the two they are may be off by it."""


def _clock_offset(
    readings: tuple[Array, Array, Array], fixes: Seen, stated: float | None, undeclared: bool
) -> tuple[Offset, float | None, float] | None:
    """Return the offset of the clocks, the stated one (None if the clocks have nothing in common), and its first guess.

    Args:
        readings: times, rates and specific forces.
        fixes: the curve of the fixes.
        stated: offset that the files state, s; None if they state none.
        undeclared: whether a file does not tell its time scale, which may be GPS time or UTC.
    """
    curve = pushed(*readings)
    first = None if stated is None else fine_offset(curve, fixes, stated)
    if first is not None and stated is not None and first.match.residual < _GOOD * fixes.sigma:
        return first, stated, stated
    best: tuple[Offset, float | None, float] | None = None
    if first is not None and stated is not None:
        best = first, stated, stated
    guesses: list[tuple[float, float | None]] = []
    if stated is not None and undeclared:
        guesses += [(stated - _LEAP, stated), (stated + _LEAP, stated)]
    coarse = coarse_offset(readings[0], readings[1], fixes)
    if coarse is not None and (stated is None or abs(coarse - stated) > NEAR):
        guesses.append((coarse, None if stated == 0.0 or stated is None else stated))
    for guess, origin in guesses:
        other = fine_offset(curve, fixes, guess)
        if other is not None and (best is None or _BETTER * other.match.residual < best[0].match.residual):
            best = other, origin, guess
    return best


def _offset_finding(offset: Offset, value: float, stated: float | None) -> Finding:
    """Return the finding on the clocks."""
    uncertain = "" if np.isnan(offset.sigma) else f" ± {1e3 * offset.sigma:.0f} ms"
    numbers = {"imu_clock_minus_gnss_clock_s": value, "sigma_s": offset.sigma}
    if stated is None:
        word = "ahead of" if value >= 0.0 else "behind"
        text = (
            f"The unit's clock is {abs(value):.3f} s{uncertain} {word} that of the positions, by the match of the "
            "velocities."
        )
        fix = "Describe this offset: the clocks have no common origin."
        return doubt("clocks", text, fix, **numbers)
    late = value - stated
    text = (
        f"The stamps of the unit are {1e3 * abs(late):.0f} ms{uncertain} {'late' if late > 0.0 else 'early'} relative "
        "to those of the positions."
    )
    limit = max(3.0 * (0.0 if np.isnan(offset.sigma) else offset.sigma), 0.01)
    if abs(late) <= limit:
        return fact("clocks", text, **numbers)
    return doubt("clocks", text, f"Describe a time offset of {-late:.3f} s (time_offset_s of the unit).", **numbers)


def _mounting_finding(found: Mounting) -> Finding:
    """Return the finding on the mounting."""
    roll, pitch, yaw = np.degrees(found.angles)
    sigma = np.degrees(found.sigma)
    text = (
        f"If the vehicle moves where it points, x, y, z of the unit point {', '.join(found.axes)}, turned by roll "
        f"{roll:.2f}°, pitch {pitch:.2f} ± {sigma[0]:.2f}°, yaw {yaw:.2f} ± {sigma[1]:.2f}° (from {found.windows} "
        "windows)."
    )
    numbers = {"axes": list(found.axes), "mounting_deg": [float(roll), float(pitch), float(yaw)]}
    return fact("mounting", text, **numbers)
