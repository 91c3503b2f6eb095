"""The scheme of a run's navigation: the blocks of the scenario, and its axes with the run's own angles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sinssim.data import Array, NavSolution, NavState
from sinssim.exhibits import Item, Picture, Sentence
from sinssim.recording import style
from sinssim.recording.diagrams import ATTITUDE, POSITION, SENSOR, VELOCITY
from sinssim.recording.svg import Drawing, Point
from sinssim.rotation import dcm_from_quaternion, euler_from_quaternion, shown_heading
from sinssim.sensors.aiding.air_data import Barometer
from sinssim.sensors.sensor_set_section import AttitudeSensor, Redundant, SixAccelerometers
from sinssim.strapdown.attitude import MEASURED_ATTITUDE, PLATFORM
from sinssim.strapdown.frames import FRAME_REGISTRY, FRAMES
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.scenario import Scenario


AIDED = style.css(style.COLORS["accelerometer bias"])
"""Colour of the filter."""

_LETTERS = 21  # of a line in the block of attitude


class Symbols(NamedTuple):
    """Symbols of a frame: matrix, its rate, what is added to the specific force, what is computed from the position."""

    matrix: str
    rate: str
    added: str
    earth: tuple[str, ...]


_NORTH = Symbols(
    "C{nb}", "ω{ie} + ω{en}", "g − (2ω{ie} + ω{en}) × v", ("gravity g, Earth rate ω{ie},", "transport rate ω{en}")
)
_AZIMUTH = Symbols(
    "C{wb}", "ω{ie} + ω{ew}", "g − (2ω{ie} + ω{ew}) × v", ("gravity g, Earth rate ω{ie},", "transport rate ω{ew}")
)
_INERTIAL = Symbols("C{ib}", "", "gravitation G(r)", ("gravitation G(r),", "Earth's rotation"))


def symbols(frame: str) -> Symbols:
    """Return the symbols of one of `sinssim.FRAMES`: those of the inertial frame, of a frame with an azimuth of its
    own, or of the north-pointing one."""
    if frame == "inertial":
        return _INERTIAL
    return _AZIMUTH if FRAME_REGISTRY[frame].has_azimuth else _NORTH


def scheme(scenario: Scenario) -> str:
    """Draw the scheme of a scenario's navigation."""
    navigation = scenario.navigation
    s = symbols(navigation.frame)
    beside = navigation.vertical != "free" or scenario.filter is not None
    d = Drawing(1010.0 if beside else 800.0, 300.0, "scheme of the navigation")
    _sensors(d, scenario)
    _attitude(d, scenario, s)
    _velocity_and_position(d, scenario, s)
    if navigation.vertical != "free":
        _height(d, scenario)
    if scenario.filter is not None:
        _filter(d, scenario)
    _rates(d, scenario)
    return d.svg()


_TOP, _LOW, _OUT = 62.0, 190.0, 272.0
_X = {"sensors": 80.0, "compensation": 222.0, "attitude": 380.0, "sum": 482.0, "integral": 550.0, "position": 690.0,
      "beside": 905.0}  # fmt: skip


def _sensors(d: Drawing, scenario: Scenario) -> None:
    """Sensors and the compensation of their errors, to the left of what they feed."""
    match scenario.imu.sensor_set:
        case SixAccelerometers():
            top, low = ["accelerometers:", "sums of pairs"], ["accelerometers:", "differences, ∫"]
        case AttitudeSensor():
            top, low = ["three", "accelerometers"], ["attitude sensor"]
        case Redundant() as chosen:
            count = len(chosen.axes)
            combined = ["least squares"] if chosen.mode == "none" else ["least squares,", "monitored"]
            top, low = [f"{count} accelerometers,", *combined], [f"{count} gyros,", *combined]
        case _:
            top, low = ["three", "accelerometers"], ["three gyros"]
    for y, lines in ((_TOP, top), (_LOW, low)):
        last = d.box(_X["sensors"], y, 136.0, lines, SENSOR)
        if scenario.compensation is not None:
            sensors, last = last, d.box(_X["compensation"], y, 110.0, ["compensation", "of errors"], SENSOR)
            d.line([sensors.right, last.left], SENSOR)
        d.line([last.right, (_X["attitude"] - 75.0, y)], SENSOR)
    d.text(_X["attitude"] - 92.0, _TOP - 13.0, "f", SENSOR)
    measured = MEASURED_ATTITUDE in scenario.navigation.algorithms
    d.text(_X["attitude"] - 92.0, _LOW - 13.0, "C{ib}" if measured else "ω", SENSOR)


def _attitude(d: Drawing, scenario: Scenario, s: Symbols) -> None:
    """The algorithms of attitude, the matrix and the angles."""
    names = [name for name in scenario.navigation.algorithms if name != PLATFORM]
    lines = [""]
    if names == [MEASURED_ATTITUDE]:
        lines = ["measured"]
    else:
        for name in names:
            line = f"{lines[-1]}, {name}" if lines[-1] else name
            lines = [*lines[:-1], line] if len(line) <= _LETTERS else [*lines, name]
        if len(lines) > 2:
            lines = [f"{len(names)} algorithms,", "each on its own"]
    x = _X["attitude"]
    force = d.box(x, _TOP, 150.0, [f"{s.matrix} f", "specific force resolved"], VELOCITY)
    attitude = d.box(x, _LOW, 150.0, [f"attitude {s.matrix}", *lines], ATTITUDE)
    d.line([attitude.top, force.bottom], ATTITUDE, s.matrix)
    d.line([attitude.bottom, d.box(x, _OUT, 150.0, ["roll, pitch, heading"], ATTITUDE).top], ATTITUDE)


def _velocity_and_position(d: Drawing, scenario: Scenario, s: Symbols) -> None:
    """Both integrals, and what the position gives back to them and to the attitude."""
    x, y = _X["position"], _TOP
    total, speed = d.circle(_X["sum"], y, 11.0, VELOCITY, "+"), d.box(_X["integral"], y, 40.0, ["∫"], VELOCITY)
    inertial = scenario.navigation.frame == "inertial"
    place = d.box(x, y, 130.0, ["∫, then geodetic" if inertial else "∫, position", "φ, λ, h"], POSITION)
    radii = [] if inertial else [f"radii R{{1}}, R{{2}}: {scenario.navigation.curvature}"]
    earth = d.box(x, _LOW, 180.0, [*s.earth, *radii], POSITION)
    edge = earth.top[1]
    d.line([(_X["attitude"] + 75.0, y), total.left], VELOCITY)
    d.line([total.right, speed.left], VELOCITY)
    d.line([speed.right, place.left], VELOCITY, "v")
    d.line([place.bottom, earth.top], POSITION)
    if not inertial:
        d.line([(x - 60.0 - 42.0, y), (x - 60.0 - 42.0, y + 40.0), (x - 60.0, y + 40.0), (x - 60.0, edge)], VELOCITY)
    between = 0.5 * (y + edge) + 18.0
    d.line([(x - 80.0, edge), (x - 80.0, between), (total.x, between), total.bottom], POSITION)
    d.text(total.x + 8.0, between - 13.0, s.added, POSITION, "start")
    if s.rate and scenario.navigation.algorithms != (MEASURED_ATTITUDE,):
        d.line([earth.left, (_X["attitude"] + 75.0, _LOW)], POSITION, s.rate)


def _height(d: Drawing, scenario: Scenario) -> None:
    """The reference of the vertical channel."""
    navigation, x = scenario.navigation, _X["beside"]
    if navigation.vertical == "truth":
        lines = ["true height", "and climb"]
    else:
        barometer = scenario.aiding is not None and scenario.aiding.sensor(Barometer) is not None
        lines = [
            f"baro loop, {navigation.baro_time_constant_s:g} s, on",
            "the barometer" if barometer else "the true height",
        ]
    d.line([d.box(x, _TOP, 150.0, lines, POSITION).left, (_X["position"] + 65.0, _TOP)], POSITION, "h, v{D}")


def _filter(d: Drawing, scenario: Scenario) -> None:
    """The filter with its aiding sensors."""
    x = _X["beside"]
    sensors = [] if scenario.aiding is None else list(scenario.aiding.sensors())
    shown = [", ".join(sensors)] if len(", ".join(sensors)) <= 26 else [f"{len(sensors)} aiding sensors"]
    aided = d.box(x, _LOW, 150.0, ["Kalman filter of the", "errors: aided solution"], AIDED)
    d.line([(_X["position"] + 90.0, _LOW), aided.left], AIDED)
    between, back = 0.5 * (_TOP + _LOW), _X["position"] + 40.0
    d.line([aided.top, (x, between), (back, between), (back, _TOP + 22.0)], AIDED)
    d.text(x - 10.0, between - 12.0, "corrections", AIDED, "end")
    if sensors:
        d.line([d.box(x, _OUT, 150.0, shown, SENSOR).top, aided.bottom], SENSOR)


def _rates(d: Drawing, scenario: Scenario) -> None:
    """Rates of the parts, above them."""
    rates = scenario.navigation.rates_hz
    rate = scenario.imu.rate_hz
    if rates is None:
        d.text(_X["sensors"] - 68.0, 14.0, f"sensors and navigation {rate:g} Hz", soft=True, anchor="start")
        return
    d.text(_X["sensors"], 14.0, f"sensors {rate:g} Hz", soft=True)
    fast, medium, slow = rates
    d.text(_X["attitude"] - 84.0, _OUT, f"attitude {fast:g} Hz", soft=True, anchor="end")
    d.text(_X["integral"] - 60.0, 14.0, f"velocity {medium:g} Hz", soft=True)
    d.text(_X["position"], 14.0, f"position and rates {slow:g} Hz", soft=True)


def scheme_words(scenario: Scenario) -> str:
    """Return the sentences below the scheme."""
    navigation = scenario.navigation
    text = f"Navigation frame “{navigation.frame}”: {FRAMES[navigation.frame]}."
    if PLATFORM in navigation.algorithms:
        text += (
            " The scheme is that of the strapdown system. On the platform, its gyros and the torquing by the computed "
            "rates replace the attitude algorithm."
        )
    elif len(navigation.algorithms) > 1:
        text += " Each attitude algorithm computes a separate solution from the same data."
    return text


LEVEL, BODY = POSITION, SENSOR
"""Colours of the axes of the local level, and of the body."""

_CENTRE, _RADIUS, _FLAT = (165.0, 168.0), 118.0, 0.9  # of the drawn Earth, px; its flattening is exaggerated
_ORIGIN, _UNIT = (560.0, 140.0), 104.0  # of the local level, px
_TURN, _UP = np.radians(-28.0), np.radians(24.0)  # from where it is seen
_NEAR = np.radians(12.0)
"""Angle below which an arc has no room, or two axes are drawn one over the other."""


def axes_exhibits(scenario: Scenario, truth: NavState, solutions: Mapping[str, NavSolution]) -> Iterator[Item]:
    """Yield a drawing of the axes at the start of a run, and its angles. `truth`: true states, N rows."""
    q = truth.q_nb[0]
    roll, pitch, heading = (float(angle) for angle in euler_from_quaternion(q))
    latitude = float(truth.latitude[0])
    d = Drawing(800.0, 330.0, "axes of the local level and of the body at the start")
    _earth(d, latitude)
    azimuth = _azimuth(scenario, solutions)
    _body(d, dcm_from_quaternion(q), heading, pitch, None if azimuth is None else azimuth[0])
    frame = scenario.navigation.frame
    (shown,) = shown_heading(scenario.output.angles, [heading])
    text = (
        f"The true start: latitude {latitude / DEG:.3f}°, longitude {float(truth.longitude[0]) / DEG:.3f}°, "
        f"heading {float(shown) / DEG:.2f}°, pitch {pitch / DEG:.2f}°, roll {roll / DEG:.2f}°. "
        "N, E, D: north, east, down; x, y, z: forward, right, down of the body."
    )
    if azimuth is not None:
        first, last = azimuth
        text += (
            f" The axis x_{{w}} of the frame “{frame}” points {first / DEG:.2f}° from north, clockwise, at the start "
            f"and {last / DEG:.2f}° at the end."
        )
    elif frame == "inertial":
        text += " The inertial axes are the Earth’s at the start: Z along its axis, X in the meridian of Greenwich."
    yield Picture(d.svg)
    yield Sentence(text.replace(" -", " −"), "note")


def _azimuth(scenario: Scenario, solutions: Mapping[str, NavSolution]) -> tuple[float, float] | None:
    """Azimuth of the frame's x axis at start and end by the first solution, rad; None without one."""
    if not FRAME_REGISTRY[scenario.navigation.frame].has_azimuth:
        return None
    for solution in solutions.values():
        if solution.azimuth is not None:
            return float(solution.azimuth[0]), float(solution.azimuth[-1])
    return None


def _earth(d: Drawing, latitude: float) -> None:
    """The meridian with the place, its vertical and the local level."""
    (x, y), a = _CENTRE, _RADIUS
    b = _FLAT * a
    d.arc(_CENTRE, a, 0.0, 2.0 * np.pi, flat=_FLAT)
    d.line([(x, y), (x, y - b - 32.0)])
    d.text(x - 12.0, y - b - 26.0, "Ω", soft=True, anchor="end")
    d.line([(x, y), (x + a, y)], head=False)
    d.text(x + 0.5 * a, y + (12.0 if latitude >= 0.0 else -12.0), "equator", soft=True)
    s, c = float(np.sin(latitude)), float(np.cos(latitude))
    normal = a / np.sqrt(1.0 - (1.0 - _FLAT**2) * s * s)
    here = (x + normal * c, y - normal * _FLAT**2 * s)
    foot = (here[0] - normal * _FLAT**2 * c, y)  # where the vertical meets the equator's plane
    d.line([foot, here], head=False, dashes="5 4")
    if abs(latitude) > _NEAR:
        d.arc(foot, 34.0, 0.0, latitude, ATTITUDE)
        half = 0.5 * latitude
        d.text(foot[0] + 46.0 * float(np.cos(half)), y - 46.0 * float(np.sin(half)), "φ", ATTITUDE)
    for name, (east, north), length in (("N", (-s, c), 62.0), ("D", (-c, -s), 48.0)):
        end = (here[0] + length * east, here[1] - length * north)
        d.line([here, end], LEVEL, width=1.8)
        away = (length + 11.0, 0.0) if name == "N" else (length - 12.0, 12.0)  # beside the dashed vertical
        d.text(
            here[0] + away[0] * east + away[1] * north, here[1] - away[0] * north + away[1] * east, name, LEVEL
        )  # fmt: skip
    d.circle(*here, 6.5, LEVEL, "×")
    d.text(here[0] + 17.0 * c + 2.0, here[1] - 17.0 * s, "E", LEVEL)


def seen(vector: Array) -> Point:
    """Return where a vector in north, east, down ends on the drawing: px. `vector`: (3,), in units of the drawing."""
    north, east, down = (float(v) for v in vector)
    across = north * np.sin(-_TURN) + east * np.cos(_TURN)
    depth = north * np.cos(_TURN) + east * np.sin(_TURN)
    return (
        _ORIGIN[0] + _UNIT * float(across),
        _ORIGIN[1] - _UNIT * float(depth * np.sin(_UP) - down * np.cos(_UP)),
    )


def _beside(axes: list[Array], heading: float) -> Point:
    """Return a place along the arc of the heading that is as far as possible from all axes, px."""

    def room(place: Point) -> float:
        p, gaps = np.array(place) - np.array(_ORIGIN), []
        for tip in axes:
            a = np.array(seen(tip)) - np.array(_ORIGIN)
            share = float(np.clip(p @ a / max(float(a @ a), 1e-9), 0.0, 1.0))
            gaps.append(float(np.hypot(*(p - share * a))))
        return min(gaps)

    turns = heading * np.linspace(0.2, 0.8, 13)
    return max((seen(0.64 * np.array([np.cos(t), np.sin(t), 0.0])) for t in turns), key=room)


def _body(d: Drawing, c_nb: Array, heading: float, pitch: float, azimuth: float | None) -> None:
    """North, east and down in perspective with the body's axes and their angles."""
    level = [(name, 1.35 * np.eye(3)[i], LEVEL) for i, name in enumerate("NED")]
    body = [(name, 1.05 * c_nb[:, i], BODY) for i, name in enumerate("xyz")]
    flat = np.array([np.cos(heading), np.sin(heading), 0.0])
    d.line([seen(np.zeros(3)), seen(1.05 * flat)], head=False, dashes="5 4")
    if azimuth is not None and abs(azimuth) > _NEAR:
        level.append(("x{w}", 1.35 * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]), AIDED))
    for _, tip, color in level + body:
        d.line([seen(np.zeros(3)), seen(tip)], color, width=1.8)
    if min(heading, 2.0 * np.pi - heading) > _NEAR:
        turn = np.linspace(0.0, heading, 60)
        d.line([seen(0.5 * np.array([np.cos(t), np.sin(t), 0.0])) for t in turn], ATTITUDE)
        d.text(*_beside([tip for _, tip, _ in level + body], heading), "ψ", ATTITUDE)
    if abs(pitch) > _NEAR:
        turn = np.linspace(0.0, pitch, 20)
        d.line([seen(0.85 * (np.cos(t) * flat - np.sin(t) * np.eye(3)[2])) for t in turn], ATTITUDE)
        d.text(*seen(0.98 * (np.cos(0.5 * pitch) * flat - np.sin(0.5 * pitch) * np.eye(3)[2])), "θ", ATTITUDE)
    drawn: list[Array] = []
    for name, tip, color in level + body:
        along = np.array(seen(tip)) - np.array(_ORIGIN)
        length = max(float(np.hypot(*along)), 1e-9)
        along /= length
        beside = any(float(along @ other) > np.cos(_NEAR) for other in drawn)
        drawn.append(along)
        place = np.array(seen(tip)) + (13.0 * np.array([along[1], -along[0]]) if beside else 12.0 * along)
        d.text(float(place[0]), float(place[1]), name, color)
    d.text(_ORIGIN[0], 315.0, "the body at the start", soft=True)
    d.text(_CENTRE[0], 315.0, "the place at the start, E into the page", soft=True)
