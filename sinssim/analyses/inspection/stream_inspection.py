"""Inspects recorded files: what the data are, what is doubtful, and what to describe: `inspect_streams`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from sinssim import earth
from sinssim.analyses.inspection.clock_offset import (
    GOOD,
    Offset,
    agreement,
    clock_drift,
    even_times,
    fine_offset,
    offset_finding,
)
from sinssim.analyses.inspection.gnss_findings import delay_findings, delayed, fix_findings, interval_of, velocity_delay
from sinssim.analyses.inspection.quiet_spans import (
    AtRest,
    Moves,
    at_rest,
    fast_noise,
    motion_of,
    rates_of,
    rest_findings,
    scale_finding,
    vibration_finding,
)
from sinssim.analyses.inspection.stream_findings import (
    Finding,
    channel_findings,
    doubt,
    fact,
    rate_findings,
    span_text,
    time_findings,
    wrong,
)
from sinssim.analyses.inspection.unit_axes import Mounting, attitude_by_match, attitude_finding, mounting
from sinssim.analyses.inspection.velocity_match import Pushed, Seen, pushed, seen
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.units import DEG, G0

_UNKNOWN_GRAVITY = 9.80665


@dataclass
class Inspection:
    """What is known of recorded files."""

    # all sentences, in the order of the files and then of what joins them
    findings: list[Finding] = field(default_factory=list)
    inertial: InertialStream | None = None  # the inertial stream; None without
    fixes: FixStream | None = None  # the fixes; None without
    quiet: AtRest | None = None  # readings in quiet spans
    # densities of what changes from sample to sample in the whole log, rad/√s and m/s/√s, (3,) each
    fast: tuple[Array, Array] | None = None
    # rms of the match of the velocities, m/s; that of the worst window if their errors last; None if the reading of the
    # inertial data is not certain
    residual: float | None = None
    # biases of gyros and accelerometers by the match, (6,) rad/s and m/s²; None like `residual`
    bias: Array | None = None
    lasting: bool = False  # whether errors of the fixes last, as the match shows
    sound: tuple[float, float] | None = None  # part of the fixes that is inspected and used, s; None for all of them
    offset: float | None = None  # the unit's clock minus that of the positions, s; None if unknown
    stated: float | None = None  # the same as the files state it, s; None if they do not
    late: float = 0.0  # how much later the unit's stamps are than the files state, s; 0 if the data do not show it
    # the same by the least residual of the match, where it is not much less than others; 0 otherwise
    unproven_late: float = 0.0
    drift: float = 0.0  # how much faster the unit's clock runs than that of the receiver, s/s; 0 if the data show none
    velocity_delay: float | None = None  # age of the velocities at their stamps, s; None if unknown
    mounting: Mounting | None = None  # the unit in its vehicle; None if unknown
    # gives roll, pitch and heading of the unit at an instant on its clock, rad, by the match, and the 1σ of the
    # heading, or None; None if the reading of the inertial data is not certain
    attitude: Callable[[float], tuple[Array, float] | None] | None = None
    # matrices from the stated readings of gyros and accelerometers to the right ones, (3, 3); None if the stated ones
    # are right
    reading: tuple[Array, Array] | None = None

    @property
    def stated_axes(self) -> tuple[str, str, str] | None:
        """The directions of the unit's axes that its format states; None if there are none, or gravity contradicts."""
        contradicted = any("gravity_along" in f.numbers for f in self.findings)
        return None if self.inertial is None or contradicted else self.inertial.axes

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
    """What a scenario says beside the streams of its files."""

    delay: float = 0.0  # of the velocities, s
    # matrix from the columns of the file to the axes of the inertial stream, (3, 3)
    axes: Array = field(default_factory=lambda: np.eye(3))
    # clock of a reference solution, and the solution with the attitude of the unit; None if there is none
    reference: tuple[Clock, SolutionStream] | None = None


def inspect_streams(files: Sequence[Streams], described: Described | None = None) -> Inspection:
    """Inspect recorded files together: an inertial unit, a satellite receiver, or both."""
    result, description = Inspection(), described or Described()
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
        delay = velocity_delay(result.fixes)
        result.velocity_delay = delay.value if delay is not None and delayed(delay, interval_of(result.fixes)) else None
        result.findings += delay_findings(result.fixes, delay, description.delay)
        of_fixes = fix_findings(result.fixes, result.velocity_delay or 0.0)
        result.findings += of_fixes
        result.sound = next((f.numbers["sound_s"] for f in of_fixes if "sound_s" in f.numbers), None)
        begin, end = result.sound or (-np.inf, np.inf)
        used = result.fixes.has_fix & (result.fixes.time >= begin) & (result.fixes.time <= end)
        result.fixes = result.fixes.rows(used) if used.any() else result.fixes
    if not inertial:
        return result
    result.inertial = inertial[0][2]
    of_unit = inertial[0][1], result.inertial.time
    result.findings += [*time_findings(*of_unit), *rate_findings(*of_unit)]
    readings = _inspect_readings(result)
    if readings is None:
        return result
    moves = None
    if fixes:
        readings, moves = _inspect_together(result, readings, inertial[0][0], fixes[0][0], description)
    result.quiet = at_rest(*readings, moves)
    every = np.ones(len(readings[0]), dtype=bool)
    result.fast = fast_noise(readings[0], readings[1], every), fast_noise(readings[0], readings[2], every)
    result.findings += rest_findings(result.quiet, moves)
    result.findings += vibration_finding(*readings, result.quiet)
    if result.inertial.axes is not None:
        result.findings += _axes_and_gravity(readings[2], result.inertial.axes)
    return result


_ALONG = 0.9
"""Least share of gravity along an axis that is then vertical: 25° of tilt, more than the mean of any vehicle's."""


def _axes_and_gravity(force: Array, axes: tuple[str, str, str]) -> Iterable[Finding]:
    """Yield the doubt on stated axes of which a horizontal one is vertical by the mean specific force."""
    mean = force.mean(axis=0)
    k = int(np.argmax(np.abs(mean)))
    if abs(mean[k]) > _ALONG * max(_UNKNOWN_GRAVITY, float(np.linalg.norm(mean))) and axes[k] not in ("up", "down"):
        turned = "The unit is mounted otherwise, and the course is not its heading."
        text = (
            f"The {'xyz'[k]} axis, which the format says points {axes[k]}, points {'up' if mean[k] > 0.0 else 'down'}: "
            f"the mean specific force along it is {mean[k]:.3g} m/s². {turned}"
        )
        yield doubt("mounting", text, "Give log.imu.axes.", gravity_along=axes[k])


def _of_file(streams: Streams) -> Iterable[Finding]:
    """Yield findings on a file as such."""
    contents = [*streams.inertial, *streams.fixes, *streams.solutions, *(o.name for o in streams.others)]
    name = str(streams.path)
    yield fact(name, f"Format {streams.format}: {', '.join(contents) or 'nothing usable'}. {_clock(streams)}")
    for note in streams.notes:
        yield fact(name, note)


def _clock(streams: Streams) -> str:
    clock = streams.clock
    words = {"gps": "GPS time", "utc": "UTC (leap seconds removed)", "machine": "the logger's own clock"}[clock.kind]
    return f"Clock: {words}{f', {clock.note}' if clock.note else ''}."


Readings = tuple[Array, Array, Array]


def _inspect_readings(result: Inspection) -> Readings | None:
    """Add what the readings say by themselves; return times, rates and specific forces if they can be used.

    Specific forces have the right unit: one that explains their size at rest counts more than the stated one.
    """
    stream = result.inertial
    assert stream is not None
    increments = stream.kind == "increments"
    result.findings += channel_findings("gyros", stream.gyro, "°" if increments else "°/s", DEG)
    unit, scale = ("m/s", 1.0) if increments else ("g", G0)
    result.findings += channel_findings("accelerometers", stream.accel, unit, scale)
    if not result.usable:
        return None
    time, rate, force = _clean(stream)
    if len(time) < 10:
        result.findings.append(wrong("readings", f"Only {len(time)} rows are usable.", "Give a longer log."))
        return None
    gravity, fixes = _UNKNOWN_GRAVITY, result.fixes
    if fixes is not None:
        known = np.isfinite(fixes.latitude) & np.isfinite(fixes.height) & (np.abs(fixes.latitude) <= 0.5 * np.pi)
        if known.any():
            place = float(np.median(fixes.latitude[known])), float(np.median(fixes.height[known]))
            gravity = float(np.linalg.norm(earth.gravity_ned(*place)))
    of_scale = scale_finding(stream, at_rest(time, rate, force), gravity)
    result.findings.append(of_scale)
    if of_scale.grade != "wrong":
        return time, rate, force
    factor = of_scale.numbers.get("of_right_unit")
    if factor is None:
        return None
    result.reading = np.eye(3), np.eye(3) / factor
    return time, rate, force / factor


def _clean(stream: InertialStream) -> tuple[Array, Array, Array]:
    """Return times, rates and specific forces of the rows that follow each other in time and have numbers."""
    time, rate, force = rates_of(stream)
    good = np.isfinite(rate).all(axis=1) & np.isfinite(force).all(axis=1) & np.isfinite(time)
    good &= np.append(True, np.diff(np.maximum.accumulate(np.where(np.isfinite(time), time, -np.inf))) > 0.0)
    return time[good], rate[good], force[good]


def _inspect_together(
    result: Inspection, readings: Readings, of_unit: Streams, of_receiver: Streams, described: Described
) -> tuple[Readings, Moves | None]:
    """Add what unit and receiver say of each other: clocks, units and axes, mounting, attitude of a reference. Return
    the readings as the fixes show them, and where the fixes move, on the unit's clock; None if that is unknown."""
    assert result.fixes is not None
    assert result.inertial is not None
    fixes = seen(result.fixes)
    if fixes is None:
        result.findings.append(doubt("clocks", "Too few fixes are usable.", "The unit cannot be compared with them."))
        return readings, None
    time, rate, force = readings
    clocks = of_unit.clock, of_receiver.clock
    agreed = agreement(readings, fixes, *clocks, described.axes, result.inertial.kind)
    result.findings += agreed.readings
    result.stated = agreed.stated
    rate, force = rate @ agreed.gyro.T, force @ agreed.accel.T
    before = (np.eye(3), np.eye(3)) if result.reading is None else result.reading
    if any(finding.grade == "wrong" for finding in agreed.readings) or result.reading is not None:
        result.reading = agreed.gyro @ before[0], agreed.accel @ before[1]
    if agreed.offset is None:
        result.findings.append(_apart(time, fixes, agreed.stated))
        moves = None if agreed.stated is None else motion_of(fixes, agreed.stated)
        return (time, rate, force), moves
    offset = agreed.offset
    if offset.shown:
        time, offset = _without_drift(result, (time, rate, force), fixes, offset)
    delay = result.velocity_delay or 0.0
    shown = replace(agreed, offset=offset)
    result.findings.append(offset_finding(shown, offset.value + delay, *clocks))
    if offset.shown:
        result.offset = offset.value + delay
        if result.findings[-1].grade == "doubt":
            result.late = result.offset - (agreed.stated or 0.0)
    elif agreed.stated is None:
        return (time, rate, force), None
    else:
        result.unproven_late = offset.value + delay - agreed.stated
    at = offset.value if offset.shown or agreed.stated is None else agreed.stated
    if any(f.grade == "fact" for f in agreed.readings):
        result.residual = offset.match.residual
    elif agreed.readings and agreed.readings[-1].numbers.get("turns_agree"):
        # only the turns of the course show the reading: the velocities have errors that last, which no mean removes
        result.residual, result.lasting = float(offset.match.each.max()), True
    if result.residual is not None:
        result.bias = offset.match.bias
    curve = pushed(time, rate, force)
    if result.residual is not None or offset.shown:  # a wrong reading has no clear minimum at an offset
        result.attitude = partial(attitude_by_match, curve, fixes, offset.match, offset.value)
    placed = mounting(curve, fixes, offset.match, offset.value)
    if placed is not None:
        result.findings.append(_mounting_finding(placed))
        result.mounting = placed if placed.known else None
    result.findings += _attitude_of_reference(curve, fixes, offset, described, clocks[0])
    confirmed = offset.shown or result.mounting is not None or any(f.grade == "fact" for f in agreed.readings)
    if result.residual is not None and not confirmed:
        result.findings.append(_UNCONFIRMED)
    return (readings[0], rate, force), motion_of(fixes, at)


def _attitude_of_reference(
    curve: Pushed, fixes: Seen, offset: Offset, described: Described, unit_clock: Clock
) -> list[Finding]:
    """Return what the motion says of the attitude of a reference, if there is one that has an attitude."""
    if described.reference is None or (q_nb := described.reference[1].q_nb) is None:
        return []
    clock, given = described.reference
    origins = clock.origin_gps_s, unit_clock.origin_gps_s
    shift = origins[0] - origins[1] if origins[0] is not None and origins[1] is not None else 0
    finding = attitude_finding(curve, fixes, offset.match, offset.value, given.time + shift, q_nb)
    return [] if finding is None else [finding]


MAY_BE_WORSE = ": navigation may be worse than the fixes alone"
_UNCONFIRMED = doubt(
    "navigation",
    f"The motion confirms neither units and axes nor the offset of the clocks nor the mounting{MAY_BE_WORSE}.",
    "Run the suggested scenario with --outage 5/20, which compares it with the fixes alone.",
    may_be_worse=True,
)


def _apart(time: Array, fixes: Seen, stated: float | None) -> Finding:
    """Return the doubt on clocks that nothing joins."""
    if stated is None:
        text = "The clocks of unit and receiver have no common origin, and the turns of both show no offset."
        return doubt("clocks", text, "Which was the time of the first row? Give it as first_row.")
    begin, end = float(fixes.time[0] + stated), float(fixes.time[-1] + stated)
    common = min(float(time[-1]), end) - max(float(time[0]), begin)
    spans = f"{span_text(time[0], time[-1])} and {span_text(begin, end)} on the unit's clock"
    if common <= 0.0:
        text = f"Unit and receiver do not overlap: {spans}."
        return doubt("clocks", text, "Give the offset of the clocks, and see that the files are of the same day.")
    inside = int(np.sum((fixes.time + stated >= time[0]) & (fixes.time + stated <= time[-1])))
    text = f"Unit and receiver overlap by {common:.4g} s with {inside} fixes ({spans}), too little to compare them."
    return doubt("clocks", text, "A comparison needs 10 s or more with at least 8 fixes: give a longer log.")


def _without_drift(
    result: Inspection, readings: tuple[Array, Array, Array], fixes: Seen, offset: Offset
) -> tuple[Array, Offset]:
    """Return times that run as fast as those of the receiver, with the offset of these times; add the finding."""
    time = readings[0]
    drift = clock_drift(readings, fixes, offset, GOOD * fixes.sigma)
    if drift is None:
        return time, offset
    even = even_times(time, drift.value)
    late = drift.value * float(time[-1] - time[0])
    better = fine_offset(pushed(even, *readings[1:]), fixes, offset.value - 0.5 * late)
    if better is None or better.match.residual > offset.match.residual:
        return time, offset
    result.drift = drift.value
    ppm, sigma = 1e6 * drift.value, 1e6 * drift.sigma
    text = (
        f"The unit's clock runs {'fast' if ppm > 0.0 else 'slow'} by {abs(ppm):.0f} ± {sigma:.0f} ppm relative to that "
        f"of the fixes: {abs(late):.3f} s over the log."
    )
    fix = f"Describe it: clock_drift_ppm = {ppm:.0f}, and the offset at the first row."
    result.findings.append(doubt("clocks", text, fix, imu_clock_drift_ppm=ppm, sigma_ppm=sigma))
    return even, better


def _mounting_finding(mount: Mounting) -> Finding:
    """Return the finding on the mounting."""
    roll, pitch, yaw = np.degrees(mount.angles)
    sigma = np.degrees(mount.sigma)
    text = (
        f"If the vehicle moves where it points, x, y, z of the unit point {', '.join(mount.axes)}, turned by roll "
        f"{roll:.2f}°, pitch {pitch:.2f} ± {sigma[0]:.2f}°, yaw {yaw:.2f} ± {sigma[1]:.2f}° (from {mount.windows} "
        "windows)."
    )
    numbers = {"axes": list(mount.axes), "mounting_deg": [float(roll), float(pitch), float(yaw)]}
    if not mount.known:
        return doubt(
            "mounting", f"Is this the mounting? {text}", "The motion hardly shows it: see how it is.", **numbers
        )
    return fact("mounting", text, **numbers)
