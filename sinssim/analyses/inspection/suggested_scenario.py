"""The scenario that an inspection suggests: files, columns, axes, clocks, mounting, noise, as a TOML text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.analyses.inspection.inertial_columns import relative
from sinssim.analyses.inspection.log_corrections import SHORTEST_STOP, bridges, clock_keys, first_stop, since, starts
from sinssim.analyses.inspection.quiet_spans import IMPOSSIBLE, AtRest
from sinssim.analyses.inspection.stream_inspection import Inspection
from sinssim.analyses.inspection.velocity_match import Seen, seen
from sinssim.logs.recorded_streams import Clock, geoid_height
from sinssim.sensors.aiding.gnss import WORST, first_course
from sinssim.sensors.imu.grades import GRADE_TABLE
from sinssim.units import DEG_H, DEG_SQRT_H, G0

_BRIDGED = 0.1
"""Gap that is bridged without a key, s: the default of max_gap_s."""


def suggested_scenario(
    inspection: Inspection,
    inertial: tuple[Path, dict[str, Any], Clock],
    fixes: tuple[Path, dict[str, Any], Clock] | None,
    folder: Path,
    reference: tuple[Path, str, Clock] | None = None,
    *,
    land: bool = False,
) -> str:
    """Return the text of a scenario's file to start from, with the reason beside each number. Of the unit, and of the
    receiver if there is one, it takes path, keys that describe the columns (none for a known format), and clock; of a
    reference solution path, format and clock: without fixes it gives emulated ones. Paths are relative to the
    scenario's folder; on `land` the vehicle is known to move on wheels."""
    path, keys, clock = inertial
    begin = list(_begin(inspection, of_reference=fixes is None and reference is not None))
    lines = [
        *(f"# {f.sentence}" for f in inspection.findings if {"worse_than_fixes", "may_be_worse"} & f.numbers.keys()),
        f'name = "{_name(path)}"',
        f'description = "Recorded by {path.name}"',
        "",
        *begin,
        "[log.imu]",
        f"file = {_text(relative(path, folder))}",
    ]
    lines += _file_keys(keys)
    axes = inspection.mounting.axes if inspection.mounting else None
    if axes is not None and inspection.stated_axes is None:
        lines.append(f"axes = {list(axes)!r}  # from the direction of motion and gravity".replace("'", '"'))
    elif axes is None and _contradicted(inspection):
        lines.append('axes = ["forward", "right", "down"]  # which are they? Gravity contradicts those of the format')
    if inspection.drift:
        lines.append(f"clock_drift_ppm = {1e6 * inspection.drift:.1f}  # match with the fixes, over the whole log")
    receiver = fixes[2] if fixes else reference[2] if reference else None
    lines += _lines(clock_keys(inspection, clock, receiver))
    dated = receiver is not None and receiver.origin_gps_s is not None
    if clock.origin_gps_s is None and dated and not inspection.offset:
        lines.append('# first_row = "2026-01-01 00:00:00.000"  # which was the GPS time of the first row?')
    if inspection.inertial is not None and (bridge := bridges(inspection.inertial.time, _BRIDGED)[0]) is not None:
        lines.append(f"max_gap_s = {bridge:g}  # the longest gap, which is bridged with more noise")
    ratio = next((f.numbers["of_gravity"] for f in inspection.findings if "of_gravity" in f.numbers), 1.0)
    if not IMPOSSIBLE[0] < ratio < IMPOSSIBLE[1] and inspection.usable:
        lines.append("check_scale = false  # the specific force is far from gravity: is that the motion?")
    lines += list(_tables("log.imu", keys))
    if fixes is not None:
        lines += _gnss(inspection, relative(fixes[0], folder), fixes[1])
    if reference is not None:
        lines += [
            "",
            "[log.reference]  # its attitude is taken as that of the vehicle; mounting_deg transforms it to the IMU",
            f"file = {_text(relative(reference[0], folder))}",
            *_file_keys({"format": reference[1]}),
        ]
    lines += _start(inspection) if fixes is not None else []
    if fixes is None and reference is None:
        lines += ["", "[log.start]  # which are they? A run needs them"]
        lines += [f"# {key} = 0.0" for key in ("latitude_deg", "longitude_deg", "height_m", "heading_deg")]
    lines += ["", *_imu(inspection)]
    if fixes is not None or reference is not None:
        lines += ["", *_filter(inspection, land)]
    if fixes is None and reference is not None and inspection.mounting is not None:
        lines += ["", "[aiding.gnss]  # simulated from the reference: the files contain no fixes"]
    return "\n".join(lines) + "\n"


def _gnss(inspection: Inspection, file: str, keys: dict[str, Any]) -> Iterator[str]:
    """Yield the table [log.gnss]."""
    yield from ("", "[log.gnss]", f"file = {_text(file)}", *_file_keys(keys))
    if inspection.velocity_delay is not None and abs(inspection.velocity_delay) > 1e-3:
        yield f"velocity_delay_s = {inspection.velocity_delay:.3f}  # velocities are older than positions"
    if inspection.fixes is not None and inspection.fixes.datum != "ellipsoid":
        geoid, sure = geoid_height(inspection.fixes), inspection.fixes.datum == "mean sea level"
        why = "the heights are" if sure else "if the heights are"
        key = f"{'' if sure and geoid is not None else '# '}geoid_height_m = {geoid or 0.0:.1f}"
        yield f"{key}  # the geoid's height there (EGM2008), {why} above mean sea level"
    yield from (*_sigmas(inspection), *_quality(inspection), *_tables("log.gnss", keys))


def _begin(inspection: Inspection, *, of_reference: bool) -> Iterator[str]:
    """Yield the span of the run if the satellites or the reference come later, or a gap cannot be bridged."""
    late, last, follows = starts(inspection, of_reference=of_reference), None, ""
    what = "the reference gives the initial state" if of_reference else "first fix, which gives the initial position"
    if inspection.inertial is not None and (span := bridges(inspection.inertial.time, _BRIDGED)[1]) is not None:
        if span[0] > late:
            late, what = span[0], "longest part without a gap of more than 10 s"
        last, follows = span[1], "a gap of more than 10 s follows"
    if inspection.sound is not None and inspection.inertial is not None:
        end = since(inspection, inspection.sound[1])
        if end < (float(np.ptp(inspection.inertial.time)) if last is None else last) - 1.0:
            last, follows = end, "the position jumps then"
    if late or last is not None:
        yield "[log]"
        yield from () if not late else (f"from_s = {late:.3f}  # {what}",)
        yield from () if last is None else (f"to_s = {last:.3f}  # {follows}",)
        yield ""


_SLOWEST_WHEELS = 0.5 / 8
"""Longest interval of samples, s, with which the constraint of wheels and the detector of stops have 8 in a window."""
_SLOWEST_VIBRATION = 0.2 / 3
"""Longest interval of samples that show vibration, s, as `sinssim.sensors.vibration_noise` needs it."""


def _course_known(inspection: Inspection) -> bool | None:
    """Return whether the fixes show a course within the run, as its start needs it; None without fixes."""
    curve = None if inspection.fixes is None else seen(inspection.fixes)
    return None if curve is None else _course(inspection, curve) is not None


def _course(inspection: Inspection, curve: Seen) -> tuple[float, float] | None:
    """Return when the fixes first show a course within the run, s on the unit's clock, and the course, rad."""
    assert inspection.fixes is not None
    begin = starts(inspection)
    later = np.ones(len(curve.time), dtype=bool)
    if inspection.offset is not None:
        later = np.array([since(inspection, t) >= begin for t in curve.time])
    size = max(_SIGMA_DOPPLER[0], inspection.residual or 0.0)  # as `_sigmas` writes it for one fix a second
    if inspection.fixes.velocity_ned is None:
        size = _SIGMA_OF_STEPS
    elif inspection.fixes.velocity_sigma is not None:
        size = curve.sigma
    sigma = np.full(len(curve.time), size)
    north = np.sum(curve.relative * curve.north, axis=1)
    east = np.sum(curve.relative * np.cross(curve.north, curve.up), axis=1)
    first = first_course(curve.time[later], np.column_stack([north, east])[later], sigma[later])
    if first is None:
        return None
    k = int(np.flatnonzero(later)[first[0]])
    return float(curve.time[k]) + (inspection.offset or 0.0), float(np.arctan2(east[k], north[k]))


def _sideways(inspection: Inspection) -> bool:
    """Return whether the vehicle does not point along its first course, as a copter, by three times the 1σ of both."""
    curve = None if inspection.fixes is None else seen(inspection.fixes)
    course = None if curve is None else _course(inspection, curve)
    if course is None or inspection.attitude is None or inspection.mounting is None:
        return False
    matched = inspection.attitude(course[0])
    if matched is None:
        return False
    heading = inspection.mounting.of_vehicle(matched[0])[2]
    off = abs((heading - course[1] + np.pi) % (2.0 * np.pi) - np.pi)
    return bool(off > 3.0 * np.hypot(matched[1], WORST))


def _contradicted(inspection: Inspection) -> bool:
    """Return whether gravity contradicts the axes of the format."""
    return inspection.inertial is not None and inspection.inertial.axes != inspection.stated_axes


def _start(inspection: Inspection) -> list[str]:
    """Return the table [log.start] of a log with fixes: the attitude where the course does not give the heading.

    The course is the heading of a unit whose axes in the vehicle are known, unless the match contradicts it. Otherwise
    the match with the fixes gives the attitude.
    """
    unit = inspection.inertial
    assert unit is not None
    lines, named = ["", "[log.start]"], inspection.stated_axes is not None or inspection.mounting is not None
    matched = None
    sideways = inspection.stated_axes is None and _sideways(inspection)
    if inspection.attitude is not None and (sideways or not named):
        matched = inspection.attitude(float(unit.time[0]) + starts(inspection))
    if matched is not None:
        placed = inspection.mounting
        roll, pitch, heading = np.degrees(matched[0] if placed is None else placed.of_vehicle(matched[0]))
        why = f"by the match with the fixes, ± {np.degrees(matched[1]):.1f}°: the "
        why += "mounting is not known" if placed is None else "vehicle does not point along its first course"
        return [
            *lines,
            f"roll_deg = {roll:.2f}",
            f"pitch_deg = {pitch:.2f}",
            f"heading_deg = {heading % 360.0:.1f}  # {why}",
        ]
    if _course_known(inspection) is False:
        return [*lines, "heading_deg = 0.0  # which is it? The fixes do not move, and show no course"]
    if named:
        return []
    question = "does x of the unit point forward? The course of the fixes is taken as its heading"
    return [*lines, f"# heading_deg = 0.0  # {question}"]


def _name(path: Path) -> str:
    return "".join(c if c.isalnum() and c.isascii() else "_" for c in path.stem.lower()).strip("_") or "log"


def _text(value: str) -> str:
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value) if value != "\t" else '"\\t"'
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_text(key)} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return repr(value)


def _file_keys(keys: dict[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in keys.items() if not isinstance(value, dict)]


def _tables(name: str, keys: dict[str, Any]) -> Iterator[str]:
    for key, value in keys.items():
        if isinstance(value, dict):
            yield ""
            yield f"[{name}.{key}]"
            yield from (f"{_key(inner)} = {_value(item)}" for inner, item in value.items())


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _lines(changes: Iterable[tuple[str, Any, str]]) -> Iterator[str]:
    yield from (f"{key} = {_value(value)}  # {why}" for key, value, why in changes)


def _imu(inspection: Inspection) -> Iterator[str]:
    """Yield the table [imu]: what the filter is told of the unit."""
    yield "[imu]  # description of the IMU for the filter"
    if inspection.mounting is not None:
        angles = ", ".join(f"{a:.2f}" for a in np.degrees(inspection.mounting.angles))
        yield f"mounting_deg = [{angles}]  # if the vehicle moves where it points"
    quiet = inspection.quiet
    if quiet is None or (_vibrates(inspection) and not _shaken(inspection)):
        if inspection.fast is None:
            yield 'grade = "mems-industrial"  # which is it? give the nearest of `sinssim list grades`'
            return
        gyro, accel = (float(np.max(density)) for density in inspection.fast)
        why = "no span is at rest" if quiet is None else "nothing shows how much of the shaking is an error"
        yield f'grade = "{_grade(gyro)}"  # which is it? nearest in noise, with motion in it: {why}'
        yield f"gyro_arw_deg_sqrt_h = {gyro / DEG_SQRT_H:.3g}  # what changes from sample to sample in motion"
        yield f"accel_vrw_ug_sqrt_hz = {accel / (1e-6 * G0):.4g}  # the same"
        of_grade = GRADE_TABLE[_grade(gyro)]
        if inspection.bias is not None:
            biases = np.abs(inspection.bias)
            shown, source = (float(biases[:3].max()), float(biases[3:].max())), "biases by the match with the fixes"
        elif quiet is not None:
            shown, source = _bias_at_rest(inspection, quiet), "measurements at rest"
        else:
            return
        gyro_bias, accel_bias = max(of_grade.gyro.bias, shown[0]), max(of_grade.accel.bias, shown[1])
        yield f"gyro_bias_sigma_deg_h = {gyro_bias / DEG_H:.3g}  # size of the {source}"
        yield f"accel_bias_sigma_ug = {accel_bias / (1e-6 * G0):.4g}  # the same"
        return
    grade = _grade(float(np.min(quiet.gyro_density)))
    yield f'grade = "{grade}"  # nearest in noise; the lines below replace its own'
    # vibration_noise adds the shaking of each axis, that of an engine at rest included: it must not count twice
    shaken = _shaken(inspection)
    which = "calmest" if shaken else "worst"
    gyro, accel = (float(np.min(d) if shaken else np.max(d)) for d in (quiet.gyro_density, quiet.accel_density))
    yield f"gyro_arw_deg_sqrt_h = {gyro / DEG_SQRT_H:.3g}  # of the {which} axis in quiet spans"
    yield f"accel_vrw_ug_sqrt_hz = {accel / (1e-6 * G0):.4g}  # of the {which} axis in quiet spans"
    gyro_bias, accel_bias = _bias_at_rest(inspection, quiet)
    yield f"gyro_bias_sigma_deg_h = {max(gyro_bias / DEG_H, 0.01):.3g}  # size of the measurements at rest"
    size = accel_bias / (1e-6 * G0)
    yield f"accel_bias_sigma_ug = {max(size, 100.0):.4g}  # as large as the departure from gravity at rest"
    floor = GRADE_TABLE[grade].gyro.instability
    if floor:
        yield "gyro_instability_deg_h = 0.0  # the grade's in-run stability is a floor of the Allan deviation:"
        yield f"gyro_flicker_deg_h = {floor / DEG_H:.4g}  # flicker, which makes the bias wander within minutes"


def _bias_at_rest(inspection: Inspection, quiet: AtRest) -> tuple[float, float]:
    """Return the largest reading of the gyros at rest, rad/s, and the departure of the specific force, m/s²."""
    force = float(np.linalg.norm(quiet.specific_force))
    return float(np.max(np.maximum(np.abs(quiet.rate), quiet.hidden[0]))), abs(force - _gravity(inspection))


def _vibrates(inspection: Inspection) -> bool:
    """Return whether the readings shake more in motion than at rest."""
    return any(f.subject == "vibration" and f.grade == "doubt" for f in inspection.findings)


def _shaken(inspection: Inspection) -> bool:
    """Return whether `vibration_noise` describes the shaking in motion.

    It takes a part of the shaking of the second before. The readings have to be fast enough to show it, and, if there
    are fixes, they have to agree with them: otherwise all of the shaking may be an error, jolts after a calm second
    included, and its mean over the whole log is the noise.
    """
    stream = inspection.inertial
    if stream is None or float(np.median(np.diff(stream.time))) > _SLOWEST_VIBRATION:
        return False
    return _vibrates(inspection) and (inspection.fixes is None or inspection.residual is not None)


_SIGMA_FIXED = (0.02, 0.02, 0.04)
"""1σ of a fixed solution of carrier phases as data sheets state it, 1 cm + 1 ppm, with the antenna's motion, m."""
_SIGMA_SINGLE = (2.0, 2.0, 4.0)
"""1σ of a position by code, north, east, down, m: 95 % within 4 m (GPS SPS Performance Standard, 2020, 3.8)."""
_SIGMA_OF_STEPS = 0.15
"""1σ of a velocity by the difference of two positions that are 2 s apart, as a run takes it, m/s."""
_SIGMA_DOPPLER = (0.1, 0.1, 0.2)
"""1σ of a velocity by Doppler shifts, as data sheets state it, with the change within the stamp's uncertainty, m/s."""


_LASTING_S = 1.0
"""Least time for which errors of a receiver's own filter last, s: more fixes within it say nothing new."""


def _sigmas(inspection: Inspection) -> Iterator[str]:
    """Yield standard deviations of the fixes where the file has none: those of the kind of receiver."""
    fixes = inspection.fixes
    if fixes is None:
        return
    lasting = np.sqrt(max(_LASTING_S / np.median(np.diff(fixes.time)), 1.0)) if inspection.lasting else 1.0
    if fixes.position_sigma is None and fixes.covariance is None:
        codes = () if fixes.quality is None else np.unique(fixes.quality)
        words = {fixes.quality_words.get(int(code), "") for code in codes}
        size: tuple[float, ...]
        size, what = (_SIGMA_FIXED, "fixed ambiguities") if words == {"fixed"} else (_SIGMA_SINGLE, "code positions")
        why = f"assumed for {what}: the file has no σ, see the data sheet"
        if lasting > 1.0:
            size, why = tuple(round(float(s * lasting), 1) for s in size), f"{why}; errors last for a second"
        step = max((f.numbers["step_sigma_m"] for f in inspection.findings if "step_sigma_m" in f.numbers), default=0.0)
        if step / np.sqrt(2.0) > size[0]:  # a step has the errors of two fixes
            size, why = tuple(round(float(s / size[0] * step / np.sqrt(2.0)), 2) for s in size), "from the steps"
        yield f"position_sigma_m = {list(size)}  # {why}"
    factor = next((f.numbers["sigma_factor"] for f in inspection.findings if "sigma_factor" in f.numbers), None)
    if factor is not None:
        yield f"sigma_factor = {factor:.3g}  # steps of the position scatter as much more than the stated 1σ"
    if fixes.velocity_ned is not None and fixes.velocity_sigma is None:
        size, why = _SIGMA_DOPPLER, "assumed: the file has no σ"
        if (shown := lasting * (inspection.residual or 0.0)) > size[0]:
            size = tuple(round(float(s / size[0] * shown), 2) for s in size)
            why = "from the match with the inertial data"
        yield f"velocity_sigma_mps = {list(size)}  # {why}"


def _quality(inspection: Inspection) -> Iterator[str]:
    """Yield the codes of quality that are used, if steps of the position contradict what others claim."""
    doubtful = [code for finding in inspection.findings for code in finding.numbers.get("doubtful_codes", ())]
    if doubtful and inspection.fixes is not None and inspection.fixes.quality is not None:
        codes = np.unique(inspection.fixes.quality)
        used = ", ".join(f'"{code}" = 1.0' for code in codes if code not in doubtful)
        yield f"quality_factors = {{ {used} }}  # steps of the position contradict the σ of the other codes"


_WHEELS = (
    "rate_hz = 5.0",
    "sigma_lateral_mps = 0.05  # tyres and suspension, independent from update to update",
    "sigma_vertical_mps = 0.1",
    "drift_lateral_mps = 0.02  # camber and wind, for seconds",
    "drift_vertical_mps = 0.05  # the body pitches on its suspension",
)
"""How well the wheels of a car hold its direction. The noise of the updates has the density of a tenth of a metre per
second over a tenth of a second. A slow error of 0.05 m/s is 0.2° of pitch at 14 m/s, the pitch of a car's body at an
acceleration of 0.1 g (Gillespie, Fundamentals of Vehicle Dynamics, 1992, chapter 7)."""


def _filter(inspection: Inspection, land: bool) -> Iterator[str]:
    """Yield the table [filter], and what a land vehicle adds."""
    yield "[filter]"
    if _shaken(inspection):
        yield "vibration_noise = 0.4  # the inertial data vibrate more in motion than at rest"
    yield "smooth = true"
    why = "the fixes show no course" if _course_known(inspection) is False else ""
    if _contradicted(inspection) and inspection.mounting is None and inspection.attitude is None:
        why = "gravity contradicts the axes of the format"
    if why:
        yield from ("", "[filter.initial_sigma]", f"heading_arcmin = 5400.0  # 90°: {why}")
    if inspection.mounting is None:
        if land:
            yield "# --vehicle land has no effect: the constraint of wheels needs the mounting, which is not known"
        return
    assert inspection.inertial is not None
    if float(np.median(np.diff(inspection.inertial.time))) > _SLOWEST_WHEELS:
        yield "# the nonholonomic constraint and the detection of stops need at least 8 samples in half a second"
        return
    stop = first_stop(inspection)
    off = "" if land else "# "
    if not land:
        yield "# For a land vehicle (--vehicle land), see docs/estimation.md:"
    wheels = (*_WHEELS, "mounting_sigma_deg = 2.0", "lever_arm_sigma_m = 1.0", "slip_sigma_deg_per_g = 3.0")
    yield from ("", f"{off}[aiding.land_vehicle]", *(f"{off}{key}" for key in wheels))
    if stop is None:
        yield ""
        yield f"# no zero velocities: there is no stop of {SHORTEST_STOP:g} s or more, which shows the noise at rest"
        return
    learn = f"learn_s = [[{stop[0]:.1f}, {stop[1]:.1f}]]"
    for table, keys in (
        ("zero_velocity", ("detect = true", learn, "rate_hz = 10.0")),
        ("zero_rate", ("detect = true", learn, "rate_hz = 10.0")),
    ):
        yield ""
        yield f"{off}[aiding.{table}]"
        yield from (f"{off}{key}" for key in keys)


def _grade(noise: float) -> str:
    """Return the grade whose gyros have the random walk nearest to a density, rad/√s."""
    able = {name: grade.gyro.random_walk for name, grade in GRADE_TABLE.items() if grade.gyro.random_walk > 0.0}
    return min(able, key=lambda name: abs(np.log(able[name] / max(noise, 1e-12))))


def _gravity(inspection: Inspection) -> float:
    of_scale = next((f.numbers for f in inspection.findings if "of_gravity" in f.numbers), None)
    return of_scale["specific_force_mps2"] / of_scale["of_gravity"] if of_scale else G0
