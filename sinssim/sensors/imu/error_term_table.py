"""The table of error terms of an inertial sensor block: one row each.

A row of `TERMS` determines the keys of a scenario's [imu] and [compensation] with their limits, the field of
`TriadErrors` and its validation, the labels of report and tables, the line of `sinssim sensors`, and the note on errors
that a filter neglects. What a row multiplies is the effect of its values on a reading, which nothing else states. The
emulator's kernel is composed of it, and the compensation, the filter, the budgets, the monitoring of redundant sensors
and the calibration read it. The resulting position error in closed form is in `sinssim.sensors.error_propagation`.
docs/extending/gyro-error-term.md adds a term.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.units import ARCMIN, ARCSEC, DEG, DEG_H, DEG_SQRT_H, FOOT, G0, MPS_SQRT_H, PPM, UG

DTHETA_STEP, DVEL_STEP = 2.0**-52, 2.0**-46
"""Steps of the angle and velocity increments of a sensor without pulses, rad and m/s. The angle is the spacing of
doubles from 1 on, the velocity half of it near 200 m/s: a navigator resolves no more. Random bits below them would only
make the files of a run longer."""

CORRELATION_TIME = 3600.0
"""Correlation time of the bias instability [s]. Manufacturers do not specify it. Published error models of such sensors
assume one hour (NavToolkit's `ImuModel` presets; the STIM300 and Ellipse2 error table of an article in NAVIGATION, the
journal of the Institute of Navigation, which marks it as not specified by the manufacturer)."""


# The units of data sheets as the ends of keys, in SI.
_ANGLE = {"arcsec": ARCSEC, "arcmin": ARCMIN, "mrad": 1e-3, "urad": 1e-6, "deg": DEG}
_RATE = {"deg_h": DEG_H, "deg_s": DEG, "mdeg_s": 1e-3 * DEG, "urad_s": 1e-6, "rad_s": 1.0}
_ACCELERATION = {"ug": UG, "mg": 1e3 * UG, "g": G0, "mps2": 1.0}
_RATIO = {"ppm": PPM, "percent": 1e-2}
_ANGLE_WALK = {
    "deg_sqrt_h": DEG_SQRT_H,
    "deg_h_sqrt_hz": DEG_H,
    "deg_s_sqrt_hz": DEG,
    "mdeg_s_sqrt_hz": 1e-3 * DEG,
    "rad_s_sqrt_hz": 1.0,
}
_VELOCITY_WALK = {
    "ug_sqrt_hz": UG,
    "mg_sqrt_hz": 1e3 * UG,
    "mps_sqrt_h": MPS_SQRT_H,
    "ftps_sqrt_h": FOOT * MPS_SQRT_H,
    "mps2_sqrt_hz": 1.0,
}
_PER_HOUR = {"h": 3600.0, "s": 1.0}
_PER_DEGREE = {"c": 1.0}
_PER_G = {"g": G0, "mps2": 1.0}


def _per(units: Mapping[str, float], below: Mapping[str, float]) -> dict[str, float]:
    """Return the units of a quotient: every combination, for example "deg_h_per_g". `units`: units of the numerator,
    size in SI by name in a key."""
    return {f"{name}_per_{other}": size / unit for name, size in units.items() for other, unit in below.items()}


_MOST_TILT = 40_000.0  # arcsec: 11 degrees, beyond which the three axes are too far from orthogonal


def _both(
    field: str,
    size: int,
    gyro_units: Mapping[str, float],
    accel_units: Mapping[str, float],
    *,
    gyro: Mapping[str, Any] | None = None,
    accel: Mapping[str, Any] | None = None,
    **shared: Any,
) -> Iterator[ErrorTerm]:
    """Yield the rows of an error common to gyros and accelerometers, with their different descriptions."""
    for triad, units, description in (("gyro", gyro_units, gyro), ("accel", accel_units, accel)):
        yield ErrorTerm(
            **dict[str, Any](name=f"{triad}_{field}", triad=triad, field=field, size=size, units=units)
            | shared
            | dict(description or {})
        )


_ROWS = (
    *_both(
        "bias", 3, _RATE, _ACCELERATION,
        si_unit="{rate}",
        multiplies=lambda sensed, along, force, warmth, time: 1.0,
        label="bias",
        meaning="output at zero input, constant in a run",
        explanation="turn-on biases (ω₀ and a₀ of equation (2))",
        calibrated=True,
        source="bias",
    ),
    *_both(
        "scale", 3, _RATIO, _RATIO,
        si_unit="1",
        multiplies=lambda sensed, along, force, warmth, time: sensed,
        label="scale factor",
        meaning="relative error of the output",
        explanation="relative scale-factor errors (k and h of equation (2))",
        untold="scale factors",
        calibrated=True,
        source="scale factor",
        limits={"gt": -1e6},
    ),
    *_both(
        "misalignment", 6, _ANGLE, _ANGLE,
        si_unit="rad",
        multiplies=lambda sensed, along, force, warmth, time: along,
        label="tilt towards",
        meaning="tilt of a sensitive axis towards each of the others",
        explanation="the six angles xy, xz, yx, yz, zx, zy; ij is the tilt of sensitive axis i towards axis j of the "
        "sensor block",
        stage="TILTED",
        untold="misalignments",
        calibrated=True,
        source="misalignment",
        limits={"ge": -_MOST_TILT, "le": _MOST_TILT},
        sigma_limits={"ge": 0.0, "le": _MOST_TILT / 4.0},
    ),
    *_both(
        "asymmetry", 3, _RATIO, _RATIO,
        si_unit="1",
        multiplies=lambda sensed, along, force, warmth, time: 0.5 * abs(sensed),
        label="asymmetry",
        meaning="scale factor of positive inputs minus that of negative ones",
        explanation="relative scale factor for positive inputs minus that for negative inputs",
        stage="BENT",
        untold="asymmetry",
        calibrated=True,
        source="non-linearity",
    ),
    *_both(
        "quadratic", 3, _per(_RATIO, {"deg_s": DEG, "rad_s": 1.0}), _per(_ACCELERATION, {"g2": G0**2}),
        si_unit="1/({rate})",
        multiplies=lambda sensed, along, force, warmth, time: sensed * sensed,
        meaning="error that grows with the square of the input",
        stage="BENT",
        untold="quadratic terms",
        calibrated=True,
        source="non-linearity",
        gyro={
            "label": "scale factor, with the rate",
            "explanation": "non-linearity of the scale factor: its change with the rate and with the square of the "
            "rate; zero in all grades",
        },
        accel={
            "label": "K₂",
            "explanation": "non-linearity K₂ and K₃ of IEEE Std 1293: the output error per square and per cube of the "
            "specific force; zero in all grades",
        },
    ),
    *_both(
        "cubic", 3, _per(_RATIO, {"deg2_s2": DEG**2, "rad2_s2": 1.0}), _per(_ACCELERATION, {"g3": G0**3}),
        si_unit="1/({rate})²",
        multiplies=lambda sensed, along, force, warmth, time: sensed * sensed * sensed,
        meaning="error that grows with the cube of the input",
        stage="BENT",
        untold="cubic terms",
        calibrated=True,
        source="non-linearity",
        gyro={
            "label": "scale factor, with its square",
            "explanation": "non-linearity of the scale factor: its change with the rate and with the square of the "
            "rate; zero in all grades",
        },
        accel={
            "label": "K₃",
            "explanation": "non-linearity K₂ and K₃ of IEEE Std 1293: the output error per square and per cube of the "
            "specific force; zero in all grades",
        },
    ),
    ErrorTerm(
        "accel_cross_axis", "accel", "cross_axis", 6, _per(_ACCELERATION, {"g2": G0**2}),
        si_unit="1/({rate})",
        multiplies=lambda sensed, along, force, warmth, time: sensed * along,
        label="coupling with",
        meaning="error that grows with the product of the inputs along and across the sensitive axis",
        explanation="the six couplings xy, xz, yx, yz, zx, zy; ij is the error of accelerometer i per product of the "
        "specific forces along its own axis and along axis j of the sensor block (vibro-pendulous error, K_ip and "
        "K_io of IEEE Std 1293)",
        stage="BENT",
        untold="cross-axis coupling",
        calibrated=True,
        source="non-linearity",
    ),
    ErrorTerm(
        "gyro_g_sensitivity", "gyro", "g_sensitivity", 9, _per(_RATE, _PER_G),
        si_unit="rad/s/(m/s²)",
        multiplies=lambda sensed, along, force, warmth, time: force,
        label="g-sensitivity to",
        meaning="apparent rate due to an acceleration",
        explanation="the nine biases per specific force xx, xy, xz, yx, …, zz; ij is the bias of gyro i per specific "
        "force along axis j of the sensor block",
        stage="G_SENSITIVE",
        untold="sensitivity to g",
        calibrated=True,
        source="g-sensitivity",
    ),
    *_both(
        "bias_temperature", 3, _per(_RATE, _PER_DEGREE), _per(_ACCELERATION, _PER_DEGREE),
        si_unit="{rate}/K",
        multiplies=lambda sensed, along, force, warmth, time: warmth,
        label="bias, with temperature",
        meaning="change of the bias per degree of warming",
        explanation="biases per degree Celsius above the temperature of the calibration",
        stage="WARMING",
        calibrated=True,
        source="temperature",
    ),
    *_both(
        "scale_temperature", 3, _per(_RATIO, _PER_DEGREE), _per(_RATIO, _PER_DEGREE),
        si_unit="1/K",
        multiplies=lambda sensed, along, force, warmth, time: warmth * sensed,
        label="scale factor, with temperature",
        meaning="change of the scale-factor error per degree of warming",
        explanation="scale-factor errors per degree Celsius",
        stage="WARMING",
        untold="scale factors' dependence on temperature",
        calibrated=True,
        source="temperature",
    ),
    *_both(
        "ramp", 3, _per(_RATE, _PER_HOUR), _per(_ACCELERATION, _PER_HOUR),
        si_unit="{rate}/s",
        multiplies=lambda sensed, along, force, warmth, time: time,
        label="growth of the bias",
        meaning="steady growth of the bias",
        explanation="growth of the biases from the start (rate ramp R)",
        stage="RAMPING",
        source="ramp",
    ),
    *_both(
        "random_walk", 1, _ANGLE_WALK, _VELOCITY_WALK,
        si_unit="{integral}/√s",
        explanation="angle and velocity random walk N",
        stage="WHITE",
        source="random walk",
        gyro={
            "name": "gyro_arw",
            "label": "angle random walk",
            "meaning": "white noise: random walk of the angle, growing with √t",
        },
        accel={
            "name": "accel_vrw",
            "label": "velocity random walk",
            "meaning": "white noise: random walk of the velocity, growing with √t",
        },
    ),
    *_both(
        "quantum", 1, _ANGLE, {"mm_s": 1e-3, "mps": 1.0},
        si_unit="{integral}",
        label="pulse weight",
        meaning="weight of one pulse of the accumulated output",
        explanation="weight of one pulse of the accumulated angle or velocity",
        stage="QUANTISED",
        source="quantisation",
        accel={
            "default": 0.0,
        },
    ),
    *_both(
        "instability", 1, _RATE, _ACCELERATION,
        si_unit="{rate}",
        label="bias instability, 1σ",
        meaning="slow variation of the bias within a run",
        explanation="1σ of the bias instability, first-order Gauss-Markov",
        stage="WANDERING",
        source="bias instability",
    ),
    *_both(
        "correlation_time", 1, {"s": 1.0, "h": 3600.0}, {"s": 1.0, "h": 3600.0},
        si_unit="s",
        meaning="correlation time of the variation of the bias",
        explanation="correlation time of the bias instability; default: 3600",
        label="",
        limits={"gt": 0.0},
        without=CORRELATION_TIME,
        slots=0,
    ),
    *_both(
        "flicker", 1, _RATE, _ACCELERATION,
        si_unit="{rate}",
        label="flicker B",
        meaning="bias instability B, floor of the Allan deviation over 0.664",
        explanation="coefficient B of the bias instability in IEEE Std 952, whose Allan deviation is 0.664 B at every "
        "averaging time; zero in all grades",
        stage="FLICKERING",
        source="flicker",
    ),
    *_both(
        "rate_walk", 1,
        {"deg_h_sqrt_h": DEG_H / 60.0, "rad_s_sqrt_s": 1.0}, {"ug_sqrt_h": UG / 60.0, "mps2_sqrt_s": 1.0},
        si_unit="{rate}/√s",
        label="rate random walk",
        meaning="random walk of the bias itself, growing with √t",
        explanation="rate random walk K; zero in all grades",
        stage="RATE_WALKING",
        source="rate random walk",
        gyro={
            "name": "gyro_rrw",
        },
        accel={
            "name": "accel_rrw",
        },
    ),
    *_both(
        "limit", 1, {"deg_s": DEG, "rad_s": 1.0}, {"g": G0, "mps2": 1.0},
        si_unit="{rate}",
        label="range ±",
        meaning="largest input that the sensor can measure",
        explanation="range in both directions; values beyond it are limited and flagged; default: no limit",
        stage="LIMITED",
        untold="range",
        limits={"gt": 0.0},
        gyro={
            "name": "gyro_range",
        },
        accel={
            "name": "accel_range",
        },
    ),
)  # fmt: skip

TERMS = tuple(sorted(_ROWS, key=lambda term: ("gyro", "accel").index(term.triad)))
"""All error terms of a sensor block that a scenario can give, those of the gyros first."""

FIELDS: dict[str, ErrorTerm] = {row.field: row for row in reversed(_ROWS)}
FIELDS = {row.field: FIELDS[row.field] for row in _ROWS}
"""A row for each field of `TriadErrors`."""

STAGES = {stage: 1 << bit for bit, stage in enumerate(dict.fromkeys(term.stage for term in TERMS if term.stage))}
"""Bits of the kernel's stages by name."""


def _numbered() -> dict[str, tuple[int, ...]]:
    """Number the parameters of the kernel."""
    slots, used = {}, 0
    for name, term in FIELDS.items():
        count = {1: 1, 3: 1, 6: 2, 9: 3}[term.size] if term.slots is None else term.slots
        slots[name] = tuple(range(used, used + count))
        used += count
    return slots


SLOTS = _numbered()
"""Parameters of the kernel by field: one for each axis; for six values those of the two axes after the channel's own,
in the order x, y, z, x, …; for nine one for each axis of the block."""

OF_TURNS = tuple(name for name, term in FIELDS.items() if term.multiplies and term.acts_on != "output")
"""Fields of `TriadErrors` that act on what the sensors sense, which for gyros on a platform is nothing."""

CALIBRATED = tuple(name for name in SLOTS if FIELDS[name].calibrated)
"""Fields of `TriadErrors` that a calibration determines."""


def of_triad(triad: str) -> tuple[ErrorTerm, ...]:
    """Return the terms of one triad. `triad`: "gyro" or "accel"."""
    return tuple(term for term in TERMS if term.triad == triad)
