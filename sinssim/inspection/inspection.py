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
from sinssim.inspection.clocks import Offset, coarse_offset, fine_offset, velocity_delay
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
from sinssim.inspection.velocity_match import pushed, seen
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
        velocity_delay: age of the velocities at their stamps, s; None if unknown.
        mounting: the unit in its vehicle; None if unknown.
    """

    findings: list[Finding] = field(default_factory=list)
    inertial: InertialStream | None = None
    fixes: FixStream | None = None
    quiet: AtRest | None = None
    offset: float | None = None
    velocity_delay: float | None = None
    mounting: Mounting | None = None

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
        raise InputError(f"{names}: there are neither inertial readings nor fixes of satellites to inspect.")
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
    if None not in origins:
        assert origins[0] is not None
        assert origins[1] is not None
        about = float(origins[1] - origins[0])
    elif of_unit.path == of_receiver.path or (described is not None and origins == (None, None)):
        about = 0.0  # files of a scenario without dates count from the same instant
    known = about is not None
    if about is None:
        about = coarse_offset(time, rate, curve_of_fixes)
    offset = None if about is None else fine_offset(pushed(time, rate, force), curve_of_fixes, about)
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
    reading = judge_reading(time, rate, force, curve_of_fixes, offset.value, about)
    if reading.gyro is not None and reading.accel is not None:  # clocks and mounting follow from the right reading
        rate, force = rate @ reading.gyro.T, force @ reading.accel.T
        offset = fine_offset(pushed(time, rate, force), curve_of_fixes, about) or offset
    result.offset = offset.value + (result.velocity_delay or 0.0)
    result.findings.append(_offset_finding(offset, result.offset, about if known else None))
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
