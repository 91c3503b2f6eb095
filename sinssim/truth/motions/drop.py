"""A bomb or missile that a carrier releases, [drop]: the carrier's motion until then, and the fall to the ground.

The fall begins with place, velocity, attitude and rate of the sensor block, which is in the centre of mass from then
on. Integrated in inertial axes, which are Earth-fixed at time 0, with the velocity v_a = v − ω_ie × r in the still air:

    r̈ = γ(r) − ½ (C_D A/m) ρ |v_a| v_a + (T/m) x_b
    ω̇ = Ω² x_b × v_a/|v_a| − 2ζΩ ω,   Ω = 2πf √(ρ/ρ₀) |v_a| / (100 m/s)

Its fins turn it into the flow as a damped oscillator, whose frequency f is given at 100 m/s at sea level: their moment
is proportional to the dynamic pressure. There is no lift: the angle of attack changes only the direction of the
thrust T of a motor and the axes of the sensors. The gyroscopic moment of a rolling body is neglected.

Rate and specific force are given functions of the solution; the increments are their quadrature.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.errors import InputError
from sinssim.toml_section import Height, Moment, Section
from sinssim.truth.atmosphere import density
from sinssim.truth.sampling import BlockMotion, Channel, FlightEvent, block_state, integrate_samples, sample_edges
from sinssim.truth.trajectory import Trajectory
from sinssim.units import G0

RELEASED = "released from the carrier"
"""Text of an event."""

_FLOW = 0.5 * float(density(0.0)) * 100.0**2
"""Dynamic pressure for which the frequency of the fins is given, Pa."""
_LONGEST_S, _STEP_S = 1800.0, 0.5
_TOLERANCE = np.array([1e-9] * 3 + [1e-10] * 3 + [1e-12] * 7)
"""Absolute tolerances of place, velocity, quaternion and rate in a step; the relative one is 1e-13."""

_Mass = Annotated[float, Field(gt=0.0, le=1e5)]


class Motor(Section):
    """The motor of a missile, with constant thrust along its axis."""

    example: ClassVar[dict[str, Any]] = {"propellant_kg": 40.0, "thrust_kn": 12.0, "burn_s": 8.0}

    propellant_kg: _Mass = Field(description="mass of the propellant, a part of mass_kg")
    thrust_kn: Annotated[float, Field(gt=0.0, le=1e4)] = Field(description="thrust")
    burn_s: Annotated[float, Field(gt=0.0, le=600.0)] = Field(description="time of burning")
    ignition_s: Moment = Field(default=1.0, description="time from the release to the ignition")


class Drop(Section):
    """A bomb or missile, with the sensors, that the vehicle of the motion carries and releases. It falls through still
    air of the U.S. Standard Atmosphere 1976, turns into the flow by its fins, and the run ends with its impact."""

    release_s: Annotated[float, Field(gt=0.0, le=1e6)] = Field(description="time of the release")
    ground_m: Height = Field(default=0.0, description="height of the ground at the impact above the ellipsoid")
    mass_kg: _Mass = Field(default=227.0, description="mass; the default values are about those of a Mk 82")
    diameter_m: Annotated[float, Field(gt=0.0, le=10.0)] = Field(default=0.273, description="diameter of the body")
    drag_coefficient: Annotated[float, Field(ge=0.0, le=10.0)] = Field(
        default=0.15, description="drag coefficient of its cross-section"
    )
    fins_hz: Annotated[float, Field(ge=0.05, le=10.0)] = Field(
        default=0.6, description="natural frequency with which its fins turn it into the flow, at 100 m/s at sea level"
    )
    fins_damping: Annotated[float, Field(ge=0.0, le=2.0)] = Field(default=0.2, description="damping ratio of that")
    motor: Motor | None = None

    rules = (
        (lambda s: s.mass_kg < 10.0 * s.drag_area and s.drag_area,
         "mass_kg = {s.mass_kg:g} is too light for a drag area of {it:.3g} m², π/4 diameter_m² drag_coefficient: give "
         "10 kg/m² or more"),
        (lambda s: s.motor and s.motor.propellant_kg >= s.mass_kg,
         "motor.propellant_kg = {s.motor.propellant_kg:g} is a part of mass_kg = {s.mass_kg:g} and must be less"),
    )  # fmt: skip

    @property
    def drag_area(self) -> float:
        """C_D A, m²."""
        return 0.25 * np.pi * self.diameter_m**2 * self.drag_coefficient

    def about(self, carried: float, height: float) -> float:
        """Estimate the time of the impact, s, of a carrier that flies for a time, s, at a height, m: a free fall."""
        return min(carried, self.release_s) + float(np.sqrt(2.0 * max(height - self.ground_m, 1.0) / G0))


def carried_until(trajectory: Trajectory) -> float:
    """Return the time until which the sensor block of a motion is on its vehicle, s; infinite if nothing is dropped."""
    return next((event.time for event in trajectory.events if event.text == RELEASED), np.inf)


class Released(BlockMotion):
    """The motion of a sensor block that is released; see the module's text.

    Args:
        carrier: the motion of the block on its carrier.
        keys: what is dropped.
        q_bs: mounting of the block in carrier and bomb, v_b = C_bs v_s, (4,).

    Raises:
        InputError: the carrier's motion ends before the release, it releases below the ground, or nothing falls down.
    """

    def __init__(self, carrier: Trajectory, keys: Drop, q_bs: Array) -> None:
        release = keys.release_s
        if not carrier.start < release <= carrier.end:
            raise InputError(
                f"drop.release_s = {release:g} is after the motion of the carrier, which ends after {carrier.end:.6g} "
                "s; release earlier, or let it move longer."
            )
        height = float(carrier.state(release).height)
        if height <= keys.ground_m:
            raise InputError(
                f"drop.ground_m = {keys.ground_m:g}: at the release the carrier is at {height:.6g} m, below the ground."
            )
        self._carrier, self._keys, self._q_bs = carrier, keys, q_bs
        self.start, self.gravity, self.ellipsoid = carrier.start, carrier.gravity, carrier.ellipsoid
        self._spin = np.array([0.0, 0.0, self.ellipsoid.omega])
        self._fly()
        burn = [] if keys.motor is None else [release + keys.motor.ignition_s]
        burn += [] if keys.motor is None else [burn[0] + keys.motor.burn_s]
        self.breaks = np.unique([*(b for b in getattr(carrier, "breaks", ()) if b < release), release, *burn])
        _, _, _, omega, force = self._fall(np.linspace(release, self.end, 2000))
        swing = 2.0 * np.pi * keys.fins_hz * np.sqrt(max(force[:, 3].max(), 1e-9) / _FLOW)
        self._fastest = 4.0 * float(swing) + 2.0 * float(np.linalg.norm(omega, axis=1).max()) + 5.0
        self.fastest = max(self._fastest, float(getattr(carrier, "fastest", 0.0)))
        self.events = (*self._carried_events(), *self._own_events())
        self.channels = {
            name: Channel(channel.time[kept], channel.values[kept], channel.unit)
            for name, channel in carrier.channels.items()
            for kept in [channel.time <= release]
        }

    def _carried_events(self) -> list[FlightEvent]:
        """Return the events of the carrier until the release, which ends its leg."""
        release = self._keys.release_s
        events = [event for event in self._carrier.events if event.time < release - 1e-9]
        texts = [event.text for event in events]
        ends = (text.removesuffix("begins") + "ends" for text in texts if text[:4] == "leg " and text[-7:] == " begins")
        return events + [FlightEvent(release, text) for text in ends if text not in texts]

    def _own_events(self) -> list[FlightEvent]:
        release, motor = self._keys.release_s, self._keys.motor
        events = [FlightEvent(release, RELEASED)]
        if motor is not None:
            events.append(FlightEvent(release + motor.ignition_s, "ignition of the motor"))
            events.append(FlightEvent(release + motor.ignition_s + motor.burn_s, "burn-out of the motor"))
        down = float(self.state(self.end).velocity_ned[2])
        speed = float(np.linalg.norm(self.state(self.end).velocity_ned))
        angle = np.degrees(np.arcsin(down / speed))
        events.append(FlightEvent(self.end, f"impact with {speed:.0f} m/s, {angle:.0f}° below the horizon"))
        return [event for event in events if event.time <= self.end]

    def _push(self, time: Array, within: Array | float) -> tuple[Array, Array]:
        """Return thrust, N, and mass, kg, at instants, (N,) s; whether the motor burns is that at `within`."""
        mass, motor = np.full(len(time), self._keys.mass_kg), self._keys.motor
        if motor is None:
            return np.zeros(len(time)), mass
        since = time - self._keys.release_s - motor.ignition_s
        burns = since + within - time
        thrust = np.where((burns >= 0.0) & (burns < motor.burn_s), 1e3 * motor.thrust_kn, 0.0)
        return thrust, mass - motor.propellant_kg * np.clip(since / motor.burn_s, 0.0, 1.0)

    def _forces(self, time: Array, y: Array, within: Array | float) -> tuple[Array, Array, Array]:
        """Return position in inertial axes and specific force in the bomb's, (N, 3), and, side by side, the direction
        of the flow in its axes and the dynamic pressure, (N, 4); of solutions, (N, 13)."""
        r, v, q = self._origin + y[:, :3], y[:, 3:6], rotation.normalize(y[:, 6:10])
        height = earth.ecef_to_geodetic(r, self.ellipsoid)[2]  # which no turn about the axis changes
        flow = rotation.rotate(rotation.conjugate(q), v + self._spin[2] * r[:, [1, 0, 2]] * [1.0, -1.0, 0.0])
        speed = np.sqrt(np.einsum("ij,ij->i", flow, flow))
        pressure = 0.5 * density(height) * speed**2
        towards = flow / np.maximum(speed, 1e-9)[:, None]
        thrust, mass = self._push(time, within)
        force = -(self._keys.drag_area * pressure / mass)[:, None] * towards
        force[:, 0] += thrust / mass
        return r, force, np.column_stack([towards, pressure])

    def _fly(self) -> None:
        """Integrate the fall; sets the end, and the solution by pieces."""
        from scipy.integrate import solve_ivp

        keys, release = self._keys, self._keys.release_s
        at = self._carrier.state(np.array([release]))
        q_ei = rotation.quaternion_from_rotation_vector(self._spin * release)  # of inertial axes, seen as a turn
        q_en = earth.q_en(at.latitude, at.longitude)
        r = earth.geodetic_to_ecef(at.latitude, at.longitude, at.height, self.ellipsoid)
        r = rotation.rotate(q_ei, r)
        v = rotation.rotate(rotation.multiply(q_ei, q_en), at.velocity_ned) + np.cross(self._spin, r)
        q_ns = rotation.multiply(at.q_nb, rotation.conjugate(self._q_bs))
        q = rotation.multiply(rotation.multiply(q_ei, q_en), q_ns)
        omega = rotation.rotate(self._q_bs, self._carrier.rates(np.array([release]))[0])
        self._origin = r[0]

        def slope(t: float, y: Array, middle: float) -> Array:
            row = y[None]
            place, force, flow = self._forces(np.array([t]), row, middle)
            q, omega = y[6:10], y[10:]
            gravitation = earth.gravitation_ecef(place, self.gravity, self.ellipsoid)
            pull = gravitation[0] + rotation.rotate(rotation.normalize(q), force[0])
            swing = 2.0 * np.pi * keys.fins_hz * np.sqrt(flow[0, 3] / _FLOW)
            turning = swing**2 * np.array([0.0, -flow[0, 2], flow[0, 1]]) - 2.0 * keys.fins_damping * swing * omega
            spin = 0.5 * rotation.multiply(q, np.concatenate([[0.0], omega]))
            return np.concatenate([y[3:6], pull, spin, turning])

        def ground(t: float, y: Array) -> float:
            return float(earth.ecef_to_geodetic(self._origin + y[:3], self.ellipsoid)[2]) - keys.ground_m

        ground.terminal, ground.direction = True, -1.0  # type: ignore[attr-defined]
        first = [] if keys.motor is None else [release + keys.motor.ignition_s]
        corners = [*first, *(t + keys.motor.burn_s for t in first if keys.motor), release + _LONGEST_S]
        time, y = release, np.concatenate([np.zeros(3), v[0], q[0], omega[0]])
        self._pieces: list[tuple[float, Any]] = []
        for until in corners:
            piece = solve_ivp(
                partial(slope, middle=0.5 * (time + until)), (time, until), y, "DOP853", dense_output=True,
                events=ground, max_step=_STEP_S, rtol=1e-13, atol=_TOLERANCE,
            )  # fmt: skip
            self._pieces.append((time, piece.sol))
            time, y = float(piece.t[-1]), piece.y[:, -1]
            if piece.status == 1:
                self.end = time
                return
        raise InputError(f"drop: nothing has come down {_LONGEST_S / 60.0:g} min after the release; give less thrust.")

    def _fall(self, time: Array) -> tuple[Array, ...]:
        """Return position and velocity in inertial axes, q_ib and ω_ib of the bomb, and, side by side, its specific
        force and the dynamic pressure, (N, 4), after the release."""
        begins = [begin for begin, _ in self._pieces]
        piece = np.clip(np.searchsorted(begins, time, side="right") - 1, 0, None)
        y = np.empty((len(time), 13))
        for number in np.unique(piece):
            y[piece == number] = self._pieces[number][1](time[piece == number]).T
        r, force, flow = self._forces(time, y, time)
        return r, y[:, 3:6], rotation.normalize(y[:, 6:10]), y[:, 10:], np.column_stack([force, flow[:, 3]])

    def _state(self, time: Array) -> NavState:
        carried = time <= self._keys.release_s
        if carried.all():
            return self._carrier.state(time)
        r, v, q_ib, *_ = self._fall(time[~carried])
        at = time[~carried]
        half, none = -0.5 * self._spin[2] * at, np.zeros_like(at)
        q_eb = rotation.multiply(np.stack([np.cos(half), none, none, np.sin(half)], axis=1), q_ib)
        place, velocity = (earth.eci_to_ecef(of, at, self.ellipsoid) for of in (r, v - np.cross(self._spin, r)))
        fallen = block_state(place, velocity, rotation.multiply(q_eb, self._q_bs), self.ellipsoid)
        before = self._carrier.state(time[carried])
        state = NavState(*(np.empty((len(time), *values.shape[1:])) for values in vars(fallen).values()))
        for name, values in vars(state).items():
            values[carried], values[~carried] = getattr(before, name), getattr(fallen, name)
        return state

    def _rates(self, time: Array) -> tuple[Array, Array]:
        omega, force = np.empty((len(time), 3)), np.empty((len(time), 3))
        carried = time <= self._keys.release_s
        if carried.any():
            omega[carried], force[carried] = self._carrier.rates(time[carried])
        if not carried.all():
            omega[~carried], force[~carried] = self._falling(time[~carried]).reshape(-1, 2, 3).swapaxes(0, 1)
        return omega, force

    def _falling(self, time: Array) -> Array:
        """Return rate and specific force in the block's axes after the release, side by side, (N, 6)."""
        *_, omega, force = self._fall(time)
        q_sb = rotation.conjugate(self._q_bs)
        return np.column_stack([rotation.rotate(q_sb, omega), rotation.rotate(q_sb, force[:, :3])])

    def increments(self, rate_hz: float) -> ImuData:
        """Return the increments of the carrier, and those of the fall by quadrature; see `Trajectory.increments`."""
        release = self._keys.release_s
        edges = sample_edges(self.start, self.end, rate_hz)
        whole = min(int((release - self.start) * rate_hz + 1e-9), len(edges) - 1)
        parts = []
        if whole:
            carried = self._carrier.increments(rate_hz)
            parts.append(np.column_stack([carried.dtheta[:whole], carried.dvel[:whole]]))
        if whole < len(edges) - 1:
            after = np.concatenate([[max(release, edges[whole])], edges[whole + 1 :]])
            parts.append(integrate_samples(self._falling, after, self._fastest, self.breaks))
            if after[0] > edges[whole]:  # the rest of the carried motion is in the first of these samples
                fastest = max(float(getattr(self._carrier, "fastest", 0.0)), 1000.0)
                parts[-1][:1] += integrate_samples(
                    lambda t: np.column_stack(self._carrier.rates(t)), np.array([edges[whole], release]), fastest
                )
        both = np.concatenate(parts)
        return ImuData(edges, both[:, :3], both[:, 3:])
