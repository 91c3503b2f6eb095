"""The true motion of a scenario, with the sensor block at its place and mounting."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from sinssim.arguments import check_kind
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.scenario.planned_limits import warn_of_limits
from sinssim.scenario.schema import Scenario
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.flight.flight_log import FlightLog
from sinssim.truth.flight.guidance import TRUTH, SolutionErrors
from sinssim.truth.motion import Motion, Mounting
from sinssim.truth.motions.imu_rotation import TurningBlock
from sinssim.truth.motions.vibration import Tone
from sinssim.truth.trajectory import Trajectory

if TYPE_CHECKING:
    from sinssim.earth.gravity_disturbance import DisturbingField


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
        The motion of the block with its lever arm and mounting, from [imu], the aircraft or zero, in this order, with
        its fall from a carrier, and with the vibration that its shock mounts transmit.

    Raises:
        InputError: the scenario is a one-component run, there is no such aircraft, the source of truth is invalid, or
            the flight cannot be flown; the message names the leg.
        RunError: JSBSim failed.

    Warns:
        SinssimWarning: a leg is beyond the limits of the aircraft.
    """
    warn_of_limits(scenario)
    return true_motion(scenario, progress, meanwhile)


def true_motion(
    scenario: Scenario,
    progress: Callable[[float], None] | None = None,
    meanwhile: Callable[[], None] | None = None,
    errors: SolutionErrors | FlightLog | Literal["none"] | None = None,
) -> Trajectory:
    """Return what `fly` returns, without its warnings, for one of many runs of a plan. The flight is guided with the
    `errors` of a navigator, or those of a flight that was flown with them; for "none" by the true motion, whatever the
    scenario says; for None too, but a scenario that says otherwise is refused."""
    flight = scenario.flight
    if errors is None and flight is not None and flight.guidance.source != TRUTH:
        raise InputError(
            f'flight.guidance.source = "{flight.guidance.source}": the flight follows its navigator, which '
            f'`sinssim run`, `ensemble` and `budget` fly. Set flight.guidance.source = "{TRUTH}" for this.'
        )
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
    source = scenario.source
    assert isinstance(source, Motion)  # neither of those
    how = (mounting(scenario), scenario.truth, scenario.seed, progress, meanwhile)
    seen = None if isinstance(errors, str) else errors
    motion = source.trajectory(*how) if seen is None or flight is None else flight.trajectory(*how, seen)
    if scenario.drop is not None:
        from sinssim.truth.motions.drop import Released

        motion = Released(motion, scenario.drop, mounting(scenario).q_bs)
    shaking = source.shaking(scenario.seed)
    if scenario.vibration or shaking is not None:
        from sinssim.truth.motions.mounted_block import Vibrating  # needs the compiler

        def through_mounts(tones: Sequence[Tone]) -> Sequence[Tone]:
            return tones if scenario.isolator is None else scenario.isolator.transmitted(tones)

        if shaking is not None:
            motion = Vibrating(motion, through_mounts(shaking.tones), part=shaking.part)
        if scenario.vibration:
            tables = enumerate(scenario.vibration)
            motion = Vibrating(
                motion, through_mounts([t for n, table in tables for t in table.tones(scenario.seed + n)])
            )
    return motion if scenario.gravity is None else scenario.gravity.felt(motion, scenario.seed)


def mounting(scenario: Scenario) -> Mounting:
    """Return the place of a scenario's sensor block in its vehicle: from [imu], the aircraft or zero, in this order."""
    arm, angles, source = scenario.imu.lever_arm_m, scenario.imu.mounting_deg, scenario.source
    if isinstance(source, Motion) and (arm is None or angles is None):
        usual = source.mounting
        arm, angles = usual.lever_arm_m if arm is None else arm, usual.angles_deg if angles is None else angles
    return Mounting(lever_arm_m=arm or (0.0, 0.0, 0.0), angles_deg=angles or (0.0, 0.0, 0.0))


def known_field(scenario: Scenario) -> DisturbingField | None:
    """Return the disturbing field that the navigator knows, by navigation.gravity_degree; None for normal gravity."""
    degree, gravity = scenario.navigation.gravity_degree, scenario.gravity
    return None if degree is None or gravity is None else gravity.field(scenario.truth.figure, degree)


def unknown_field(scenario: Scenario) -> DisturbingField | None:
    """Return the part of the true field that the navigator does not know, None if it knows all of it."""
    gravity, known = scenario.gravity, scenario.navigation.gravity_degree
    return None if gravity is None else gravity.beyond(known, scenario.truth.figure)


def unknown_disturbance(scenario: Scenario, motion: Trajectory, time: Array) -> Array:
    """Return the disturbance that the navigator does not know on a true motion at instants, (K,) s, north, east, down,
    (K, 3) m/s²."""
    from sinssim.truth.true_gravity_disturbance import Disturbed

    if not isinstance(motion, Disturbed) or not len(time):
        return np.zeros((len(time), 3))
    state = motion.state(time)
    whole = motion.disturbance_ned(time, state)
    known = known_field(scenario)
    return whole if known is None else whole - known.at(state.latitude, state.longitude, state.height).gravity_ned


def block_of(vehicle: Trajectory, section: Imu) -> Trajectory:
    """Return the true motion of the IMU, which is that of a rotating IMU with [imu.rotation].

    Args:
        vehicle: the true motion at the block's place, in the axes of its mounting.
        section: the [imu] section of a scenario.

    Returns:
        The motion of the rotating IMU; that of the vehicle without [imu.rotation].

    Raises:
        InputError: the section is not an [imu] section.
    """
    check_kind("section", section, Imu, "Imu, for example scenario.imu")
    if section.rotation is None:
        return vehicle
    return TurningBlock(vehicle, section.rotation.turning(vehicle.start, vehicle.end))
