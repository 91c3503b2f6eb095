"""Makes the true trajectory of a scenario, with the sensor block at its place and mounting."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sinssim.earth.models import ELLIPSOIDS, Ellipsoid
from sinssim.errors import InputError
from sinssim.units import ARCSEC, DEG, G0

if TYPE_CHECKING:
    from sinssim.data import Array
    from sinssim.scenario.schema import Scenario
    from sinssim.scenario.sections.motion import MotionSection, VibrationSection
    from sinssim.scenario.sections.truth import GreatCircleSection, ParkedSection
    from sinssim.section import Vector3
    from sinssim.truth.curve import Curve
    from sinssim.truth.flight.air import Air
    from sinssim.truth.motions.analytic import AnalyticMotion
    from sinssim.truth.motions.vibration import Tone
    from sinssim.truth.trajectory import Trajectory
    from sinssim.truth.turntable.section import TurntableSection

_NOWHERE = (0.0, 0.0, 0.0)


def fly(
    scenario: Scenario,
    progress: Callable[[float], None] | None = None,
    meanwhile: Callable[[], None] | None = None,
) -> Trajectory:
    """Return the true motion of a scenario's sensor block.

    Args:
        scenario: the scenario, with its source of truth: [flight], [parked], [great_circle], [motion],
            [track], [drive], [voyage] or [turntable].
        progress: called with the fraction of a flight flown, 0…1.
        meanwhile: called once while another process flies; not called if there is nothing to fly.

    Returns:
        The motion of the block with its lever arm and mounting, from [imu], the aircraft or zero, in this order, and
        with the vibration that its shock mounts transmit.

    Raises:
        InputError: the scenario is a one-component run, there is no such aircraft, the source of truth is invalid, or
            the flight cannot be flown; the message names the leg.
        RunError: JSBSim failed.

    Warns:
        SinssimWarning: a leg is beyond the limits of the aircraft.
    """
    if scenario.flight is not None:
        from sinssim.scenario.planned.warning import warn_of_limits

        warn_of_limits(scenario)
    return true_motion(scenario, progress, meanwhile)


def true_motion(
    scenario: Scenario,
    progress: Callable[[float], None] | None = None,
    meanwhile: Callable[[], None] | None = None,
) -> Trajectory:
    """Return what `fly` returns, without its warnings: for one of many runs of a plan.

    Args:
        scenario: as for `fly`.
        progress: as for `fly`.
        meanwhile: as for `fly`.

    Returns:
        As for `fly`.

    Raises:
        InputError: as for `fly`.
        RunError: as for `fly`.
    """
    if scenario.one_component is not None:
        raise InputError(
            f"the scenario {scenario.name} has [one_component], a motion in a vertical plane without a position on "
            f"the Earth: only `sinssim run` supports it. Give a scenario with [flight], [parked], "
            "[great_circle], [motion], [track] or [turntable]."
        )
    if scenario.log is not None:
        raise InputError(
            f"the scenario {scenario.name} has recorded sensors ([log]) and no true motion: `sinssim run` runs it. "
            "Give a scenario with [flight], [parked], [great_circle] or [motion]."
        )
    trajectory = _vibrating(scenario, _source(scenario, progress, meanwhile))
    if scenario.gravity is None:
        return trajectory
    from sinssim.truth.gravity.from_scenario import in_true_gravity

    return in_true_gravity(scenario, trajectory)


def _vibrating(scenario: Scenario, trajectory: Trajectory) -> Trajectory:
    """Return a motion with the vibration that a scenario adds."""
    if not scenario.vibration:
        return trajectory
    from sinssim.truth.motions.vibration import Vibrating

    tones = _tones(scenario.vibration, scenario.seed)
    if scenario.isolator is not None:
        from sinssim.truth.motions.isolator import Mount, isolated

        mounts = scenario.isolator
        tones = isolated(
            tones,
            Mount(mounts.linear_hz, mounts.linear_damping),
            Mount(mounts.angular_hz, mounts.angular_damping),
        )
    return Vibrating(trajectory, tones)


def block_mounting(scenario: Scenario) -> Array:
    """Return the mounting of a scenario's sensor block in its vehicle.

    Args:
        scenario: the scenario, with its source of truth.

    Returns:
        q_bs, v_b = C_bs v_s, (4,).

    Raises:
        InputError: there is no such aircraft.
    """
    if scenario.imu.mounting_deg is None and scenario.flight is not None:
        from sinssim.truth.flight.aircraft import load_aircraft

        return _quaternion(load_aircraft(scenario.flight.aircraft).mounting.angles_deg)
    return _quaternion(scenario.imu.mounting_deg or _NOWHERE)


def _source(
    scenario: Scenario, progress: Callable[[float], None] | None, meanwhile: Callable[[], None] | None
) -> Trajectory:
    imu = scenario.imu
    ellipsoid, gravity = ELLIPSOIDS[scenario.truth.ellipsoid], scenario.truth.gravity
    if scenario.flight is not None:
        from sinssim.truth.curve import Curve
        from sinssim.truth.flight.aircraft import load_aircraft
        from sinssim.truth.flight.cache import cached_flight

        log = cached_flight(scenario.flight, scenario.seed, progress, meanwhile)
        own = load_aircraft(scenario.flight.aircraft).mounting
        curve = Curve(
            log.time,
            log.position_ecef,
            log.q_eb,
            own.lever_arm_m if imu.lever_arm_m is None else imu.lever_arm_m,
            _quaternion(own.angles_deg if imu.mounting_deg is None else imu.mounting_deg),
            gravity,
            ellipsoid,
            log.events,
            log.channels,
            log.derivatives,
        )
        return curve if scenario.flight.atmosphere is None else _in_air(curve, scenario.flight.air())

    lever_arm, q_bs = imu.lever_arm_m or _NOWHERE, _quaternion(imu.mounting_deg or _NOWHERE)
    if scenario.parked is not None:
        from sinssim.truth.motions.parked import Parked

        parked = scenario.parked
        return Parked(*_place(parked), _attitude(parked), parked.duration_s, lever_arm, q_bs, gravity, ellipsoid)

    if scenario.track is not None:
        from sinssim.truth.track.curve import track_curve
        from sinssim.truth.track.prepare import prepared

        track = prepared(scenario.track, gravity, scenario.truth.ellipsoid)
        return track_curve(track.knots, track.fit, lever_arm, q_bs, gravity, ellipsoid, track.events, track.channels)

    vehicle = scenario.drive or scenario.voyage
    if vehicle is not None:
        from sinssim.truth.vehicles.motion import vehicle_curve

        return vehicle_curve(vehicle, scenario.seed, lever_arm, q_bs, gravity, ellipsoid)

    if scenario.motion is not None:
        from sinssim.truth.motions.analytic import OnEarth
        from sinssim.truth.motions.vibration import Vibrating

        motion = scenario.motion
        place, q_nm = _place(motion), _attitude(motion)
        centre = OnEarth(_analytic(motion), *place, q_nm, motion.duration_s, gravity, ellipsoid)
        return Vibrating(centre, (), lever_arm, q_bs) if imu.lever_arm_m or imu.mounting_deg else centre

    if scenario.turntable is not None:
        return _on_table(scenario.turntable, scenario.seed, lever_arm, q_bs, gravity, ellipsoid)

    from sinssim.truth.motions.great_circle import GreatCircle

    circle = scenario.great_circle
    assert circle is not None  # the scenario has exactly one source of truth
    return GreatCircle(
        *_place(circle),
        np.radians(circle.course_deg),
        circle.speed_mps,
        circle.duration_s,
        lever_arm,
        q_bs,
        gravity,
        ellipsoid,
    )


def _in_air(curve: Curve, air: Air) -> Curve:
    """Return the motion of a flight with what the air's pressure and temperature are along it, for a barometer."""
    from sinssim.truth.trajectory import Channel

    time = curve.channels["airspeed_mps"].time
    heights = curve.state(np.clip(time, curve.start, curve.end)).height.tolist()
    channels = dict(curve.channels)
    for name, value, unit in (
        ("pressure_altitude_m", air.pressure_altitude, "m"),
        ("static_temperature_k", air.temperature, "K"),
        ("static_pressure_pa", air.pressure, "Pa"),
    ):
        channels[name] = Channel(time, np.array([value(height) for height in heights]), unit)
    curve.channels = channels
    return curve


def _on_table(
    table: TurntableSection, seed: int, lever_arm: Vector3, q_bs: Array, gravity: str, ellipsoid: Ellipsoid
) -> Trajectory:
    """Return the motion on a turntable, whose errors are drawn from the scenario's seed."""
    from sinssim.truth.motions.analytic import OnEarth
    from sinssim.truth.motions.vibration import Vibrating
    from sinssim.truth.turntable.table import draw_table_errors, table_motion

    q_first, motion = table_motion(table, draw_table_errors(table, seed))
    centre = OnEarth(motion, *_place(table), q_first, motion.duration, gravity, ellipsoid)
    bare = lever_arm == _NOWHERE and q_bs[0] == 1.0
    return centre if bare else Vibrating(centre, (), lever_arm, q_bs)


def _place(
    section: ParkedSection | MotionSection | GreatCircleSection | TurntableSection,
) -> tuple[float, float, float]:
    """Return latitude and longitude, rad, and height, m."""
    return np.radians(section.latitude_deg), np.radians(section.longitude_deg), section.altitude_m


def _attitude(section: ParkedSection | MotionSection) -> Array:
    """Return q_nb of roll, pitch and heading."""
    return _quaternion((section.roll_deg, section.pitch_deg, section.heading_deg))


def _analytic(section: MotionSection) -> AnalyticMotion:
    """Return the motion in closed form of a [motion] table."""
    from sinssim.scenario.sections import motion as sections
    from sinssim.truth.motions.coning import SpinCone, classical_cone
    from sinssim.truth.motions.rocking import Sculling, SpinRock
    from sinssim.truth.motions.rotation_table import Dwell, RotationTable, Turn

    turn = 2.0 * np.pi
    match section:
        case sections.ConingMotion():
            return classical_cone(section.half_angle_deg * DEG, section.frequency_hz * turn)
        case sections.ScullingMotion():
            return Sculling(section.angle_deg * DEG, section.displacement_mm * 1e-3, section.frequency_hz * turn)
        case sections.SpinConeMotion():
            return SpinCone(section.angle_deg * DEG, section.precession_deg_s * DEG, section.spin_deg_s * DEG)
        case sections.SpinRockMotion():
            return SpinRock(
                section.axis, section.spin_deg_s * DEG, section.angle_deg * DEG, section.frequency_hz * turn
            )
        case sections.RotationTableMotion():
            return RotationTable(
                [
                    Dwell(step.duration_s)
                    if isinstance(step, sections.DwellStep)
                    else Turn(step.axis, step.angle_deg * DEG, step.rate_deg_s * DEG, step.ramp_s, step.profile)
                    for step in section.steps
                ]
            )


def _tones(sections: tuple[VibrationSection, ...], seed: int) -> list[Tone]:
    """Return the sinusoids of a scenario's vibration; each table of noise has its own random numbers."""
    from sinssim.truth.motions.vibration import Tone, band_noise

    tones: list[Tone] = []
    for number, section in enumerate(sections):
        of_acceleration = section.rms_g is not None
        rms = (section.rms_arcsec or 0.0) * ARCSEC + (section.rms_mm or 0.0) * 1e-3 + (section.rms_g or 0.0) * G0
        if section.high_hz is None:
            omega = 2.0 * np.pi * section.low_hz
            amplitude = 2.0**0.5 * rms / (-(omega**2) if of_acceleration else 1.0)
            tones.append(Tone(section.coordinate, amplitude, section.low_hz, section.phase_deg * DEG))
        else:
            tones += band_noise(
                section.coordinate,
                rms,
                section.low_hz,
                section.high_hz,
                seed + number,
                of_acceleration=of_acceleration,
            )
    return tones


def _quaternion(angles_deg: Vector3) -> Array:
    """Return the quaternion of roll, pitch and heading or yaw."""
    from sinssim.rotation.arrays import quaternion_from_euler

    return quaternion_from_euler(*np.radians(angles_deg))
