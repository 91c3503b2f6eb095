"""The base of all motions of a scenario, each of which makes a trajectory of its keys, and the table [gravity].

[gravity] is the true gravity field, and the random remainder that no model has.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from sinssim import rotation
from sinssim.earth.ellipsoids import ELLIPSOIDS, GRAVITY_MODELS, Ellipsoid
from sinssim.errors import InputError
from sinssim.toml_section import Height, Latitude, Longitude, Section, Source, Vector3, known_name
from sinssim.units import ARCSEC, MGAL

if TYPE_CHECKING:
    from sinssim.data import Array
    from sinssim.earth.ellipsoids import Ellipsoid
    from sinssim.earth.gravity_disturbance import DisturbingField
    from sinssim.earth.harmonic_coefficients import Coefficients
    from sinssim.truth.motions.vibration import Shaking
    from sinssim.truth.trajectory import Trajectory
    from sinssim.truth.true_gravity_disturbance import Disturbed, RemainderModel

_NORMAL_DEGREE = 2
"""Degree to which normal gravity knows the field."""
_Deflection = Annotated[float, Field(ge=0.0, le=200.0)]
_Anomaly = Annotated[float, Field(ge=0.0, le=2000.0)]
_Kilometres = Annotated[float, Field(ge=0.1, le=5000.0)]
_Order = Annotated[int, Field(ge=2, le=3)]
_Degree = Annotated[int, Field(ge=2, le=2190)]


class GravityRemainder(Section):
    """The part of gravity beyond the model, which is a Gauss-Markov process over the distance travelled. Values that
    are left out follow from the anomaly degree variances of Tscherning and Rapp (1974) beyond the model's degree, at
    `altitude_m`. Beyond degree 120, they are 4.8 arcsec, 32 mGal and 21 km on the ground."""

    order: _Order = Field(
        default=2, description="order of the process: 2, (1 + βd) exp(-βd), or 3, (1 + βd + β²d²/3) exp(-βd)"
    )
    xi_sigma_arcsec: _Deflection | None = Field(default=None, description="1σ of the deflection to the north")
    eta_sigma_arcsec: _Deflection | None = Field(default=None, description="1σ of the deflection to the east")
    anomaly_sigma_mgal: _Anomaly | None = Field(default=None, description="1σ of the gravity anomaly")
    correlation_km: _Kilometres | None = Field(default=None, description="distance at which the correlation is 1/e")
    altitude_m: Height = Field(default=0.0, description="height for the default values of this table")


class TrueGravity(Section):
    """The true gravity field, which acts on the sensors. The navigation algorithm uses normal gravity unless
    navigation.gravity_degree is given."""

    model: Literal["normal", "egm2008", "icgem"] = Field(
        default="normal",
        description='"normal": gravity of the ellipsoid; "egm2008": the model of the package, to degree 120; "icgem": '
        "the model in `file`",
    )
    file: str | None = Field(
        default=None, description='coefficients in the format of the ICGEM (.gfc), relative to this file; for "icgem"'
    )
    degree: _Degree | None = Field(default=None, description="highest degree and order; default: that of the model")
    remainder: GravityRemainder | None = None

    rules = (
        (lambda s: (s.model == "icgem") != (s.file is not None)
         and ("file is missing" if s.file is None else f'file = "{s.file}"'),
         'model = "icgem" needs file, the path of its coefficients (.gfc), and no other model takes one; here model = '
         '"{s.model}" and {it}'),
        (lambda s: s.model == "normal" and s.degree is not None,
         'degree = {s.degree} would have no effect: model = "normal" has none; choose model = "egm2008"'),
    )  # fmt: skip

    @classmethod
    def normalized(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Add the model of a file."""
        return {"model": "icgem", **data} if data.get("file") is not None else data

    @model_validator(mode="after")
    def _model_is_available(self) -> Self:
        try:
            self.coefficients()
        except InputError as error:
            raise ValueError(str(error)) from error
        return self

    def coefficients(self, degree: int | None = None) -> Coefficients | None:
        """Return the coefficients of the model up to a degree, by default that of the section; None for normal
        gravity."""
        if self.model == "normal":
            return None
        degree = self.degree if degree is None else degree
        if self.model == "icgem":
            from sinssim.earth.harmonic_coefficients import known_icgem

            assert self.file is not None
            return known_icgem(self.file, degree)
        from sinssim.earth.harmonic_coefficients import shipped

        model = shipped()
        return model if degree is None else model.to_degree(degree)

    def field(self, ellipsoid: Ellipsoid, degree: int | None = None) -> DisturbingField | None:
        """Return the disturbing field up to a degree, by default that of the model; None for normal gravity."""
        model = self.coefficients(degree)
        return None if model is None else _field(model, ellipsoid)

    def beyond(self, degree: int | None, ellipsoid: Ellipsoid) -> DisturbingField | None:
        """Return the part of the field that a navigator does not know; None if there is none. It knows the field to the
        degree, normal gravity only without one."""
        field = self.field(ellipsoid)
        if field is None or degree == field.degree:
            return None
        return field if degree is None else field.beyond(degree)

    def remainder_model(self) -> RemainderModel | None:
        """Return the statistics of the remainder, with the sizes of `omission` where the table has none; None without a
        remainder."""
        from sinssim.earth.harmonic_coefficients import omission
        from sinssim.truth.true_gravity_disturbance import RemainderModel

        section = self.remainder
        if section is None:
            return None
        model = self.coefficients()
        left = omission(_NORMAL_DEGREE if model is None else model.degree, section.altitude_m)

        def given(value: float | None, unit: float, instead: float) -> float:
            return instead if value is None else value * unit

        sigma = (
            given(section.xi_sigma_arcsec, ARCSEC, left.deflection),
            given(section.eta_sigma_arcsec, ARCSEC, left.deflection),
            given(section.anomaly_sigma_mgal, MGAL, left.anomaly),
        )
        return RemainderModel(section.order, sigma, given(section.correlation_km, 1e3, left.distance))

    def felt(self, motion: Trajectory, seed: int) -> Disturbed:
        """Return a motion whose sensors feel the field."""
        from sinssim.truth.true_gravity_disturbance import Disturbed

        return Disturbed(motion, self.field(motion.ellipsoid), self.remainder_model(), seed)


@lru_cache(maxsize=4)
def _field(model: Coefficients, ellipsoid: Ellipsoid) -> DisturbingField:
    from sinssim.earth.gravity_disturbance import DisturbingField

    return DisturbingField(model, ellipsoid)


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
    def is_drawn(self) -> bool:
        """Whether the motion differs from seed to seed."""
        return False

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

    def shaking(self, seed: int) -> Shaking | None:
        """Return the vibration that the vehicle has of itself, in the axes of the sensor block; None without one."""
        return None

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
