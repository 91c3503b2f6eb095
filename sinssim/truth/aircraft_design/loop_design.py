"""The gains of the autopilot's loops from linear models of an aircraft, and the margins that they leave.

Each loop is closed over the models of all trims, with the schedule of the autopilot over airspeed. The inner gains are
the largest that leave `LEAST_DB` and `LEAST_DEG` at every trim and whose crossover is at most that of the loop: the
rate loops are proportional-integral control of fixed corner, the largest gain of which rejects disturbances best.
Feedforward and the rudder's gains minimise a quadratic cost of the linear response to a usual manoeuvre, the latter
also to a gust from the side (LQ of the structure that the autopilot has). The outer loops follow by the separation of
their time constants from the inner ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.truth.aircraft_design.linear_model import OMEGA, LinearModel, Margins, Trim, lift_lag, margins
from sinssim.truth.flight.aircraft import AutopilotGains
from sinssim.truth.flight.autopilot import INTERVAL, G
from sinssim.units import DEG, KNOT

LEAST_DB, LEAST_DEG = 8.0, 50.0
"""Margins of each loop: the usual 6 dB and 45° with a reserve for heights and loads between the trims."""
_PITCH_CROSSOVER, _ROLL_CROSSOVER, _YAW_CROSSOVER = 8.0, 4.0, 2.0
"""Largest crossovers, rad/s: a twentieth of the commands' 188 rad/s at most, whose hold costs 8°."""
_CORNER = 2.0  # corner of the rate loops, 1/s: below the crossover, so that the integral costs at most 30° there
_LADDER = np.geomspace(0.002, 8.0, 70)  # gains that are tried, steps of 1 dB
_FINER = (1.1, 1.075, 1.05, 1.025, 1.0)  # within a step
_EARLY = 0.4  # of a response that is still that of the rate alone [s]
_HORIZON = 8.0  # of a simulated response [s]; the models are of 12 s
_SLOWLY = 0.1  # of feedforward for what is nearly steady [rad/s]
_LONGEST_LEAD = 3.0  # of the throttle [s]
_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the inverse of the plant, as feedforward
_GUST = 5.0  # from the side, moderate [m/s]
_SPEED_INTEGRAL = 0.016  # of the airspeed: 1 m/s moves the throttle by a tenth in six seconds
_DAMPING = 0.9  # of the outer loops
_APART = 4.0 * _DAMPING**2  # time constant of an outer loop over that of the loop inside, for this damping
_BANK = 25.0  # of a usual turn, from which the heading's loop rolls out [°]
_SLOWEST_HEADING = 20.0  # largest time constant of the heading [s]
_LOAD_LAG = 0.35  # least lag of the load factor's reference [s]
_LEVELLING = (0.7, 3.0)  # range of the vertical acceleration, m/s²: 0.07 g that passengers notice, 0.3 g


@dataclass(frozen=True)
class DesignPoint:
    """The linear models of one trim."""

    trim: Trim
    height: float  # m
    lateral: LinearModel
    vertical: LinearModel


@dataclass(frozen=True)
class LoopMargins:
    """The margins of a loop at one trim."""

    loop: str  # "pitch", "roll" or "yaw"
    height: float  # m
    airspeed: float  # calibrated, m/s
    margins: Margins


@dataclass(frozen=True)
class LoopDesign:
    """Gains and what they were derived from."""

    gains: AutopilotGains
    margins: tuple[LoopMargins, ...]
    roll_lag: float  # time constant of the roll rate, s
    lift_lag: float  # of the lift at the reference, s
    engine_lag: float  # of the thrust, s
    thrust: float  # acceleration by the whole travel of the throttle, m/s²

    def least(self, loop: str) -> Margins:
        """Return the smallest margins of a loop over all trims."""
        of = [entry.margins for entry in self.margins if entry.loop == loop]
        return Margins(min(m.gain_db for m in of), min(m.phase_deg for m in of), max(m.crossover for m in of))


_INTEGRAL = INTERVAL / (1.0 - np.exp(-1j * OMEGA * INTERVAL))
"""Frequency response of a sum over the autopilot's steps, times its interval."""


class _Scheduled:
    """A trim with the factors of the autopilot's gains there."""

    def __init__(self, point: DesignPoint, reference: float, *, scheduled: bool) -> None:
        self.point, self.trim = point, point.trim
        self.ratio = min(reference / point.trim.cas, 1.0 / 0.6) if scheduled else 1.0
        self.feedback = self.ratio**2
        self.g_vertical, self.g_lateral = point.vertical.response(OMEGA), point.lateral.response(OMEGA)
        self.a, self.b, self.c = point.lateral.a, point.lateral.b, point.lateral.c

    def pitch(self, gain: float, integral: float) -> Array:
        """Return the loop broken at the elevator."""
        loop: Array = -self.feedback * (gain + integral * _INTEGRAL) * self.g_vertical[:, 0, 0]
        return loop

    def bandwidth(self, gain: float, integral: float, feedforward: float) -> float:
        """Return the highest frequency at which the pitch rate follows what is wanted within −3 dB, rad/s; slowly, as
        in a phugoid, it follows nothing."""
        loop = self.pitch(gain, integral)
        follows = np.abs((loop - self.ratio * feedforward * self.g_vertical[:, 0, 0]) / (1.0 + loop)) >= math.sqrt(0.5)
        return float(OMEGA[np.flatnonzero(follows)[-1]]) if follows.any() else float(OMEGA[0])

    def lateral_loops(self, k: _Lateral) -> tuple[Array, Array]:
        """Return the loops broken at the aileron and at the rudder, the other one closed."""
        aileron, rudder = self.g_lateral[:, :, 0], self.g_lateral[:, :, 1]
        rate = self.feedback * k.roll_gain + k.roll_integral * _INTEGRAL
        zero = np.zeros_like(rate)
        to_aileron = np.stack([rate, k.bank_gain * rate, zero, zero], axis=1)
        slip = self.feedback * (k.sideslip_gain + k.sideslip_integral * _INTEGRAL)
        turn = self.feedback * k.yaw_gain + zero
        to_rudder = np.stack([zero, turn * G / self.trim.tas, -turn, slip], axis=1)

        def loop(first: Array, second: Array) -> Array:
            product: Array = np.sum(first * second, axis=1)
            return product

        crossed = loop(to_aileron, rudder) * loop(to_rudder, aileron)
        own_aileron, own_rudder = loop(to_aileron, aileron), loop(to_rudder, rudder)
        return own_aileron - crossed / (1.0 + own_rudder), own_rudder - crossed / (1.0 + own_aileron)

    def heading(self, k: _Lateral, bank_rate: float, feedforward: float) -> Array:
        """Return the loop broken at the heading's error, times the time constant of the heading: bank reference, closed
        lateral loops, yaw rate."""
        aileron, rudder = self.g_lateral[:, :, 0], self.g_lateral[:, :, 1]
        s = 1.0 / _INTEGRAL
        rate = self.feedback * k.roll_gain + k.roll_integral * _INTEGRAL
        roll, bank = rate, k.bank_gain * rate
        to_yaw = self.feedback * k.yaw_gain
        turn = (to_yaw + k.yaw_feedforward) * G / self.trim.tas
        slip = self.feedback * (k.sideslip_gain + k.sideslip_integral * _INTEGRAL)

        def of_aileron(y: Array) -> Array:
            command: Array = roll * y[:, 0] + bank * y[:, 1]
            return command

        def of_rudder(y: Array) -> Array:
            command: Array = turn * y[:, 1] - to_yaw * y[:, 2] + slip * y[:, 3]
            return command

        # aileron = wanted − its loops, rudder = −its loops, for a unit of the bank's reference
        wanted = self.ratio * feedforward * s + rate * (s + k.bank_gain)
        share = of_rudder(aileron) / (1.0 + of_rudder(rudder))
        moved = wanted / (1.0 + of_aileron(aileron) - of_aileron(rudder) * share)
        yaw_rate = moved * (aileron[:, 2] - rudder[:, 2] * share)
        loop: Array = self.trim.tas / G * bank_rate / (s + bank_rate) * yaw_rate / s
        return loop


@dataclass(frozen=True)
class _Lateral:
    """Gains of the lateral loops; see `AutopilotGains`."""

    bank_gain: float
    roll_gain: float
    roll_integral: float
    yaw_feedforward: float = 0.0
    yaw_gain: float = 0.0
    sideslip_gain: float = 0.0
    sideslip_integral: float = 0.0


def design_loops(
    points: Sequence[DesignPoint], climb: float, *, pace: float = 1.0, airspeed_scheduled: bool | None = None
) -> LoopDesign:
    """Design the gains from the linear models at several trims.

    Args:
        points: the trims; the first is the reference, usually cruise.
        climb: fastest usual climb or descent, m/s.
        pace: of the loops, over the fastest that have the margins.
        airspeed_scheduled: whether the gains follow the airspeed; None: as the responses do.

    Returns:
        Gains, margins and what they follow from.

    Raises:
        InputError: an axis does not answer its control, or no gain leaves the margins.
    """
    if airspeed_scheduled is None:
        likely = _follows_pressure(points)
        try:
            return design_loops(points, climb, pace=pace, airspeed_scheduled=likely)
        except InputError:
            return design_loops(points, climb, pace=pace, airspeed_scheduled=not likely)
    reference, scheduled = points[0].trim.cas, airspeed_scheduled
    places = [_Scheduled(point, reference, scheduled=scheduled) for point in points]
    pitch_gain = _largest(
        places, lambda at, k: [at.pitch(k, _CORNER * k)], pace * _PITCH_CROSSOVER, "elevator", _settles_q
    )
    pitch_feedforward = _pitch_feedforward(places[0], pitch_gain, _CORNER * pitch_gain)
    bandwidth = places[0].bandwidth(pitch_gain, _CORNER * pitch_gain, pitch_feedforward)
    lateral, roll_lag, roll_feedforward = _lateral(places, pace)
    bank_rate = min(1.2, 0.75 * lateral.bank_gain)
    roll_rate = min(30.0, max(4.0, math.degrees(_full_roll_rate(places[0])) / 5.0))  # a fifth of full aileron's
    at_reference = min(3.0, lift_lag(points[0].vertical, points[0].trim) * reference / points[0].trim.tas)
    load_time = min(1.5, max(_LOAD_LAG, 1.2 / bandwidth))
    path_gain = min(0.9, 0.5 * pace / (load_time + 1.0 / bandwidth))  # 60° of phase with both lags
    acceleration = roll_rate / max(0.7, 2.0 * roll_lag)
    # half of the time to roll out of a turn, during which the heading still changes, and a third more
    rolling_out = 1.3 * 0.5 * (_BANK / roll_rate + roll_rate / acceleration)
    courses = [at.heading(lateral, bank_rate, roll_feedforward) for at in places]
    engine_lag, thrust = engine_response(points[0].vertical) or (1.0 / path_gain, G)
    # at most so steep that the fastest climb levels off within the largest acceleration: v/k over v²/(2 a), with 10 %
    height_rate = min(path_gain / _APART, 2.0 * _LEVELLING[1] / (1.1 * climb))
    climb_throttle, lead = _climb_throttle(points[0]) or (G / thrust, 0.0)
    natural = pace * min(math.sqrt(_SPEED_INTEGRAL * thrust), 0.3 / max(engine_lag, 1e-3))
    gains = AutopilotGains(
        reference_kt=_rounded(reference / KNOT, 4),
        airspeed_scheduled=scheduled,
        roll_rate_max_deg_s=_rounded(roll_rate),
        roll_acceleration_max_deg_s2=_rounded(acceleration),
        bank_rate=_rounded(bank_rate),
        bank_gain=_rounded(lateral.bank_gain),
        roll_feedforward=_rounded(roll_feedforward),
        roll_gain=_rounded(lateral.roll_gain),
        roll_integral=_rounded(lateral.roll_integral),
        heading_time_s=_rounded(_heading_time(courses, max(_APART / bank_rate, rolling_out))),
        height_rate=_rounded(height_rate),
        path_gain=_rounded(path_gain),
        # the height's loop asks for k v when it begins to level off
        vertical_acceleration_mps2=_rounded(min(_LEVELLING[1], max(_LEVELLING[0], 1.2 * height_rate * climb))),
        load_time_s=_rounded(load_time),
        lift_time_s=_rounded(at_reference),
        pitch_feedforward=_rounded(pitch_feedforward),
        pitch_gain=_rounded(pitch_gain),
        pitch_integral=_rounded(_CORNER * pitch_gain),
        speed_gain=_rounded(2.0 * _DAMPING * natural / thrust),
        speed_integral=_rounded(natural**2 / thrust),
        climb_throttle=_rounded(climb_throttle),
        throttle_lead_s=_rounded(lead),
        throttle_rate=_rounded(min(0.3, max(0.1, 0.4 / (1.0 + engine_lag)))),
        yaw_feedforward=_rounded(lateral.yaw_feedforward),
        yaw_gain=_rounded(lateral.yaw_gain),
        sideslip_gain=_rounded(lateral.sideslip_gain),
        sideslip_integral=_rounded(lateral.sideslip_integral),
        steering_gain=1.0,
    )
    return LoopDesign(gains, loop_margins(points, gains), roll_lag, at_reference, engine_lag, thrust)


def _heading_time(courses: Sequence[Array], least: float) -> float:
    """Return the time constant of the heading from a least one on that leaves the margins of its loops, s."""
    time = least
    while time < _SLOWEST_HEADING and not all(_enough(margins(loop / time)) for loop in courses):
        time *= 1.05
    return time


def loop_margins(points: Sequence[DesignPoint], gains: AutopilotGains) -> tuple[LoopMargins, ...]:
    """Return the margins that gains leave at each trim: each loop is broken with the others closed."""
    reference, stability = gains.reference_kt * KNOT, list[LoopMargins]()
    k = _Lateral(
        gains.bank_gain, gains.roll_gain, gains.roll_integral, 0.0, gains.yaw_gain, gains.sideslip_gain,
        gains.sideslip_integral,
    )  # fmt: skip
    for point in points:
        at = _Scheduled(point, reference, scheduled=gains.airspeed_scheduled)
        roll, yaw = at.lateral_loops(k)
        for name, loop in (("pitch", at.pitch(gains.pitch_gain, gains.pitch_integral)), ("roll", roll), ("yaw", yaw)):
            stability.append(LoopMargins(name, point.height, point.trim.cas, margins(loop)))
    return tuple(stability)


def _rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


def _follows_pressure(points: Sequence[DesignPoint]) -> bool:
    """Return whether the responses grow with the square of the airspeed, as those of plain control surfaces do, rather
    than not at all, as those of a control system that commands rates."""
    slow, fast = min(points, key=_airspeed), max(points, key=_airspeed)
    if fast.trim.cas < 1.1 * slow.trim.cas:
        return True
    early, exponents = round(_EARLY / INTERVAL), 0.0  # before the Dutch roll and the airspeed answer
    for quick, lazy, control in (
        (fast.vertical, slow.vertical, "elevator"), (fast.lateral, slow.lateral, "aileron")):  # fmt: skip
        grown = abs(quick.step(control, early)[-1, 0] / lazy.step(control, early)[-1, 0])
        exponents += math.log(grown) / math.log(fast.trim.cas / slow.trim.cas)
    return exponents / 2.0 > 0.7


def _airspeed(point: DesignPoint) -> float:
    return point.trim.cas


def _largest(
    places: Sequence[_Scheduled], loops: Callable[[_Scheduled, float], list[Array]], crossover: float, control: str,
    settles: Callable[[_Scheduled, float], bool],
) -> float:  # fmt: skip
    """Return the largest gain with the margins at every trim."""

    def suits(gain: float) -> bool:
        stability = [margins(loop) for at in places for loop in loops(at, gain)]
        return all(_enough(m) and m.crossover <= crossover for m in stability) and all(
            settles(at, gain) for at in places
        )

    for gain in reversed(_LADDER.tolist()):
        if suits(gain):
            return float(next(factor * gain for factor in _FINER if factor == 1.0 or suits(factor * gain)))
    raise InputError(
        f"no gain of the {control} leaves margins of {LEAST_DB:g} dB and {LEAST_DEG:g}° at "
        f"{', '.join(f'{at.trim.cas / KNOT:.0f} kt' for at in places)}"
    )


def _enough(stability: Margins) -> bool:
    """Return whether a loop has the margins."""
    return stability.gain_db >= LEAST_DB and stability.phase_deg >= LEAST_DEG


def _settles(values: Array) -> bool:
    """Return whether a response has decayed by the end of its horizon."""
    size = np.abs(values)
    return bool(np.isfinite(size).all() and size[-len(size) // 4 :].max() < 0.5 * size.max())


def _settles_q(at: _Scheduled, gain: float) -> bool:
    """Return whether the pitch rate after a pulse of the elevator decays with a gain."""
    return _settles(_pitch_response(at, gain, _CORNER * gain, 0.0, pulse=1.0)[0])


def _pitch_response(
    at: _Scheduled, gain: float, integral: float, feedforward: float, *, pulse: float = 0.0, rate: float = 0.0
) -> tuple[Array, Array]:
    """Return pitch rate and elevator after a pulse of the elevator, or a pitch rate wanted from the start with the lag
    of the load factor's reference."""
    model = at.point.vertical
    state, total, wanted = model.b[:, 0] * pulse, 0.0, 0.0
    rates, elevators, row = [], [], model.c[0]
    for _ in range(round(_HORIZON / INTERVAL)):
        wanted += INTERVAL / _LOAD_LAG * (rate - wanted)
        error = wanted - row @ state
        total -= at.feedback * integral * error * INTERVAL
        elevator = total - at.feedback * gain * error - at.ratio * feedforward * wanted
        rates.append(wanted - error)
        elevators.append(elevator)
        state = model.a @ state + model.b[:, 0] * elevator
    return np.array(rates), np.array(elevators)


def _pitch_feedforward(at: _Scheduled, gain: float, integral: float) -> float:
    """Return the feedforward of the pitch rate that costs least: the square of the rate's error over 3 s."""
    inverse = -float(np.real(1.0 / at.point.vertical.response(np.array([1.0]))[0, 0, 0]))
    if inverse <= 0.0:
        return 0.0
    wanted = 1.0 - np.exp(-np.arange(90) * INTERVAL / _LOAD_LAG)

    def cost(share: float) -> float:
        rates, _ = _pitch_response(at, gain, integral, share * inverse, rate=1.0)
        return float(np.sum((rates[:90] - wanted) ** 2))

    return min(_SHARES, key=cost) * inverse


def _roll_lag(model: LinearModel) -> float:
    """Return the time constant τ that K (1 − e^(−t/τ)) has in common with the first second of the roll rate, s."""
    rate = model.step("aileron", round(1.0 / INTERVAL))[:, 0]
    if rate[round(_EARLY / INTERVAL)] <= 0.0:
        raise InputError("a positive aileron does not roll the aircraft to the right")
    time = np.arange(len(rate)) * INTERVAL

    def missed(lag: float) -> float:
        shape = 1.0 - np.exp(-time / lag)
        return float(np.sum((rate - shape * (shape @ rate) / (shape @ shape)) ** 2))

    return float(min(np.geomspace(0.05, 2.0, 150), key=missed))


def _full_roll_rate(at: _Scheduled) -> float:
    return float(1.0 / max(1e-6, np.real(1.0 / at.point.lateral.response(np.array([1.0]))[0, 0, 0])))


def _lateral(places: Sequence[_Scheduled], pace: float) -> tuple[_Lateral, float, float]:
    """Return the lateral gains, the time constant of the roll rate, s, and the feedforward of the roll rate."""
    first = places[0]
    roll_lag = _roll_lag(first.point.lateral)
    corner = min(_CORNER, 1.0 / roll_lag)

    def lateral(gain: float, bank_gain: float = 1.0) -> _Lateral:
        return _Lateral(bank_gain, gain, corner * gain)

    gain = _largest(
        places, lambda at, k: [at.lateral_loops(lateral(k))[0]], pace * _ROLL_CROSSOVER, "aileron",
        lambda at, k: _settles(_roll_in(at, lateral(k), 0.0, pulse=1.0)[0]),
    )  # fmt: skip
    crossover = margins(first.lateral_loops(lateral(gain))[0]).crossover
    bank_gain = min(2.0, max(0.5, 0.5 * crossover))
    while bank_gain > 0.2 and not _has_margins(places, lateral(gain, bank_gain)):
        bank_gain *= 0.8
    best, cost, turn = lateral(gain, bank_gain), math.inf, _turn_rudder(first)
    for yaw_gain in (0.0, 0.3, 1.0):
        for sideslip in (0.0, 0.25, 0.5, 1.0, 2.0):
            k = _Lateral(bank_gain, gain, corner * gain, turn, yaw_gain, sideslip, 0.3 * sideslip)
            if not _has_margins(places, k):
                continue
            if any(margins(at.lateral_loops(k)[1]).crossover > pace * _YAW_CROSSOVER for at in places):
                continue
            with_gain = sum(_cost(at, k) + _cost(at, k, gust=_GUST) for at in places)
            if with_gain < 0.98 * cost:  # a larger gain must be worth it
                best, cost = k, with_gain
    if math.isinf(cost):
        raise InputError(f"no gains of the aileron and the rudder leave margins of {LEAST_DB:g} dB and {LEAST_DEG:g}°")
    plant = float(np.real(1.0 / first.point.lateral.response(np.array([1.0]))[0, 0, 0]))
    share = min(_SHARES, key=lambda part: _cost(first, best, part * max(plant, 0.0)))
    return best, roll_lag, share * max(plant, 0.0)


def _has_margins(places: Sequence[_Scheduled], k: _Lateral) -> bool:
    """Return whether both lateral loops have the margins at every trim."""
    loops = [margins(loop) for at in places for loop in at.lateral_loops(k)]
    return all(map(_enough, loops))


def _cost(at: _Scheduled, k: _Lateral, feedforward: float = 0.0, *, gust: float = 0.0) -> float:
    """Return the quadratic cost of a roll-in to 20°: bank error and, twice as dear, sideslip; or of a gust from the
    side, m/s: bank error, and by how much the heading changes in half a second."""
    error, slip, rate = _roll_in(at, k, feedforward, bank=0.0 if gust else 20.0 * DEG, gust=gust)
    beside = 0.5 * rate if gust else 2.0 * slip
    total = float(np.sum(error**2) + np.sum(beside**2))
    return total if math.isfinite(total) else math.inf


def _turn_rudder(at: _Scheduled) -> float:
    """Return the rudder for a yaw rate of the steady turn, beside that against the sideslip: −δr/r where β = 0."""
    response = at.point.lateral.response(np.array([_SLOWLY]))[0]  # rows p, phi, r, beta
    try:
        controls = np.linalg.solve(response[[1, 3]], np.array([1.0, 0.0]))
    except np.linalg.LinAlgError:
        return 0.0
    return min(10.0, max(0.0, -float(np.real(controls[1])) * at.trim.tas / G))


def _roll_in(
    at: _Scheduled, k: _Lateral, feedforward: float, *, pulse: float = 0.0, bank: float = 0.0, gust: float = 0.0
) -> tuple[Array, Array, Array]:
    """Return the bank's error, the sideslip and the yaw rate after a pulse of the aileron, after a gust from the side,
    m/s, or while rolling to an angle of bank by the reference of the autopilot (rate at most 10°/s, time constant
    1.5 s). In the air of the gust, the aircraft begins with its sideslip."""
    blown = np.linalg.pinv(at.c)[:, 3] * gust / at.trim.tas  # the smallest state
    state, total_aileron, total_rudder = at.b[:, 0] * pulse + blown, 0.0, 0.0
    angle, errors, slips, rates = 0.0, [], [], []
    for _ in range(round(_HORIZON / INTERVAL)):
        p, phi, r, beta = at.c @ state
        rate = max(-10.0 * DEG, min(10.0 * DEG, (bank - angle) / 1.5))
        angle += rate * INTERVAL
        error = rate + k.bank_gain * (angle - phi) - p
        total_aileron += k.roll_integral * error * INTERVAL
        aileron = at.ratio * feedforward * rate + at.feedback * k.roll_gain * error + total_aileron
        total_rudder -= at.feedback * k.sideslip_integral * beta * INTERVAL
        yaw = G / at.trim.tas * phi
        rudder = total_rudder - k.yaw_feedforward * yaw
        rudder -= at.feedback * (k.yaw_gain * (yaw - r) + k.sideslip_gain * beta)
        errors.append(angle - phi)
        slips.append(beta)
        rates.append(r)
        state = at.a @ state + at.b @ (aileron, rudder)
    return np.array(errors), np.array(slips), np.array(rates)


def _climb_throttle(point: DesignPoint) -> tuple[float, float] | None:
    """Return the throttle over the angle of climb at constant airspeed and its lead before the climb, s: K and T of
    K (1 + T s), which the throttle of a slow oscillation is; None for a glider."""
    model = point.vertical
    if "throttle" not in model.inputs:
        return None
    answers = model.response(np.array([_SLOWLY]))[0, [model.outputs.index("climb"), model.outputs.index("cas")]]
    throttle = complex(np.linalg.lstsq(answers, np.array([1.0, 0.0]), rcond=None)[0][1]) * point.trim.tas
    if throttle.real <= 0.0:
        return None
    return throttle.real, min(_LONGEST_LEAD, max(0.0, throttle.imag / (_SLOWLY * throttle.real)))


def engine_response(model: LinearModel) -> tuple[float, float] | None:
    """Return the lag of the thrust behind the throttle, s, and the acceleration by its whole travel, m/s²; None for a
    glider: its descent accelerates it, by g times its sine, with the lag of the path.

    The acceleration is the largest of the airspeed in the response to the throttle, its lag the time to 63 % of that.
    """
    if "throttle" not in model.inputs:
        return None
    speed = model.step("throttle", round(8.0 / INTERVAL))[:, model.outputs.index("cas")]
    over = 15  # half a second
    change = (speed[over:] - speed[:-over]) / (over * INTERVAL)
    thrust = float(change.max())
    if thrust < 0.05:
        raise InputError("the throttle does not accelerate the aircraft")
    return float(np.argmax(change >= 0.63 * thrust)) * INTERVAL, thrust
