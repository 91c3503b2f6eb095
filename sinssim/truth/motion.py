"""What the tables of a scenario that give the true motion have in common: each makes a trajectory of its keys."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import AfterValidator, Field

from sinssim import rotation
from sinssim.earth.ellipsoids import ELLIPSOIDS, GRAVITY_MODELS, Ellipsoid
from sinssim.toml_section import Height, Latitude, Longitude, Section, Source, Vector3, known_name

if TYPE_CHECKING:
    from sinssim.data import Array
    from sinssim.truth.trajectory import Trajectory

Gravity = Annotated[str, AfterValidator(known_name("gravity model", GRAVITY_MODELS))]
EllipsoidName = Annotated[str, AfterValidator(known_name("ellipsoid", ELLIPSOIDS))]

Progress = Callable[[float], None]
"""Takes the fraction that is done, 0…1."""


class TrueEarth(Section):
    """Gravity model and ellipsoid of the truth."""

    gravity: Gravity = Field(default="normal", description="gravity model, see `sinssim list gravity`")
    ellipsoid: EllipsoidName = Field(
        default="wgs84",
        description=f"one of {', '.join(ELLIPSOIDS)}; the constants of the chapter are inconsistent: ω²a/g_e is 0.6 % "
        f"less than its q",
    )

    @property
    def figure(self) -> Ellipsoid:
        """The reference ellipsoid."""
        return ELLIPSOIDS[self.ellipsoid]


NORMAL_EARTH = TrueEarth()


class Mounting(Section):
    """Place of the sensor block in its vehicle."""

    # from the vehicle's reference point, in an aircraft the centre of gravity, to the block, forward, right, down, m
    lever_arm_m: Vector3
    angles_deg: Vector3 = (0.0, 0.0, 0.0)  # roll, pitch and yaw of the block's axes in the vehicle's, degrees

    @property
    def q_bs(self) -> Array:
        """The orientation of the block, v_b = C_bs v_s, (4,)."""
        return attitude(*self.angles_deg)

    def of(self, vehicle: Trajectory) -> Trajectory:
        """Return the motion of the block from that of its vehicle's reference point."""
        if not any(self.lever_arm_m) and not any(self.angles_deg):
            return vehicle
        from sinssim.truth.motions.mounted_block import Vibrating

        return Vibrating(vehicle, (), self.lever_arm_m, self.q_bs)


AT_REFERENCE_POINT = Mounting(lever_arm_m=(0.0, 0.0, 0.0))


class Motion(Source):
    """A table that gives the true motion."""

    @property
    def mounting(self) -> Mounting:
        """Place of the sensor block in the vehicle, for what [imu] does not give."""
        return AT_REFERENCE_POINT

    @property
    def usual_speed(self) -> float:
        """Ground speed, m/s, if the transport rate matters beside the Earth's."""
        return 0.0

    def duration(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Return the duration before the motion is computed, s: exact except for a flight, for which it is an
        estimate."""
        assert self.known_duration is not None  # others say how long they last
        return self.known_duration

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Estimate ∫ω² dt of the vehicle's rotation relative to the Earth, rad²/s; raises like `duration`."""
        return 0.0

    def trajectory(
        self,
        block: Mounting = AT_REFERENCE_POINT,
        earth: TrueEarth = NORMAL_EARTH,
        seed: int = 0,
        progress: Progress | None = None,
        meanwhile: Callable[[], None] | None = None,
    ) -> Trajectory:
        """Return the true motion of the sensor block.

        Args:
            seed: seed of what is random in the motion.
            progress: called with the fraction of a flight flown, 0…1.
            meanwhile: called once while another process flies; not called if there is nothing to fly.
        """
        return self.block_motion(block, earth, seed)

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        """Return the true motion of the sensor block, for `trajectory`."""
        raise NotImplementedError


class PlacedMotion(Motion):
    """A motion that begins at a given place."""

    latitude_deg: Latitude
    longitude_deg: Longitude
    altitude_m: Height

    @property
    def place(self) -> tuple[float, float, float]:
        """Latitude and longitude, rad, and height above the ellipsoid, m."""
        return np.radians(self.latitude_deg), np.radians(self.longitude_deg), self.altitude_m


def attitude(roll_deg: float, pitch_deg: float, heading_deg: float) -> Array:
    """Return the quaternion of roll, pitch and heading or yaw, degrees, (4,)."""
    return rotation.quaternion_from_euler(*np.radians((roll_deg, pitch_deg, heading_deg)))
