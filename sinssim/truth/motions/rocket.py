"""The true motion of a rocket, [rocket]: from its pad through the stages, out of the air and back.

The motion is integrated in inertial axes, which are Earth-fixed at time 0:

    r̈ = γ(r) + f,   f = (T/m) x_b − ½ (C_D A/m) ρ |v_a| v_a,   v_a = v − ω_ie × r

with the gravitation γ of [truth], the thrust T along the body and its linearly falling mass m. The air turns with the
Earth; its density ρ is that of the U.S. Standard Atmosphere 1976 (the polynomial of degree 9 in height through ln ρ is
within 5 % of it), and zero from 100 km on. There the rocket falls freely, and the specific force is exactly zero.

The specific force is a given function, not a difference of states, and the solution's error (Dormand and Prince of
order 8, steps below half a second in the air) is below the rounding of Earth-fixed coordinates. The increments
are its quadrature between the instants at which thrust, drag or mass jump.

The elevation ε above the horizon of the pad follows the program, the body spins by φ about its axis, and the axes of
the pad, heading ψ, are released from the Earth's rotation within a second after lift-off. With the azimuth α from ψ and
the time τ during which they have turned with the Earth,

    C_eb = R_z(−ω_ie (t − τ)) C_en R_z(ψ) R_z(α) R_y(ε) R_x(φ)
    ω_ib = C_be k ω_ie τ̇ + R_x(−φ) (R_y(−ε) z α̇ + y ε̇) + x φ̇

Until a gravity turn α = 0, and the attitude has a closed form. In it, ε and α are those of v_a, and follow it without
an angle of attack (Ruppe, Introduction to Astronautics, 1966): gravity alone bends the path. Changes of elevation, spin
and τ, and the beginning of the gravity turn, follow S(x) of the other vehicles, so that the rate is continuous. There
is no lift; the angle of attack changes only the direction of thrust.

On the pad the rocket sways in the wind about its base: each of two tilts is a sum of tones, the response of a damped
oscillator to gusts, which ends before lift-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

import sinssim.earth
from sinssim import rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.errors import InputError
from sinssim.toml_section import Duration, Heading, Height, Latitude, Longitude, Moment, Section
from sinssim.truth.atmosphere import SPACE_M, density
from sinssim.truth.motion import NORMAL_EARTH, Mounting, PlacedMotion, TrueEarth
from sinssim.truth.motions.analytic import ClosedForm
from sinssim.truth.motions.surface_vehicles import rising, s_curve
from sinssim.truth.motions.vibration import Tone
from sinssim.truth.sampling import FlightEvent, block_state, integrate_samples, sample_edges
from sinssim.units import ARCMIN, DEG, G0

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory

LIFT_OFF, BURN_OUT = "lift-off", "burn-out of stage"
"""Beginnings of the texts of two events."""
_RELEASE_S, _SPIN_UP_S = 1.0, 10.0
_FOLLOW_S = 5.0
"""Time in which the axis turns into the velocity at the beginning of a gravity turn, s."""
_SWAYING = 73
"""Branch of the random numbers."""
_SWAY_DAMPING, _GUST_S, _CALM_S = 0.03, 5.0, 10.0
"""Damping ratio of the sway, correlation time of the gusts, and the time before lift-off in which it ends, s."""
_SWAY_TONES, _SWAY_BAND = 60, (0.05, 2.0)
"""Tones of each tilt, and their band in units of the natural frequency."""
_LONGEST_S = 3.0 * 3600.0
"""Time after which a rocket without a duration has to be back, s."""
_LIGHTEST = 10.0
"""Least payload per drag area, kg/m²: a lighter one is braked so fast that the integration takes too long."""
_STEP_S, _SPACE_STEP_S = 0.5, 20.0
_RELATIVE, _ABSOLUTE = 1e-13, 1e-10
"""Tolerances of the integration."""

_Mass = Annotated[float, Field(gt=0.0, le=1e7)]


class Stage(Section):
    """A stage: its engine burns with constant thrust, and its structure is dropped."""

    example: ClassVar[dict[str, Any]] = {
        "propellant_kg": 600.0, "structure_kg": 250.0, "thrust_kn": 110.0, "burn_s": 13.0,
    }  # fmt: skip

    propellant_kg: _Mass = Field(description="mass of the propellant")
    structure_kg: _Mass = Field(description="mass that is dropped with the stage")
    thrust_kn: Annotated[float, Field(gt=0.0, le=1e6)] = Field(description="thrust")
    burn_s: Annotated[float, Field(gt=0.0, le=3600.0)] = Field(description="time of burning")
    ignition_s: Moment = Field(default=0.0, description="time from lift-off, or from the previous separation")
    separation_s: Moment = Field(default=0.0, description="time from burn-out to separation")


Elevation = Annotated[float, Field(ge=-90.0, le=90.0)]


class Rocket(PlacedMotion):
    """A rocket: pad, stages with constant thrust along a program of elevation, free fall in space, and the way
    back to the height of the pad, without a parachute."""

    table: ClassVar[str] = "rocket"
    travels: ClassVar[bool] = True
    leaves_air: ClassVar[bool] = True

    latitude_deg: Latitude = Field(description="latitude of the pad")
    longitude_deg: Longitude = Field(default=0.0, description="longitude of the pad")
    altitude_m: Height = Field(default=0.0, description="height of the pad above the ellipsoid")
    heading_deg: Heading = Field(default=0.0, description="direction of the launch, clockwise from north")
    elevation_deg: Annotated[float, Field(ge=10.0, le=90.0)] = Field(
        default=88.0, description="elevation of the rocket on its pad"
    )
    pad_s: Moment = Field(default=60.0, description="time at rest on the pad before lift-off")
    payload_kg: _Mass = Field(description="mass above the stages")
    stages: tuple[Stage, ...] = Field(min_length=1, max_length=10, description="the stages, the lowest first")
    program: tuple[tuple[Moment, Elevation], ...] = Field(
        default=(),
        description="[time after lift-off, elevation] to which the elevation above the horizon of the pad changes "
        "smoothly from that before; s and degrees",
    )
    gravity_turn_s: Moment | None = Field(
        default=None,
        description=f"time after lift-off from which the axis turns, within {_FOLLOW_S:g} s, into the velocity in the "
        "air, and follows it: without an angle of attack, gravity bends the path",
    )
    sway_arcmin: Annotated[float, Field(ge=0.0, le=300.0)] = Field(
        default=0.0, description="rms of the tilt of the rocket on its pad in the wind, in each of two directions"
    )
    sway_hz: Annotated[float, Field(ge=0.05, le=10.0)] = Field(
        default=0.4, description="natural frequency of this sway"
    )
    sway_arm_m: Annotated[float, Field(ge=0.0, le=150.0)] = Field(
        default=10.0, description="height of the sensors above the base, about which it sways"
    )
    spin_deg_s: Annotated[float, Field(ge=-7200.0, le=7200.0)] = Field(
        default=0.0, description="rate about the body's axis, reached 10 s after lift-off"
    )
    diameter_m: Annotated[float, Field(gt=0.0, le=100.0)] = Field(default=0.5, description="diameter of the body")
    drag_coefficient: Annotated[float, Field(ge=0.0, le=10.0)] = Field(
        default=0.4, description="drag coefficient of its cross-section"
    )
    duration_s: Duration | None = Field(
        default=None, description="end of the run, if the rocket is not back before; required for an orbit"
    )

    rules = (
        (lambda s: s.stages[0].ignition_s and s.stages[0].ignition_s,
         "stages.1.ignition_s = {it:g}: the rocket lifts off with the ignition of its first stage: remove it, or give "
         "a longer pad_s"),
        (lambda s: s.stages[0].thrust_kn * 1e3 * np.sin(s.elevation_deg * DEG) <= s.mass_kg * G0 and s.mass_kg,
         "stages.1.thrust_kn = {s.stages[0].thrust_kn:g} does not lift {it:g} kg at an elevation of "
         "{s.elevation_deg:g}°; give more thrust or less mass"),
        (lambda s: next((time for (before, _), (time, _) in zip(((0.0, 0.0), *s.program), s.program, strict=False)
                         if time <= before), None) is not None,
         "program: its times must increase, from above 0; here they are {s.program_times}"),
        (lambda s: s.gravity_turn_s is not None and s.last[0] > s.gravity_turn_s,
         "program: the gravity turn follows it: its last time, {s.last[0]:g}, must not be after gravity_turn_s = "
         "{s.gravity_turn_s:g}"),
        (lambda s: s.gravity_turn_s is not None and s.gravity_turn_s < _SPIN_UP_S,
         "gravity_turn_s = {s.gravity_turn_s:g} must be at least 10: before, the velocity has no certain direction"),
        (lambda s: s.gravity_turn_s is not None and s.last[1] > 89.5,
         "gravity_turn_s = {s.gravity_turn_s:g} would begin at an elevation of {s.last[1]:g}, where gravity hardly "
         "bends the path: give a program that ends at 89.5 or less"),
        (lambda s: s.jolted,
         "gravity_turn_s = {s.gravity_turn_s:g}: {it:g} s after lift-off the thrust jumps, while the axis turns into "
         "the velocity; begin at least 5 s before, or after it"),
        (lambda s: not s.sway_arcmin and s.changed("sway_hz", "sway_arm_m"),
         "{it} has no effect without sway_arcmin: give the rms of the tilt"),
        (lambda s: s.sway_arcmin and s.pad_s < 2.0 * _CALM_S,
         "pad_s = {s.pad_s:g}: the sway ends in the last 10 s before lift-off; give 20 s or more"),
        (lambda s: s.payload_kg < _LIGHTEST * s.drag_area and s.drag_area,
         "payload_kg = {s.payload_kg:g} is too light for a drag area of {it:.3g} m², π/4 diameter_m² drag_coefficient: "
         "give 10 kg/m² or more"),
        (lambda s: s.duration_s is not None and s.duration_s <= s.pad_s,
         "duration_s = {s.duration_s:g} must exceed pad_s = {s.pad_s:g}: the run would end on the pad"),
        (lambda s: None not in (s.duration_s, s.gravity_turn_s) and s.pad_s + s.gravity_turn_s >= s.duration_s,
         "gravity_turn_s = {s.gravity_turn_s:g} is after the end of the run, {s.duration_s:g} s with {s.pad_s:g} s on "
         "the pad: begin the turn earlier"),
    )  # fmt: skip

    @property
    def mass_kg(self) -> float:
        """Mass at lift-off, kg."""
        return self.payload_kg + sum(stage.propellant_kg + stage.structure_kg for stage in self.stages)

    @property
    def drag_area(self) -> float:
        """C_D A, m²."""
        return 0.25 * np.pi * self.diameter_m**2 * self.drag_coefficient

    @property
    def last(self) -> tuple[float, float]:
        """Time after lift-off, s, and elevation, degrees, with which the program ends."""
        return self.program[-1] if self.program else (0.0, self.elevation_deg)

    @property
    def jolted(self) -> float | None:
        """The time from lift-off to the first jump of the thrust while a gravity turn begins, s; None if none jumps."""
        if self.gravity_turn_s is None:
            return None
        jumps = (t - self.pad_s for burn in _burns(self) for t in (burn.begin, burn.end))
        return next((t for t in jumps if self.gravity_turn_s < t < self.gravity_turn_s + _FOLLOW_S), None)

    @property
    def program_times(self) -> str:
        """The times of the program, for a message."""
        return ", ".join(f"{time:g}" for time, _ in self.program)

    @property
    def usual_speed(self) -> float:
        return 1000.0

    def duration(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        return flown(self, earth).end

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        angles = np.diff([self.elevation_deg, *(angle for _, angle in self.program)]) * DEG
        lasting = np.diff([0.0, *(time for time, _ in self.program)])
        return float(np.sum(1.5 * angles**2 / lasting)) + (self.spin_deg_s * DEG) ** 2 * self.duration(earth)

    @property
    def is_drawn(self) -> bool:
        return bool(self.sway_arcmin)

    def sway(self, seed: int) -> list[Tone]:
        """Return the tones of the tilts about right and down, and of what they displace the sensors."""
        edges = np.linspace(*_SWAY_BAND, _SWAY_TONES + 1)
        tones = []
        for number, (turn, shift, sign) in enumerate((("pitch", "down", -1.0), ("yaw", "right", 1.0))):
            sequence = np.random.SeedSequence(seed, spawn_key=(_SWAYING, number))
            generator = np.random.Generator(np.random.SFC64(sequence))
            ratio = edges[:-1] + np.diff(edges) * generator.random(_SWAY_TONES)
            moved = 1.0 / np.abs(1.0 - ratio**2 + 2j * _SWAY_DAMPING * ratio)
            size = moved / np.hypot(1.0, 2.0 * np.pi * ratio * self.sway_hz * _GUST_S)
            size *= np.sqrt(2.0 / np.sum(size**2)) * self.sway_arcmin * ARCMIN
            for f, a, phase in zip(
                ratio * self.sway_hz, size, 2.0 * np.pi * generator.random(_SWAY_TONES), strict=True
            ):
                tones.append(Tone(turn, float(a), float(f), float(phase)))
                tones.append(Tone(shift, float(sign * self.sway_arm_m * a), float(f), float(phase)))
        return tones

    def _on_pad(self, time: Array) -> Array:
        """Return the part of the sway that acts, with its two derivatives by time, (3, N)."""
        s, *bends = rising(time, self.pad_s - _CALM_S, _CALM_S)[1:4]
        return np.stack([1.0 - s, *(-bend for bend in bends)])

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        if not self.sway_arcmin:
            return block.of(flown(self, earth))
        from sinssim.truth.motions.mounted_block import Vibrating  # needs the compiler

        return Vibrating(flown(self, earth), self.sway(seed), block.lever_arm_m, block.q_bs, self._on_pad)


@lru_cache(maxsize=4)
def flown(rocket: Rocket, earth: TrueEarth) -> RocketFlight:
    """Return the flight of a rocket, which is integrated once."""
    return RocketFlight(rocket, earth)


@dataclass(frozen=True)
class _Burn:
    """A stage in the time of the run."""

    begin: float  # s
    end: float
    separation: float
    thrust: float  # N
    propellant: float  # kg
    structure: float


def _burns(rocket: Rocket) -> list[_Burn]:
    burns, time = [], rocket.pad_s
    for stage in rocket.stages:
        begin = time + stage.ignition_s
        end = begin + stage.burn_s
        time = end + stage.separation_s
        burns.append(_Burn(begin, end, time, stage.thrust_kn * 1e3, stage.propellant_kg, stage.structure_kg))
    return burns


class RocketFlight(ClosedForm):
    """The flight of a rocket; see the module's text."""

    def __init__(self, rocket: Rocket, earth: TrueEarth) -> None:
        super().__init__(rocket.pad_s + _LONGEST_S, earth.gravity, earth.figure)
        self._rocket, self._burns = rocket, _burns(rocket)
        self._lift_off, self._spin = rocket.pad_s, np.array([0.0, 0.0, earth.figure.omega])
        latitude, longitude, height = rocket.place
        self._pad = sinssim.earth.geodetic_to_ecef(latitude, longitude, height, earth.figure)
        heading = rotation.quaternion_from_euler(0.0, 0.0, rocket.heading_deg * DEG)
        self._q_pad = rotation.multiply(sinssim.earth.q_en(latitude, longitude), heading)
        self._origin = sinssim.earth.ecef_to_eci(self._pad, self._lift_off, earth.figure)
        self._area = rocket.drag_area
        # times, elevations and their changes of the parts of the program
        self._program = np.array([(0.0, rocket.elevation_deg), *rocket.program]) * [1.0, DEG]
        self._program[:, 0] += self._lift_off
        turn = rocket.gravity_turn_s
        self._follow = None if turn is None else self._lift_off + turn
        up = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])  # ahead, right and up of the pad
        self._basis = rotation.rotate(self._q_pad, up)
        self._released = sinssim.earth.ecef_to_eci(self._basis, self._lift_off + 0.5 * _RELEASE_S, earth.figure)
        self.fastest = 2.0 * abs(rocket.spin_deg_s) * DEG + 10.0
        self._air: list[float] = []  # instants at which it leaves or enters the air
        self._pieces: list[tuple[float, Any]] = []  # beginning and solution
        self._fly()
        self._begins = np.array([begin for begin, _ in self._pieces])
        self.breaks = np.unique([*self._corners(), *self._air])
        self.events = self._named_events()

    def _corners(self) -> list[float]:
        """Return the instants at which thrust, mass or a derivative of the attitude jump."""
        turns = [self._lift_off, self._lift_off + _RELEASE_S, self._lift_off + _SPIN_UP_S, *self._program[:, 0]]
        turns += [] if self._follow is None else [self._follow, self._follow + _FOLLOW_S]
        return sorted({*turns, *(t for burn in self._burns for t in (burn.begin, burn.end, burn.separation))})

    def _push(self, time: Array, within: Array | float) -> tuple[Array, Array]:
        """Return thrust, N, and mass, kg; the stages are those at the instants `within`."""
        thrust, mass = np.zeros_like(time), np.full_like(time, self._rocket.mass_kg)
        for burn in self._burns:
            thrust += burn.thrust * ((within >= burn.begin) & (within < burn.end))
            mass -= burn.propellant * np.clip((time - burn.begin) / (burn.end - burn.begin), 0.0, 1.0)
            mass -= burn.structure * (within >= burn.separation)
        return thrust, mass

    def _fly(self) -> None:
        """Integrate the flight; sets its pieces, its end and the instants at which it crosses the limit of the air."""
        from scipy.integrate import solve_ivp

        def height(t: float, y: Array) -> float:
            return float(sinssim.earth.ecef_to_geodetic(self._origin + y[:3], self.ellipsoid)[2])

        def edge(t: float, y: Array) -> float:
            return height(t, y) - SPACE_M

        def ground(t: float, y: Array) -> float:
            return height(t, y) - self._rocket.altitude_m

        edge.terminal = ground.terminal = True  # type: ignore[attr-defined]
        ground.direction = -1.0  # type: ignore[attr-defined]
        last = self.end if self._rocket.duration_s is None else self._rocket.duration_s
        corners = [t for t in self._corners() if self._lift_off < t < last] + [last]
        time, y = self._lift_off, np.concatenate([np.zeros(3), np.cross(self._spin, self._origin)])
        in_air = height(time, y) < SPACE_M
        while time < last:
            until = next(t for t in corners if t > time)
            middle, flying = 0.5 * (time + until), in_air
            edge.direction = 1.0 if in_air else -1.0  # type: ignore[attr-defined]

            def slope(t: float, y: Array, middle: float = middle, flying: bool = flying) -> Array:
                at = np.array([t])
                r, v = (self._origin + y[:3])[None], y[None, 3:]
                thrust, mass = self._push(at, middle)
                force = self._drag(r, v, mass) if flying else np.zeros((1, 3))
                if thrust[0] > 0.0:
                    force += self._axis(at, r, v) * (thrust / mass)
                gravitation = sinssim.earth.gravitation_ecef(r, self.gravity, self.ellipsoid)
                return np.concatenate([y[3:], (gravitation + force)[0]])

            step = _STEP_S if in_air or self._burns[-1].end > time else _SPACE_STEP_S
            piece = solve_ivp(
                slope,
                (time, until),
                y,
                "DOP853",
                dense_output=True,
                events=(edge, ground),
                max_step=step,
                rtol=_RELATIVE,
                atol=_ABSOLUTE,
            )
            self._pieces.append((time, piece.sol))
            time, y = float(piece.t[-1]), piece.y[:, -1]
            over, ground_hit = piece.t_events or ([], [])
            if len(ground_hit):
                self.end = time
                return
            if len(over):
                in_air = not in_air
                self._air.append(time)
        if self._rocket.duration_s is None:
            raise InputError(
                f"rocket: it is not back within {_LONGEST_S / 3600.0:g} h after lift-off; give duration_s for an "
                "orbit, or less propellant."
            )
        self.end = last

    def _axis(self, time: Array, r: Array, v: Array) -> Array:
        """Return the direction of the thrust in inertial axes, (N, 3), at positions and velocities there."""
        elevation, azimuth, _, turned, *_ = self._directed(time, r, v)
        level = np.cos(elevation)
        of_pad = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)
        return sinssim.earth.ecef_to_eci(of_pad @ self._basis, turned, self.ellipsoid)

    def _directed(self, time: Array, r: Array, v: Array, a: Array | None = None) -> tuple[Array, ...]:
        """Return elevation, azimuth, spin angle and the time τ with the Earth, and their rates, at positions,
        velocities and accelerations in inertial axes; without these, the rates of a gravity turn are zero."""
        elevation, roll, turned, elevating, rolling, kept = self._angles(time)
        azimuth, veering = np.zeros_like(elevation), np.zeros_like(elevation)
        if self._follow is None or not (time > self._follow).any():
            return elevation, azimuth, roll, turned, elevating, veering, rolling, kept
        s, _, slope = s_curve(np.clip((time - self._follow) / _FOLLOW_S, 0.0, 1.0))
        flow = (v - np.cross(self._spin, r)) @ self._released.T
        change = np.zeros_like(flow) if a is None else (a - np.cross(self._spin, v)) @ self._released.T
        level = np.maximum(np.hypot(flow[:, 0], flow[:, 1]), 1e-9)
        growth = (flow[:, 0] * change[:, 0] + flow[:, 1] * change[:, 1]) / level
        up, side = np.arctan2(flow[:, 2], level), np.arctan2(flow[:, 1], flow[:, 0])
        climbing = (change[:, 2] * level - flow[:, 2] * growth) / (level**2 + flow[:, 2] ** 2)
        turning = (flow[:, 0] * change[:, 1] - flow[:, 1] * change[:, 0]) / level**2
        elevating = elevating + s * (climbing - elevating) + slope / _FOLLOW_S * (up - elevation)
        veering = s * turning + slope / _FOLLOW_S * side
        return elevation + s * (up - elevation), s * side, roll, turned, elevating, veering, rolling, kept

    def _drag(self, r: Array, v: Array, mass: Array) -> Array:
        """Return the specific force of the air in inertial axes, (N, 3) m/s²."""
        height = sinssim.earth.ecef_to_geodetic(r, self.ellipsoid)[2]  # which no turn about the axis changes
        flow = v + self._spin[2] * r[:, [1, 0, 2]] * [1.0, -1.0, 0.0]  # v − ω × r
        size = 0.5 * self._area * density(height) * np.sqrt(np.einsum("ij,ij->i", flow, flow)) / mass
        return np.asarray(-size[:, None] * flow)

    def _motion(self, time: Array) -> tuple[Array, Array]:
        """Return position and velocity in inertial axes, each (N, 3), after lift-off."""
        y = np.empty((len(time), 6))
        piece = np.clip(np.searchsorted(self._begins, time, side="right") - 1, 0, None)
        for number in np.unique(piece):
            inside = piece == number
            y[inside] = self._pieces[number][1](time[inside]).T
        return self._origin + y[:, :3], y[:, 3:]

    def _angles(self, time: Array) -> tuple[Array, ...]:
        """Return elevation, spin angle, the time τ with the Earth, and their rates."""
        since = time - self._lift_off
        times, angles = self._program.T
        if len(times) > 1:
            k = np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 2)
            lasting = times[k + 1] - times[k]
            s, _, slope = s_curve(np.clip((time - times[k]) / lasting, 0.0, 1.0))
            change = angles[k + 1] - angles[k]
            elevation, elevating = angles[k] + change * s, change * slope / lasting
        else:
            elevation, elevating = np.full_like(time, angles[0]), np.zeros_like(time)
        s, integral, _ = s_curve(np.clip(since / _SPIN_UP_S, 0.0, 1.0))
        spin = self._rocket.spin_deg_s * DEG
        roll = spin * (_SPIN_UP_S * integral + np.maximum(since - _SPIN_UP_S, 0.0))
        left, gone, _ = s_curve(np.clip(since / _RELEASE_S, 0.0, 1.0))
        part = np.minimum(since, _RELEASE_S) - _RELEASE_S * gone
        return elevation, roll, self._lift_off + part, elevating, spin * s, 1.0 - left

    def _state(self, time: Array) -> NavState:
        flying = time > self._lift_off
        r, v = np.tile(self._pad, (len(time), 1)), np.zeros((len(time), 3))
        there, speed = r.copy(), v.copy()
        if flying.any():
            at = time[flying]
            there[flying], speed[flying] = self._motion(at)
            for of, by in ((r, there[flying]), (v, speed[flying] - np.cross(self._spin, there[flying]))):
                of[flying] = sinssim.earth.eci_to_ecef(by, at, self.ellipsoid)
        elevation, azimuth, roll, turned, *_ = self._directed(time, there, speed)
        half, none = 0.5 * self._spin[2] * (turned - time), np.zeros_like(time)
        back = np.stack([np.cos(half), none, none, np.sin(half)], axis=1)  # one on the pad
        q_pad = rotation.multiply(self._q_pad, rotation.quaternion_from_euler(roll, elevation, azimuth))
        return block_state(r, v, rotation.multiply(back, q_pad), self.ellipsoid)

    def _rates(self, time: Array) -> tuple[Array, Array]:
        flying = time > self._lift_off
        at = time[flying]
        r, v, drag = np.tile(self._pad, (len(time), 1)), np.zeros((len(time), 3)), np.zeros((len(time), 3))
        r[flying], v[flying] = self._motion(at)
        thrust, mass = self._push(at, at)
        crossed = np.searchsorted(self._air, at, side="right") % 2
        in_air = (crossed == 0) == (self._rocket.altitude_m < SPACE_M)
        aloft = np.flatnonzero(flying)[in_air]
        drag[aloft] = self._drag(r[aloft], v[aloft], mass[in_air])
        a = None
        if self._follow is not None:
            a = drag + sinssim.earth.gravitation_ecef(r, self.gravity, self.ellipsoid)
            a[flying] += self._axis(at, r[flying], v[flying]) * (thrust / mass)[:, None]

        elevation, azimuth, roll, turned, elevating, veering, rolling, kept = self._directed(time, r, v, a)
        none = np.zeros_like(time)
        q_bp = rotation.conjugate(rotation.quaternion_from_euler(roll, elevation, azimuth))
        earth = rotation.rotate(rotation.conjugate(self._q_pad), self._spin)
        omega = kept[:, None] * rotation.rotate(q_bp, earth)
        right, down = elevating * np.cos(roll), -elevating * np.sin(roll)
        level = veering * np.cos(elevation)
        omega[:, 0] += rolling - veering * np.sin(elevation)
        omega[:, 1] += right + level * np.sin(roll)
        omega[:, 2] += down + level * np.cos(roll)

        force = np.zeros((len(time), 3))
        if len(aloft):
            half = 0.5 * self._spin[2] * turned[aloft]
            q_ei = np.stack([np.cos(half), none[aloft], none[aloft], -np.sin(half)], axis=1)
            of_pad = rotation.rotate(rotation.multiply(rotation.conjugate(self._q_pad), q_ei), drag[aloft])
            force[aloft] = rotation.rotate(q_bp[aloft], of_pad)
        force[flying, 0] += thrust / mass
        if not flying.all():
            up = np.cross(self._spin, np.cross(self._spin, self._pad))
            up -= sinssim.earth.gravitation_ecef(self._pad, self.gravity, self.ellipsoid)
            force[~flying] = rotation.rotate(q_bp[~flying], rotation.rotate(rotation.conjugate(self._q_pad), up))
        return omega, force

    def increments(self, rate_hz: float) -> ImuData:
        """Return increments by quadrature of the given rates and forces; see `Trajectory.increments`."""
        edges = sample_edges(self.start, self.end, rate_hz)
        whole = integrate_samples(lambda t: np.concatenate(self._rates(t), axis=1), edges, self.fastest, self.breaks)
        return ImuData(edges, whole[:, :3], whole[:, 3:])

    def _named_events(self) -> tuple[FlightEvent, ...]:
        """Return what happens in the flight, in order of time."""
        events = [(self._lift_off, LIFT_OFF)]
        events += [] if self._follow is None else [(self._follow, "the gravity turn begins")]
        for number, burn in enumerate(self._burns, start=1):
            if number > 1:
                events.append((burn.begin, f"ignition of stage {number}"))
            events.append((burn.end, f"{BURN_OUT} {number}"))
            events.append((burn.separation, f"separation of stage {number}"))
        aloft = self._rocket.altitude_m < SPACE_M
        for number, crossing in enumerate(self._air):
            leaves = (number % 2 == 0) == aloft
            events.append((crossing, f"{'leaves' if leaves else 'enters'} the air at 100 km"))
        time = np.linspace(self._lift_off, self.end, 20_001)
        height = self._state(time).height
        top = int(np.argmax(height))
        if top < len(time) - 1:
            events.append((float(time[top]), f"highest point, {height[top] / 1e3:.1f} km"))
        if self._rocket.duration_s is None or self.end < self._rocket.duration_s:
            events.append((self.end, "back at the height of the pad"))
        return tuple(FlightEvent(t, text) for t, text in sorted(events) if t <= self.end)
