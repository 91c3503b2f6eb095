"""Error propagation of an unaided navigator in closed form: the Schuler loop, and the effect of each error term.

For a level vehicle at rest at latitude φ, with the mean radius R of the Earth, the Schuler frequency ω = √(g/R) and the
Earth's rate U, the horizontal position error after the time t is, for

    an error of the velocity v     v · sin ωt / ω                      (1)
    a tilt ε                       ε · R (1 − cos ωt)                  (2)
    an azimuth error ζ             ζ · R U cos φ (t − sin ωt / ω)      (3)

(Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, ch. 12; Britting, Inertial Navigation
Systems Analysis, 1971). A constant error of an accelerometer changes the velocity steadily, that of a level gyro the
tilt, and that of the down gyro the azimuth. The response is therefore the integral of (1), (2) or (3), and the response
to a ramp is the integral of that. White noise of density N causes a standard deviation of N times the root of the
integral of the square.

Two effects are neglected. The plane of the Schuler oscillation turns slowly (Foucault's pendulum), which changes the
direction of the error but not its size. An error of attitude stays fixed in inertial space while the Earth rotates by
Ut. After an hour this amounts to up to (Ut)²/2 = 3.4 % for an east tilt, and to 1 % otherwise.

A level vehicle heading north navigates unaided from an exact initial state. Errors that act only in motion are
evaluated for one manoeuvre: at the start the vehicle turns by 90° at 3°/s, or accelerates to 250 m/s northwards at g/4.
All standard deviations are those of the horizontal error, the root of the sum of squares of north and east. A given
error of the scenario counts as a standard deviation of its magnitude, beside that of the random error about it.

Symbols: b, k, M … are the standard deviations, S and h the step and impulse responses of `Schuler`, Δψ and V the turn
and the speed, and t′ the time since the middle of the manoeuvre.

    gyro bias                       b S (tilt for north and east, azimuth for down)
    gyro scale factor               at rest k_i ω_i as a bias, ω = (U cos φ, 0, −U sin φ); in the turn k_z Δψ h(t′)
    gyro misalignment               at rest M_ij ω_j as a bias; in the turn the tilt M_xz sin Δψ − M_yz (1 − cos Δψ) to
                                    the north, M_xz (1 − cos Δψ) + M_yz sin Δψ to the east, times h(t′)
    asymmetry κ, quadratic, cubic   in the turn ½κ, K₂ψ̇, K₃ψ̇² like k_z
    g-sensitivity                   G_iz g as a bias
    angle random walk N, rate random walk, bias instability, flicker
                                    the root of ∫∫ h(t−u) h(t−v) C(u, v) du dv with their covariance C
    accelerometer bias              b S; misalignment M_xz g and M_yz g likewise
    accelerometer scale factor      in the acceleration k_x V h(t′); κ, K₂ and K₃ as ½κ, K₂a, K₃a²
    misalignment, cross axis        in the acceleration M_yx V h(t′), C_xz g V h(t′)
    velocity random walk            N times the root of ∫h²
    quantum Q, sampled every T      an independent error of variance Q²/12 in every sample: of the tilt, which moves the
                                    velocity like a random walk g Q √(T/12); of the velocity, Q √(T/12) √(∫cos² ωu du)
    temperature                     as a bias and a scale factor that follow the warm-up, in a manoeuvre with its mean;
                                    null shift likewise
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sinssim import earth
from sinssim.data import Array
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError
from sinssim.exhibits import Column, Item, Sentence, Table
from sinssim.sensors import flicker
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.grades import find_grade, grade_name
from sinssim.sensors.imu.imu_section import Imu
from sinssim.units import DEG, DEG_H, G0, NAUTICAL_MILE

Response = Literal["velocity", "tilt", "azimuth"]

_POINTS = 96
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_POINTS)


@dataclass(frozen=True)
class Schuler:
    """A vehicle at rest on the ellipsoid."""

    radius: float  # R, geometric mean of the two radii of curvature, m
    gravity: float  # g, m/s²
    north_rate: float  # U cos φ, rad/s
    down_rate: float  # −U sin φ, rad/s

    @classmethod
    def at(cls, latitude: float) -> Schuler:
        """Return the vehicle at a latitude, rad."""
        r1, r2 = earth.radii(latitude)
        gravity = float(earth.surface_gravity(latitude))
        return cls(
            math.sqrt(float(r1) * float(r2)),
            gravity,
            OMEGA_IE * math.cos(latitude),
            -OMEGA_IE * math.sin(latitude),
        )

    @property
    def frequency(self) -> float:
        """ω, rad/s."""
        return math.sqrt(self.gravity / self.radius)

    def impulse(self, kind: Response, t: Array) -> Array:
        """Return the position error at times after a unit step of velocity, tilt or azimuth, (1) to (3), (...) m per
        m/s or per rad."""
        w = self.frequency
        if kind == "velocity":
            return np.asarray(np.sin(w * t) / w)  # (1)
        if kind == "tilt":
            return np.asarray(self.radius * 2.0 * np.sin(0.5 * w * t) ** 2)  # (2)
        return np.asarray(self.radius * self.north_rate * (t - np.sin(w * t) / w))  # (3)

    def step(self, kind: Response, t: Array) -> Array:
        """Return the position error at times if velocity, tilt or azimuth changes at a unit rate, the integral of
        `impulse`, (...) m per m/s² or per rad/s."""
        w = self.frequency
        turned = 2.0 * np.sin(0.5 * w * t) ** 2 / w**2
        if kind == "velocity":
            return np.asarray(turned)
        if kind == "tilt":
            return np.asarray(self.radius * (t - np.sin(w * t) / w))
        return np.asarray(self.radius * self.north_rate * (0.5 * t**2 - turned))

    def ramp(self, kind: Response, t: float) -> float:
        """Return the position error at a time if the rate of change itself grows at a unit rate, the integral of
        `step`, m per m/s³ or per rad/s²."""
        w = self.frequency
        late = (t - math.sin(w * t) / w) / w**2
        if kind == "velocity":
            return late
        if kind == "tilt":
            return self.radius * (0.5 * t**2 - 2.0 * math.sin(0.5 * w * t) ** 2 / w**2)
        return self.radius * self.north_rate * (t**3 / 6.0 - late)

    def white(self, kind: Response, t: float) -> float:
        """Return the standard deviation of the position error by white noise of unit density, m per m/s/√s or per
        rad/√s."""
        w = self.frequency
        s1, s2, c1 = math.sin(w * t) / w, math.sin(2.0 * w * t) / (4.0 * w), math.cos(w * t)
        if kind == "velocity":
            return math.sqrt((0.5 * t - s2) / w**2)
        if kind == "tilt":
            return self.radius * math.sqrt(1.5 * t - 2.0 * s1 + s2)
        cross = 2.0 * (s1 - t * c1) / w**2
        return self.radius * self.north_rate * math.sqrt(t**3 / 3.0 - cross + (0.5 * t - s2) / w**2)

    def correlated(self, kind: Response, t: float, covariance: Callable[[Array, Array], Array]) -> float:
        """Return the standard deviation of the position error by a random rate of change, the root of ∫∫ h(t − u) h(t −
        v) covariance(u, v) du dv, by quadrature, m."""
        u, weight = 0.5 * t * (1.0 + _NODES), 0.5 * t * _WEIGHTS * self.impulse(kind, 0.5 * t * (1.0 - _NODES))
        first, second = np.meshgrid(u, u, indexing="ij")
        return math.sqrt(float(weight @ covariance(first.ravel(), second.ravel()).reshape(_POINTS, _POINTS) @ weight))

    def driven(self, kind: Response, t: float, change: Callable[[Array], Array]) -> float:
        """Return the position error by a given rate of change: ∫ h(t − u) change(u) du, by quadrature, m."""
        u = 0.5 * t * (1.0 + _NODES)
        return float(0.5 * t * (_WEIGHTS * self.impulse(kind, t - u)) @ change(u))


TURN, TURN_RATE = 90.0 * DEG, 3.0 * DEG
SPEED, GATHERING = 250.0, 0.25 * G0

AT_REST, TURNING, ACCELERATING = "at rest", "turning 90°", "speeding up"
ASSUMPTIONS = {
    AT_REST: "level, heading north",
    TURNING: "at 3°/s at the start, then at rest",
    ACCELERATING: "northwards to 250 m/s at 0.25 g at the start, then at that speed",
}
"""The motion of the vehicle."""


@dataclass(frozen=True)
class Term:
    """One error term of a sensor block."""

    name: str  # name of the quantity, as in [imu] without the unit
    value: float  # 1σ of a random error, or the value of a noise, in `unit`; the largest if it differs between axes
    unit: str  # unit of scenarios
    si: float  # the value in `si_unit`
    si_unit: str  # SI unit
    meaning: str  # description


@dataclass(frozen=True)
class Contribution:
    """The position error by one term alone."""

    term: str  # name of the term and of its effect
    assumes: str  # motion of the vehicle
    position: float  # standard deviation of the horizontal position error, m


@dataclass(frozen=True)
class Expectation:
    """The error terms of a sensor block and the position errors that they cause."""

    imu: Imu  # the sensor block
    latitude: float  # latitude of the vehicle, rad
    duration: float  # duration of the navigation, s
    terms: tuple[Term, ...]  # its error terms
    contributions: tuple[Contribution, ...]  # position errors, the largest first

    @property
    def total(self) -> float:
        """Root of the sum of squares of the contributions, m."""
        return math.hypot(*(c.position for c in self.contributions))

    @property
    def drawn(self) -> bool:
        """Whether every error is random with the mean zero."""
        fixed = (self.imu.stated(term)[0] for term in TERMS if term.drawn)
        return self.imu.null_shift is None and not any(np.any(value) for value in fixed)

    @property
    def height(self) -> float:
        """Error of the unaided height by the accelerometer's bias alone, b (cosh(√2 ωt) − 1)/2ω², m."""
        (bias,) = [term.si for term in self.terms if term.name == "accel_bias"] or [0.0]
        w = Schuler.at(self.latitude).frequency
        return bias * (math.cosh(math.sqrt(2.0) * w * self.duration) - 1.0) / (2.0 * w**2)


def expect(imu: Imu, latitude: float, duration: float = 3600.0) -> Expectation:
    """Return the position error by each error term of a sensor block at a latitude, rad, after a duration longer than
    the manoeuvres; the closed forms hold up to about an hour."""
    if imu.sensor_set.type != "gyros":
        raise InputError(
            "closed forms exist only for three gyros and three accelerometers; sensor_set.type = "
            f'"{imu.sensor_set.type}" is a different set.'
        )
    terms, sizes = [], {}
    for term in TERMS:
        fixed, sigma = imu.stated(term)
        size = np.hypot(fixed, sigma)  # root of the mean square
        sizes[term.triad, term.field] = size
        if size.any() and (term.field != "correlation_time" or sizes[term.triad, "instability"]):
            terms.append(_term(term, float(size.max())))
    shift = float(np.abs(_null_shift(imu, np.linspace(0.0, duration, 1000))).max())
    if shift:
        terms.append(
            Term(
                "gyro_null_shift",
                shift / DEG_H,
                "deg/h",
                shift,
                "rad/s",
                "bias by gas flow as the ring warms, the largest",
            )
        )
    block = _Block(imu, Schuler.at(latitude), duration)
    contributions = [
        *block.gyros({field: size for (triad, field), size in sizes.items() if triad == "gyro"}),
        *block.accelerometers({field: size for (triad, field), size in sizes.items() if triad == "accel"}),
    ]
    contributions = sorted((c for c in contributions if c.position > 0.0), key=lambda c: -c.position)
    return Expectation(imu, latitude, duration, tuple(terms), tuple(contributions))


def _term(term: ErrorTerm, si: float) -> Term:
    value = float(f"{si / term.unit:.12g}")  # 5, not 4.9999999999999996
    return Term(term.name, value, term.written_unit, si, term.written_si_unit, term.meaning)


def _null_shift(imu: Imu, t: Array) -> Array:
    """Return the null shift of laser gyros at instants, (N,) rad/s."""
    shift = imu.null_shift
    return np.zeros_like(t) if shift is None else shift.bias(imu.warm_up.temperature(t))


@dataclass(frozen=True)
class _Block:
    """A sensor block on a vehicle at rest, with the terms that drive the position error."""

    imu: Imu
    earth: Schuler
    duration: float

    def _rest(self, rates: Array) -> float:
        """Return the position error by constant errors of the gyros, (3,) rad/s, m."""
        tilt, azimuth = (float(self.earth.step(kind, np.asarray(self.duration))) for kind in ("tilt", "azimuth"))
        return math.hypot(tilt * rates[0], tilt * rates[1], azimuth * rates[2])

    def _warmth(self, length: float) -> float:
        """Return the magnitude of the mean temperature over a manoeuvre at the start, K."""
        instants = np.asarray(length * (np.arange(100) + 0.5) / 100.0, dtype=np.float64)
        return abs(float(self.imu.warm_up.temperature(instants).mean()))

    def _wandering(self, kind: Response, size: dict[str, Array]) -> Iterator[tuple[str, float]]:
        """Yield the position errors by random changes of an error along one axis, m."""
        t = self.duration
        if size["instability"]:
            tau = float(size["correlation_time"])
            sigma = self.earth.correlated(kind, t, lambda u, v: np.exp(-np.abs(u - v) / tau))
            yield "bias instability", float(size["instability"]) * sigma
        if size["rate_walk"]:
            yield "rate random walk", float(size["rate_walk"]) * self.earth.correlated(kind, t, np.minimum)
        if size["flicker"]:
            spacing = 1.0 / self.imu.rate_hz
            sigma = self.earth.correlated(kind, t, lambda u, v: flicker.covariance(np.abs(u - v) / spacing))
            yield "flicker", float(size["flicker"]) * sigma

    def gyros(self, size: dict[str, Array]) -> Iterator[Contribution]:
        """Yield the contributions of the gyros."""
        earth, t = self.earth, self.duration
        spin = np.abs([earth.north_rate, 0.0, earth.down_rate])
        after = np.asarray(t - 0.5 * TURN / TURN_RATE)
        turned = TURN * float(earth.impulse("azimuth", after))
        for i, axis in enumerate(("north", "east", "down")):
            yield Contribution(f"gyro bias, {axis}", AT_REST, self._rest(size["bias"] * np.eye(3)[i]))
        for name, at_rest, in_the_turn in (
            ("scale factor", size["scale"], size["scale"]),
            ("asymmetry", 0.5 * size["asymmetry"], 0.5 * size["asymmetry"]),
            ("quadratic non-linearity", size["quadratic"] * spin, size["quadratic"] * TURN_RATE),
            ("cubic non-linearity", size["cubic"] * spin**2, size["cubic"] * TURN_RATE**2),
        ):
            yield Contribution(f"gyro {name}, of the Earth's rate", AT_REST, self._rest(at_rest * spin))
            yield Contribution(f"gyro {name}, of a turn", TURNING, float(in_the_turn[2]) * turned)
        warmed_scale = float(size["scale_temperature"][2]) * self._warmth(TURN / TURN_RATE)
        yield Contribution("gyro scale factor by temperature, of a turn", TURNING, warmed_scale * turned)
        m = size["misalignment"]
        yield Contribution("gyro misalignment, to the Earth's rate", AT_REST, self._rest(np.sqrt(m**2 @ spin**2)))
        tilt = math.hypot(m[0, 2], m[1, 2]) * 2.0 * math.sin(0.5 * TURN)
        yield Contribution("gyro misalignment, to a turn", TURNING, tilt * float(earth.impulse("tilt", after)))
        yield Contribution("gyro g-sensitivity", AT_REST, self._rest(size["g_sensitivity"][:, 2] * earth.gravity))
        warmth = self.imu.warm_up.temperature
        channels: tuple[tuple[str, Response, int], ...] = (("level", "tilt", 2), ("down", "azimuth", 1))
        for name, kind, axes in channels:
            across = size["ramp"][:2] if kind == "tilt" else size["ramp"][2:]
            yield Contribution(f"gyro ramp, {name}", AT_REST, math.hypot(*across) * earth.ramp(kind, t))
            white = float(size["random_walk"]) * earth.white(kind, t)
            yield Contribution(f"angle random walk, {name}", AT_REST, white * math.sqrt(axes))
            for noise, position in self._wandering(kind, size):
                yield Contribution(f"gyro {noise}, {name}", AT_REST, position * math.sqrt(axes))
            warmed = earth.driven(kind, t, warmth)
            drift = size["bias_temperature"], size["scale_temperature"] * spin
            for what, rates in zip(("bias", "scale factor"), drift, strict=True):
                across = rates[:2] if kind == "tilt" else rates[2:]
                yield Contribution(f"gyro {what} by temperature, {name}", AT_REST, math.hypot(*across) * abs(warmed))
            shifted = earth.driven(kind, t, lambda u: _null_shift(self.imu, u))
            yield Contribution(f"gyro null shift, {name}", AT_REST, math.sqrt(axes) * abs(shifted))
        walk = earth.gravity * float(size["quantum"]) / math.sqrt(12.0 * self.imu.rate_hz)
        yield Contribution("angle quantisation", AT_REST, math.sqrt(2.0) * walk * earth.white("velocity", t))

    def accelerometers(self, size: dict[str, Array]) -> Iterator[Contribution]:
        """Yield the contributions of the accelerometers."""
        earth, t = self.earth, self.duration
        step = float(earth.step("velocity", np.asarray(t)))
        gathered = SPEED * abs(float(earth.impulse("velocity", np.asarray(t - 0.5 * SPEED / GATHERING))))
        m, cross = size["misalignment"], size["cross_axis"]
        for i, axis in enumerate(("north", "east")):
            yield Contribution(f"accelerometer bias, {axis}", AT_REST, float(size["bias"][i]) * step)
        leaning = math.hypot(m[0, 2], m[1, 2]) * earth.gravity
        yield Contribution("accelerometer misalignment, to gravity", AT_REST, leaning * step)
        for name, part in (
            ("scale factor", size["scale"][0]),
            ("scale factor by temperature", size["scale_temperature"][0] * self._warmth(SPEED / GATHERING)),
            ("asymmetry", 0.5 * size["asymmetry"][0]),
            ("quadratic non-linearity", size["quadratic"][0] * GATHERING),
            ("cubic non-linearity", size["cubic"][0] * GATHERING**2),
            ("misalignment, to an acceleration", m[1, 0]),
            ("cross-axis term", cross[0, 2] * earth.gravity),
        ):
            yield Contribution(f"accelerometer {name}", ACCELERATING, float(part) * gathered)
        ramp = math.hypot(*size["ramp"][:2]) * earth.ramp("velocity", t)
        yield Contribution("accelerometer ramp", AT_REST, ramp)
        white = float(size["random_walk"]) * earth.white("velocity", t)
        yield Contribution("velocity random walk", AT_REST, math.sqrt(2.0) * white)
        for noise, position in self._wandering("velocity", size):
            yield Contribution(f"accelerometer {noise}", AT_REST, math.sqrt(2.0) * position)
        warmed = earth.driven("velocity", t, self.imu.warm_up.temperature)
        yield Contribution(
            "accelerometer bias by temperature", AT_REST, math.hypot(*size["bias_temperature"][:2]) * abs(warmed)
        )
        w = earth.frequency
        pulses = float(size["quantum"]) / math.sqrt(12.0 * self.imu.rate_hz)
        response = math.sqrt(0.5 * t + math.sin(2.0 * w * t) / (4.0 * w))
        yield Contribution("velocity quantisation", AT_REST, math.sqrt(2.0) * pulses * response)


CIRCULAR = 0.8326
"""Ratio of the radius that holds half of all errors to their rms, √(ln 2), for equal normal north and east errors."""
_LINEAR = 5e5
"""Position error beyond which the linear theory does not hold, m."""


def expectation_numbers(expectation: Expectation) -> dict[str, Any]:
    """Return the expectation as plain numbers with units in the names."""
    e = expectation
    grade = find_grade(e.imu.grade)
    return {
        "grade": e.imu.grade,
        "description": grade.description,
        "source": grade.source,
        "latitude_deg": e.latitude / DEG,
        "duration_s": e.duration,
        "terms": [vars(term) for term in e.terms],
        "contributions": [{"term": c.term, "assumes": c.assumes, "position_m": c.position} for c in e.contributions],
        "root_sum_square_m": e.total,
        "root_sum_square_nmi": e.total / NAUTICAL_MILE,
        "circular_error_probable_nmi": CIRCULAR * e.total / NAUTICAL_MILE if e.drawn else None,
        "unaided_height_from_accelerometer_bias_m": e.height,
        "linear": e.total < _LINEAR,
    }


def expectation_exhibits(expectation: Expectation, notes: Iterable[str] = ()) -> Iterator[Item]:
    """Yield the error terms, and the position error that each causes, and notes on keys."""
    e = expectation
    grade = find_grade(e.imu.grade)
    yield Sentence(f"{grade_name(e.imu.grade)}: {grade.description}")
    yield Sentence(f"Source: {grade.source}\n")
    if not e.terms:
        yield Sentence("The sensors have no errors.")
        return
    heads = (Column("term", words=True), Column("value"), Column("", words=True), Column("SI"), Column("", words=True),
             Column("is", words=True))  # fmt: skip
    terms = [(t.name, _number(t.value), t.unit, f"{t.si:.4g}", t.si_unit.removeprefix("1"), t.meaning) for t in e.terms]
    yield Table(heads, terms, title="Value (1σ)")
    hours = e.duration / 3600.0
    columns = (Column("m (1σ)"), Column("nmi"), Column("from", words=True), Column("vehicle", words=True))
    causes = [(*_position(c.position), c.term, c.assumes) for c in e.contributions]
    title = f"Horizontal position error that each alone causes in {hours:g} h, latitude {e.latitude / DEG:g}°"
    yield Table(columns, [*causes, (*_position(e.total), "total", "")], title=title)
    assumed = dict.fromkeys(c.assumes for c in e.contributions)
    yield Sentence("Vehicle: " + "; ".join(f"{name}, {ASSUMPTIONS[name]}" for name in assumed) + ".")
    yield Sentence("All together: root of the sum of squares.")
    if e.total > _LINEAR:
        yield Sentence(f"The linear theory is not valid beyond {_LINEAR / 1e3:g} km: the position is lost.")
    elif e.total and e.drawn:
        yield Sentence(
            f"Half of all runs end within {CIRCULAR * e.total / NAUTICAL_MILE / hours:.2f} nmi per hour, which is "
            "called the class of a unit."
        )
    yield from map(Sentence, notes)
    if e.height:
        away = f"{_digits(e.height)} m" if e.height < _LINEAR else f"more than {_LINEAR / 1e3:g} km"
        yield Sentence(
            f"Height is not included: unaided, its error grows to {away} in {hours:g} h for the bias of the down "
            "accelerometer alone."
        )


def _number(value: float) -> str:
    """Write four digits, without a power of ten where it is not customary."""
    return f"{value:.0f}" if 1e4 <= value < 1e7 else f"{value:.4g}"


def _position(error: float) -> tuple[str, str]:
    """Write a position error in metres and nautical miles."""
    beyond = "> " if error > _LINEAR else ""
    error = min(error, _LINEAR)
    return beyond + _digits(error), beyond + _digits(error / NAUTICAL_MILE)


def _digits(value: float) -> str:
    """Write a number with three or four significant digits and no more."""
    rounded = float(f"{value:.4g}")
    decimals = sum(rounded < limit for limit in (100.0, 10.0, 1.0))
    return f"{rounded:,.{decimals}f}"
