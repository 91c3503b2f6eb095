"""The autopilot that flies JSBSim's aircraft: bank, heading, height and airspeed, thirty times a second.

Its gains and limits are those of the aircraft's `aircraft.toml` (tables [autopilot] and [performance]).

It has three loops, each with a reference that changes at rates usual for a pilot:

- lateral: heading error → bank → roll rate → aileron; the rudder keeps the sideslip at zero;
- vertical: height error → vertical speed → load factor → pitch rate → elevator. Load factor and pitch rate are related
  by the kinematics of the coordinated turn, q = (g/V)(n − cosθ cosφ), so that turns need no extra elevator term;
- airspeed: throttle, with feedforward of the power for a climb or an acceleration.

A glider has no height to hold: what would be its throttle is the sine of its descent, γ = −ḣ/V, whose whole travel
accelerates it by g along its path, so that energy of height becomes that of speed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan, cos, pi, remainder, sin

from sinssim.truth.atmosphere import Air
from sinssim.truth.flight.aircraft import Aircraft
from sinssim.units import DEG, KNOT

G = 9.80665
"""Gravity in the autopilot's kinematics [m/s²]."""

_SHORT = 4.0  # largest difference of the airspeed's reference from the airspeed [m/s]

INTERVAL = 1.0 / 30.0
"""Time between steps of the autopilot [s]."""

HEADING, BANK, ROLL_RATE = 0, 1, 2
"""Modes of the lateral loop."""

HEIGHT, PITCH, LOAD_FACTOR = 0, 1, 2
"""Modes of the vertical loop."""


@dataclass(slots=True)
class AircraftState:
    """The aircraft's state for the autopilot and the legs; refreshed in place."""

    time: float = 0.0  # flight time, s
    # roll, pitch, heading, rad
    phi: float = 0.0
    theta: float = 0.0
    psi: float = 0.0
    # angular rate in body axes, rad/s
    p: float = 0.0
    q: float = 0.0
    r: float = 0.0
    # calibrated and true airspeed, m/s
    cas: float = 0.0
    tas: float = 0.0
    height: float = 0.0  # above the ellipsoid, m
    climb: float = 0.0  # vertical speed, m/s
    beta: float = 0.0  # sideslip, rad
    alpha: float = 0.0  # angle of attack, rad (updated ten times per second, like all following values)
    latitude: float = 0.0  # rad
    longitude: float = 0.0  # rad
    track: float = 0.0  # direction of motion over the ground, rad
    ground_speed: float = 0.0  # m/s
    height_above_ground: float = 0.0  # m
    on_wheels: bool = False  # whether any part of the gear touches the ground
    engines_running: bool = True  # whether every engine runs
    air: Air = field(default_factory=Air)  # as the pilot knows it before the flight, without gusts and turbulence


class Autopilot:
    """Control loops; the legs set their targets.

    Attributes:
        lateral: HEADING, BANK or ROLL_RATE.
        heading, bank, roll_rate: targets of the lateral loop, rad, rad, rad/s.
        bank_limit: largest bank while holding a heading, rad.
        vertical: HEIGHT, PITCH or LOAD_FACTOR.
        height, pitch, load_factor: targets of the vertical loop, m, rad, g.
        climb_limit, descent_limit: largest vertical speeds towards a height, m/s.
        vertical_acceleration: limit of the change of the vertical speed towards a height, m/s².
        airspeed: target of the throttle, calibrated, m/s.
        fixed_elevator, fixed_aileron, fixed_rudder, fixed_throttle: settings that replace those of the loops.
        steering: whether the nose wheel steers to `heading`.
        brakes, gear, flaps: settings, as fractions of full travel.
        engines: whether the engines are to run.
        standing: whether the aircraft stands still, so that its model is not stepped.
        may_touch: whether the aircraft may touch the ground, to land.
        runway_height: height above the ellipsoid of the ground below, from now on, m; None: as at the start.
        heading_time: time constant of a heading error, s.
        height_rate: height error to vertical speed, 1/s.
        remarks: what a leg notes for the flight's events; it is emptied at the next step.
        elevator, aileron, rudder, throttle, steer: the commands, as fractions of full travel, JSBSim's signs.
    """

    def __init__(self, aircraft: Aircraft, interval: float) -> None:
        gains, performance = aircraft.autopilot, aircraft.performance
        self._gains = gains
        self.bank_rate = gains.bank_rate
        self._dt = interval
        self._reference = gains.reference_kt * KNOT
        self._roll_rate_max = gains.roll_rate_max_deg_s * DEG
        self._roll_step = gains.roll_acceleration_max_deg_s2 * DEG * interval
        self.vertical_acceleration = gains.vertical_acceleration_mps2
        self._climb_step = gains.vertical_acceleration_mps2 * interval
        self._speed_step = performance.acceleration_mps2 * interval
        self._throttle_step = gains.throttle_rate * interval
        self._load_lag = interval / (0.5 * gains.load_time_s + interval)  # two in a row
        self.glides = performance.glider
        self._load_max, self._load_min = performance.max_load_factor_g, performance.min_load_factor_g

        self.lateral, self.vertical = HEADING, HEIGHT
        self.heading = self.bank = self.roll_rate = 0.0
        self.height = self.pitch = 0.0
        self.load_factor = 1.0
        self.usual_bank = self.bank_limit = performance.bank_deg * DEG
        self.usual_climb = self.climb_limit = performance.climb_mps
        self.usual_descent = self.descent_limit = performance.descent_mps
        self.airspeed = performance.cruise_kt * KNOT
        self.fixed_elevator: float | None = None
        self.fixed_aileron: float | None = None
        self.fixed_rudder: float | None = None
        self.fixed_throttle: float | None = None
        self.steering = False
        self.brakes = self.gear = self.flaps = 0.0
        self.engines, self.standing, self.may_touch = True, False, False
        self.runway_height: float | None = None
        self.remarks: list[str] = []
        self.heading_time, self.height_rate = gains.heading_time_s, gains.height_rate
        self.elevator = self.aileron = self.rudder = self.throttle = self.steer = 0.0

        self._bank_reference = self._roll_reference = self._roll_integral = 0.0
        self._climb_reference = self._climb_ahead = self._pitch_integral = 0.0
        self._load_ahead = self._load_reference = 1.0
        self._speed_reference = self._throttle_integral = self._rudder_integral = self._descent = 0.0

    def engage(self, state: AircraftState, *, elevator: float, aileron: float, rudder: float, throttle: float) -> None:
        """Engage in trimmed flight with the trimmed settings, holding the current heading, height and airspeed."""
        self.heading, self.height, self.airspeed = state.psi, state.height, state.cas
        self._bank_reference, self._roll_reference = state.phi, 0.0
        self._climb_reference = state.climb
        self._speed_reference = state.cas
        self.elevator, self._pitch_integral = elevator, elevator
        self.aileron, self._roll_integral = aileron, aileron
        self.rudder, self._rudder_integral = rudder, rudder
        self.throttle, self._throttle_integral = throttle, throttle
        if self.glides:
            self._throttle_integral = self._descent = -state.climb / max(state.tas, 20.0)

    def resume(self, state: AircraftState) -> None:
        """Set the references to the aircraft's state, after a manoeuvre that they did not follow."""
        self._bank_reference, self._roll_reference = state.phi, state.p
        self._climb_reference, self._speed_reference = state.climb, state.cas
        self.lateral, self.vertical = HEADING, HEIGHT
        if self.fixed_throttle is not None:
            ahead = self._gains.climb_throttle * state.climb / max(state.tas, 20.0)
            self._throttle_integral = self.throttle - ahead
        self.fixed_elevator = self.fixed_aileron = self.fixed_rudder = self.fixed_throttle = None

    def step(self, m: AircraftState) -> None:
        """Compute the commands for the next interval."""
        tas = m.tas if m.tas > 20.0 else 20.0
        ratio = self._reference / m.cas if m.cas > 0.6 * self._reference else 1.0 / 0.6
        pressure = feedback = ratio * ratio
        if not self._gains.airspeed_scheduled:
            ratio = feedback = 1.0
        self._roll(m, tas, ratio, feedback)
        self._pitch(m, tas, ratio, feedback, pressure)
        self._power(m, tas)
        self._yaw(m, tas, feedback)

    # These methods are called thirty times per second: local names, and comparisons in place of min and max, save time.

    def _roll(self, m: AircraftState, tas: float, ratio: float, feedback: float) -> None:
        """Set the aileron: bank reference with limited rate and acceleration, then roll rate."""
        k, dt, phi = self._gains, self._dt, m.phi
        lateral = self.lateral
        step = self._roll_step
        if lateral == ROLL_RATE:
            change = self.roll_rate - self._roll_reference
            self._roll_reference += step if change > step else -step if change < -step else change
            error = self._roll_reference - m.p
        else:
            if lateral == HEADING:
                # A turn rate proportional to the error, and the bank of the coordinated turn: tanφ = ψ̇V/g.
                bank = atan(tas / (G * k.heading_time_s) * remainder(self.heading - m.psi, 2.0 * pi))
                limit = self.bank_limit
                bank = limit if bank > limit else -limit if bank < -limit else bank
            else:
                bank = self.bank
            limit = self._roll_rate_max
            rate = k.bank_rate * (bank - self._bank_reference)
            change = (limit if rate > limit else -limit if rate < -limit else rate) - self._roll_reference
            self._roll_reference += step if change > step else -step if change < -step else change
            self._bank_reference += self._roll_reference * dt
            error = self._roll_reference + k.bank_gain * (self._bank_reference - phi) - m.p
        if self.fixed_aileron is None:
            integral = self._roll_integral + k.roll_integral * error * dt
            self._roll_integral = 0.5 if integral > 0.5 else -0.5 if integral < -0.5 else integral
            aileron = ratio * k.roll_feedforward * self._roll_reference + feedback * k.roll_gain * error + integral
            self.aileron = 1.0 if aileron > 1.0 else -1.0 if aileron < -1.0 else aileron
        else:
            self.aileron = self.fixed_aileron

    def _climb_to_height(self, m: AircraftState) -> float:
        """Return the vertical speed towards the height, m/s."""
        climb = self._gains.height_rate * (self.height - m.height)
        limit = self.climb_limit
        # At full throttle with the airspeed below its reference, the climb is reduced in favour of the airspeed.
        margin = (m.cas - self._speed_reference + _SHORT) / (0.6 * _SHORT)
        limit *= 1.0 if margin > 1.0 else margin if margin > 0.0 else 0.0
        return limit if climb > limit else -self.descent_limit if climb < -self.descent_limit else climb

    def _load(self, m: AircraftState, tas: float, weight: float) -> float:
        """Return the load factor for the vertical target, by a vertical speed with limited acceleration."""
        k, dt = self._gains, self._dt
        cos_theta = cos(m.theta)
        if self.vertical == HEIGHT:
            climb = -self._descent * tas if self.glides else self._climb_to_height(m)
            change = climb - self._climb_reference
            step = self._climb_step
            change = step if change > step else -step if change < -step else change
            self._climb_reference += change
            self._climb_ahead = self._climb_reference + k.throttle_lead_s * change / dt
            load = change / dt + k.path_gain * (self._climb_reference - m.climb)
            # The bank at the time when the lift has followed.
            cos_bank = cos(m.phi + k.load_time_s * self._roll_reference)
            return (cos_theta + load / (G * (cos_theta if cos_theta > 0.3 else 0.3))) / (
                cos_bank if cos_bank > 0.15 else 0.15
            )
        self._climb_reference = self._climb_ahead = m.climb
        if self.vertical == PITCH:
            rate = 0.8 * (self.pitch - m.theta)
            return weight + tas / G * (0.06 if rate > 0.06 else -0.06 if rate < -0.06 else rate)
        return self.load_factor

    def _pitch(self, m: AircraftState, tas: float, ratio: float, feedback: float, pressure: float) -> None:
        """Set the elevator: load factor, then pitch rate."""
        k, dt = self._gains, self._dt
        weight = cos(m.theta) * cos(m.phi)
        load = self._load(m, tas, weight)
        load = self._load_max if load > self._load_max else self._load_min if load < self._load_min else load
        # The lift lags the pitch rate by the time constant of the angle of attack, mV/(qS dC_L/dα): lead it by that.
        self._load_ahead += self._load_lag * (load - self._load_ahead)
        change = self._load_lag * (self._load_ahead - self._load_reference)
        self._load_reference += change
        if self.fixed_elevator is None:
            rate = (
                G
                / tas
                * (self._load_reference - weight + k.lift_time_s * pressure * tas / self._reference * change / dt)
            )
            error = rate - m.q
            integral = self._pitch_integral - feedback * k.pitch_integral * error * dt
            self._pitch_integral = 0.8 if integral > 0.8 else -0.8 if integral < -0.8 else integral
            elevator = integral - feedback * k.pitch_gain * error - ratio * k.pitch_feedforward * rate
            self.elevator = 1.0 if elevator > 1.0 else -1.0 if elevator < -1.0 else elevator
        else:
            self.elevator = self.fixed_elevator

    def _power(self, m: AircraftState, tas: float) -> None:
        """Set the throttle, or the descent of a glider."""
        k, dt, cas = self._gains, self._dt, m.cas
        if self.fixed_throttle is None:
            change = self.airspeed - self._speed_reference
            step = self._speed_step
            change = step if change > step else -step if change < -step else change
            reference = self._speed_reference + change
            self._speed_reference = (
                cas + _SHORT if reference > cas + _SHORT else cas - _SHORT if reference < cas - _SHORT else reference
            )
            error = self._speed_reference - cas
            climb = 0.0 if self.glides else self._climb_ahead
            ahead = k.climb_throttle * (climb / tas + change / (dt * G))
            throttle = self._throttle_integral + k.speed_gain * error + ahead
            if 0.0 < throttle < 1.0 or (throttle >= 1.0) == (error < 0.0):
                self._throttle_integral += k.speed_integral * error * dt
            if self.glides:
                self._descent = 0.7 if throttle > 0.7 else -0.3 if throttle < -0.3 else throttle
                return
        else:
            throttle = self.fixed_throttle
        throttle = 1.0 if throttle > 1.0 else 0.0 if throttle < 0.0 else throttle
        change = throttle - self.throttle
        step = self._throttle_step
        self.throttle += step if change > step else -step if change < -step else change

    def _yaw(self, m: AircraftState, tas: float, feedback: float) -> None:
        """Set nose wheel and rudder."""
        k = self._gains
        # On the ground pedals and nose wheel hold the heading. In the air the pedals coordinate: the yaw rate of the
        # coordinated turn, r = (g/V) cosθ sinφ, and zero sideslip. JSBSim's rudder is positive nose left.
        if self.steering:
            steer = k.steering_gain * (remainder(self.heading - m.psi, 2.0 * pi) - m.r)
            self.steer = 1.0 if steer > 1.0 else -1.0 if steer < -1.0 else steer
            self.rudder = -self.steer
        elif self.fixed_rudder is not None:
            self.rudder = self.fixed_rudder
        else:
            self.steer = 0.0
            integral = self._rudder_integral - feedback * k.sideslip_integral * m.beta * self._dt
            self._rudder_integral = 0.5 if integral > 0.5 else -0.5 if integral < -0.5 else integral
            yaw = G / tas * cos(m.theta) * sin(m.phi)
            rudder = integral - k.yaw_feedforward * yaw
            rudder -= feedback * (k.yaw_gain * (yaw - m.r) + k.sideslip_gain * m.beta)
            self.rudder = 1.0 if rudder > 1.0 else -1.0 if rudder < -1.0 else rudder
