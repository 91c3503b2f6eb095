"""The section of a run's report about a platform: its errors beside those of the same sensors strapped down."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sinssim import units
from sinssim.algorithms import PLATFORM
from sinssim.data import Array
from sinssim.formatting import number_text, signed
from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line
from sinssim.scales import ANGLES, LENGTHS, Scale, suiting
from sinssim.sensors.sets.platform import torquer_sigma
from sinssim.sensors.sets.sensor_set import Platform
from sinssim.strapdown.platform.error_equations import ACCELEROMETERS, GYROS, START, TORQUERS

if TYPE_CHECKING:
    from sinssim.experiments.run.parts.platform import OnPlatform
    from sinssim.sensors.imu.imu import Imu
    from sinssim.sensors.sets.platform import PlatformErrors
    from sinssim.strapdown.nav_error import NavError

_LEAST = 1e-6
"""Largest error of a cause that is left out, m: rounding."""
_COLORS = {GYROS: "gyro bias", TORQUERS: "heading", ACCELEROMETERS: "accelerometer bias", START: "position"}
"""Colours of the causes, names in the style."""
_NOT_LINEAR = 0.2
"""Share of the largest error by which the linear equations may differ from the simulation."""
_AXES = {
    "level": ("north", "east", "down"),
    "inertial": ("north at the start", "east at the start", "down at the start"),
}
_STANDS = {
    "level": "It is level and points north",
    "wander": "It is level and does not rotate about the vertical relative to the Earth (wander azimuth)",
    "free-azimuth": "It is level and does not rotate about the vertical in inertial space (free azimuth)",
    "transverse": "It is level and points along the great circle of the route",
    "inertial": "It keeps the direction of north, east and down at the start in inertial space and is not torqued",
}


def platform_section(part: OnPlatform) -> Iterator[str]:
    """Yield the report's section on a platform.

    Args:
        part: the platform of a run that has navigated.

    Yields:
        HTML.
    """
    frame, time = part.run.scenario.navigation.frame, part.run.time
    yield (
        f"<p>Three gyros and three accelerometers on a gimballed platform. {_STANDS[frame]}. The gyros stabilise the "
        f"platform and do not sense the rotation of the vehicle: their bias, random walk and g-sensitivity act about "
        f"the axes of the platform, and their scale-factor error, misalignment and non-linearity have no effect. "
        + ("The scale-factor error of their torquers acts on the commanded rates. " if frame != "inertial" else "")
        + "Roll, pitch and heading are gimbal angles. For comparison, the same sensors with the same errors are used "
        "in "
        "a strapdown system.</p>"
    )
    span = (float(time[0]), float(time[-1]))
    yield from _side_by_side(part, span)
    yield from _rates(part, span)
    yield from _by_cause(part, span)


def _side_by_side(part: OnPlatform, span: tuple[float, float]) -> Iterator[str]:
    """Yield table and plots of the errors on the platform and strapped down."""
    found: dict[str, NavError] = {"platform": part.errors}
    beside = part.strapdown
    paint = [style.COLORS[PLATFORM]]
    if beside is not None:
        found[f"strapdown ({beside[0]})"] = beside[1]
        paint += style.colors([beside[0]])
    if part.without_errors_of_turns is not None:
        found["strapdown, no rate-dependent errors"] = part.without_errors_of_turns
        paint.append(style.COLORS["reference"])
    names = {
        "platform": "platform",
        "strapdown, no rate-dependent errors": (
            "strapdown, gyros without scale-factor error, misalignment and non-linearity"
        ),
    }
    rows = [
        (
            words(names.get(name, name)),
            *(number_text(float(value), 4) for value in (error.horizontal[-1], error.horizontal.max())),
            *(number_text(float(value) / units.ARCMIN, 4) for value in (error.angle[-1], error.angle.max())),
        )
        for name, error in found.items()
    ]
    heads = ("", "horizontal error, end [m]", "largest [m]", "attitude error, end [arcmin]", "largest [arcmin]")
    yield table(heads, rows)

    def drawn(title: str, scale: Scale, values: Sequence[Array]) -> str:
        unit, size = suiting(scale, *values)
        lines = [
            Line(name, error.time, rows, style.css(color), width, dash, size)
            for (name, error), rows, color, width, dash in zip(
                found.items(), values, paint, (2.0, 1.6, 1.6), ("", "", "6 4"), strict=False
            )
        ]
        return f"<div>{plot.plot(title, unit, lines, span)}</div>"

    horizontal = drawn("Horizontal error", LENGTHS, [error.horizontal for error in found.values()])
    attitude = drawn("Attitude error", ANGLES, [error.angle for error in found.values()])
    yield f'<div class="pair">{horizontal}{attitude}</div>'


def _rates(part: OnPlatform, span: tuple[float, float]) -> Iterator[str]:
    """Yield plots of what the gyros sense strapped down, and of what the platform is commanded."""
    edges, solution = part.run.time, part.solution
    time = edges[1:]
    sensed = part.true_increments.dtheta / np.diff(edges)[:, np.newaxis] / units.DEG
    paint = [style.css(color) for color in style.colors(["x", "y", "z"])]
    body = [
        Line(name, time, sensed[:, i], paint[i], 1.4) for i, name in enumerate(("x, forward", "y, right", "z, down"))
    ]
    frame = part.run.scenario.navigation.frame
    axes = _AXES.get(frame, ("x", "y", "z, down"))
    torqued = [Line(name, time, solution.commanded[:, i] / units.DEG_H, paint[i], 1.4) for i, name in enumerate(axes)]
    left = plot.plot("Strapdown: true rate of the IMU", "deg/s", body, span)
    right = plot.plot("Platform: commanded rate", "deg/h", torqued, span)
    yield f'<div class="pair"><div>{left}</div><div>{right}</div></div>'
    yield (
        '<p class="note">The scale factor of a gyro multiplies the rate on the left, deg/s, that of a torquer the rate '
        "on the right, deg/h. Turns to one side add up; turns in alternating directions cancel.</p>"
    )


def _by_cause(part: OnPlatform, span: tuple[float, float]) -> Iterator[str]:
    """Yield what each error of the platform contributes, by the linear error equations, beside the simulation."""
    found, simulated = part.errors_by_cause, part.errors
    sizes = {name: np.linalg.norm(rows, axis=1) for name, rows in found.position.items()}
    sizes = {name: size for name, size in sizes.items() if size.max() > _LEAST}
    total = np.linalg.norm(found.total, axis=1)
    apart = found.apart(simulated)
    if apart > _NOT_LINEAR * float(simulated.horizontal.max()):
        yield "<p>The errors are too large for the linear error equations, which give the contribution of each.</p>"
        return
    rows = [(words(name), number_text(float(s[-1]), 4), number_text(float(s.max()), 4)) for name, s in sizes.items()]
    rows.append(("all together, as vectors", number_text(float(total[-1]), 4), number_text(float(total.max()), 4)))
    horizontal = simulated.horizontal
    most = number_text(float(horizontal.max()), 4)
    rows.append(("the simulated platform", number_text(float(horizontal[-1]), 4), most))
    unit, size = suiting(LENGTHS, total, horizontal)
    paint = [style.css(style.COLORS[_COLORS[name]]) for name in sizes]
    grey = style.css(style.COLORS["reference"])
    lines = [
        Line("all causes together", found.time, total, grey, 4.5, "", size),
        Line("simulated platform", simulated.time, horizontal, style.css(style.COLORS[PLATFORM]), 1.6, "", size),
        *(
            Line(name, found.time, rows, color, 1.4, "", size)
            for (name, rows), color in zip(sizes.items(), paint, strict=True)
        ),
    ]
    drawn = plot.plot("Horizontal error by cause", unit, lines, span)
    listed = table(("cause", "horizontal error, end [m]", "most [m]"), rows)
    yield f'<h3>What each error contributes</h3><div class="pair"><div>{listed}</div><div>{drawn}</div></div>'
    yield (
        '<p class="note">Each cause separately, by the linear error equations of the platform; the simulation is that '
        f"of the complete loop. The two differ by {number_text(apart, 3)} m at most.</p>"
    )


def platform_errors(section: Imu, errors: PlatformErrors, frame: str) -> str:
    """Return a table of the errors of a platform's torquers and pick-offs.

    Args:
        section: the [imu] section, whose sensor set is a platform.
        errors: the errors of the run.
        frame: the navigation frame.

    Returns:
        HTML.
    """
    own = section.sensor_set
    assert isinstance(own, Platform)

    def spread(given: object, sigma: float) -> str:
        if given is not None:
            return f"given ± {sigma:.6g}" if sigma else "given"
        return f"{sigma:.6g}"

    rows = []
    if frame != "inertial":
        ppm = (signed(float(v), 4) for v in errors.torquer_scale / units.PPM)
        rows.append(
            ("torquing scale factor x, y, z", "ppm", *ppm, spread(own.torquer_scale_ppm, torquer_sigma(section) * 1e6))
        )
    arcsec = (signed(float(v), 4) for v in errors.pickoff / units.ARCSEC)
    sigma = spread(own.pickoff_arcsec, own.pickoff_sigma_arcsec or 0.0)
    rows.append(("gimbal angle roll, pitch, azimuth", "arcsec", *arcsec, sigma))
    noise = f"Noise of each gimbal angle {own.pickoff_noise_arcsec:g} arcsec. " if own.pickoff_noise_arcsec else ""
    return table(("", "unit", "1", "2", "3", "1σ"), rows, 2) + (
        f'<p class="note">{noise}The axes of gyros and accelerometers above are those of the platform, and of the '
        "sensor block for the strapdown system.</p>"
    )
