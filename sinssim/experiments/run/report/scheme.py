"""The scheme of a run's navigation in its report: the blocks of the scenario, with its names and rates."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from sinssim.algorithms import MEASURED_ATTITUDE, PLATFORM
from sinssim.frames import FRAME_REGISTRY, FRAMES
from sinssim.recording import style
from sinssim.recording.report.drawing import Drawing
from sinssim.recording.report.page import words
from sinssim.sensors.aiding.baro import Barometer
from sinssim.sensors.sets.sensor_set import AttitudeSensor, Redundant, SixAccelerometers

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

SENSOR, ATTITUDE, VELOCITY, POSITION, AIDED = (
    style.css(style.COLORS[name]) for name in ("measured", "attitude", "gyro bias", "position", "accelerometer bias")
)
"""Colours: what is measured, attitude, velocity, position, filter."""

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
    """Return the symbols of a navigation frame.

    Args:
        frame: one of `sinssim.FRAMES`.

    Returns:
        The symbols: those of the inertial frame, of a frame with an azimuth of its own, or of the north-pointing one.
    """
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
        d.box(_X["sensors"], y, 136.0, lines, SENSOR)
        start = _X["sensors"] + 68.0
        if scenario.compensation is None:
            d.line([(start, y), (_X["attitude"] - 75.0, y)], SENSOR)
        else:
            d.line([(start, y), (_X["compensation"] - 55.0, y)], SENSOR)
            d.box(_X["compensation"], y, 110.0, ["compensation", "of errors"], SENSOR)
            d.line([(_X["compensation"] + 55.0, y), (_X["attitude"] - 75.0, y)], SENSOR)
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
    d.box(x, _TOP, 150.0, [f"{s.matrix} f", "specific force resolved"], VELOCITY)
    d.box(x, _LOW, 150.0, [f"attitude {s.matrix}", *lines], ATTITUDE)
    height = 7.0 + 7.5 * (1 + len(lines))
    d.line([(x, _LOW - height), (x, _TOP + 22.0)], ATTITUDE)
    d.text(x - 8.0, 0.5 * (_TOP + _LOW), s.matrix, ATTITUDE, "end")
    d.line([(x, _LOW + height), (x, _OUT - 15.0)], ATTITUDE)
    d.box(x, _OUT, 150.0, ["roll, pitch, heading"], ATTITUDE)


def _velocity_and_position(d: Drawing, scenario: Scenario, s: Symbols) -> None:
    """Both integrals, and what the position gives back to them and to the attitude."""
    x, y = _X["position"], _TOP
    d.line([(_X["attitude"] + 75.0, y), (_X["sum"] - 11.0, y)], VELOCITY)
    d.circle(_X["sum"], y, 11.0, VELOCITY, "+")
    d.line([(_X["sum"] + 11.0, y), (_X["integral"] - 20.0, y)], VELOCITY)
    d.box(_X["integral"], y, 40.0, ["∫"], VELOCITY)
    d.line([(_X["integral"] + 20.0, y), (x - 65.0, y)], VELOCITY)
    d.text(x - 93.0, y - 13.0, "v", VELOCITY)
    inertial = scenario.navigation.frame == "inertial"
    d.box(x, y, 130.0, ["∫, then geodetic", "φ, λ, h"] if inertial else ["∫, position", "φ, λ, h"], POSITION)
    radii = [] if inertial else [f"radii R{{1}}, R{{2}}: {scenario.navigation.curvature}"]
    d.box(x, _LOW, 180.0, [*s.earth, *radii], POSITION)
    edge = _LOW - (7.0 + 7.5 * (len(s.earth) + len(radii)))
    d.line([(x, y + 22.0), (x, edge)], POSITION)
    if not inertial:
        d.line([(x - 60.0 - 42.0, y), (x - 60.0 - 42.0, y + 40.0), (x - 60.0, y + 40.0), (x - 60.0, edge)], VELOCITY)
    d.line(
        [
            (x - 80.0, edge),
            (x - 80.0, 0.5 * (y + edge) + 18.0),
            (_X["sum"], 0.5 * (y + edge) + 18.0),
            (_X["sum"], y + 11.0),
        ],
        POSITION,
    )
    d.text(_X["sum"] + 8.0, 0.5 * (y + edge) + 5.0, s.added, POSITION, "start")
    if s.rate and scenario.navigation.algorithms != (MEASURED_ATTITUDE,):
        d.line([(x - 90.0, _LOW), (_X["attitude"] + 75.0, _LOW)], POSITION)
        d.text(0.5 * (x - 15.0 + _X["attitude"]), _LOW - 13.0, s.rate, POSITION)


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
    d.box(x, _TOP, 150.0, lines, POSITION)
    d.line([(x - 75.0, _TOP), (_X["position"] + 65.0, _TOP)], POSITION)
    d.text(0.5 * (x - 75.0 + _X["position"] + 65.0), _TOP - 13.0, "h, v{D}", POSITION)


def _filter(d: Drawing, scenario: Scenario) -> None:
    """The filter with its aiding sensors."""
    x = _X["beside"]
    sensors = [] if scenario.aiding is None else list(scenario.aiding.sensors())
    shown = [", ".join(sensors)] if len(", ".join(sensors)) <= 26 else [f"{len(sensors)} aiding sensors"]
    d.box(x, _LOW, 150.0, ["Kalman filter of the", "errors: aided solution"], AIDED)
    d.line([(_X["position"] + 90.0, _LOW), (x - 75.0, _LOW)], AIDED)
    d.line(
        [
            (x, _LOW - 22.0),
            (x, 0.5 * (_TOP + _LOW)),
            (_X["position"] + 40.0, 0.5 * (_TOP + _LOW)),
            (_X["position"] + 40.0, _TOP + 22.0),
        ],
        AIDED,
    )
    d.text(x - 10.0, 0.5 * (_TOP + _LOW) - 12.0, "corrections", AIDED, "end")
    if sensors:
        d.box(x, _OUT, 150.0, shown, SENSOR)
        d.line([(x, _OUT - 15.0), (x, _LOW + 22.0)], SENSOR)


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
    """Return the sentences below the scheme, HTML."""
    navigation = scenario.navigation
    text = f"Navigation frame “{navigation.frame}”: {FRAMES[navigation.frame]}."
    if PLATFORM in navigation.algorithms:
        text += (
            " The scheme is that of the strapdown system. On the platform, its gyros and the torquing by the computed "
            "rates replace the attitude algorithm."
        )
    elif len(navigation.algorithms) > 1:
        text += " Each attitude algorithm computes a separate solution from the same data."
    return f"<p class=note>{words(text)}</p>"
