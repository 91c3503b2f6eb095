"""Tables of a scenario that require or exclude each other: a filter, a platform, a block that turns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.algorithms import PLATFORM
from sinssim.sensors.imu.terms import TERMS, of_triad
from sinssim.sensors.sets.sensor_set import Platform

if TYPE_CHECKING:
    from sinssim.scenario.sections.aiding import AidingSection
    from sinssim.scenario.sections.filter import FilterSection
    from sinssim.scenario.sections.navigation import NavigationSection
    from sinssim.section import Source
    from sinssim.sensors.imu.compensation import Compensation
    from sinssim.sensors.imu.imu import Imu
    from sinssim.truth.gravity.true_gravity import TrueGravity
    from sinssim.truth.motion import TrueEarth

_OF_TURNS = ("BENT", "LIMITED", "QUANTISED")
"""Stages of the error terms that gyros on a platform do not have, because they sense no turns."""

_FROM_READINGS = {
    "zero_rate": "compares the mean of the gyro data with zero rotation of the vehicle",
    "land_vehicle": "has states for the angles between the IMU and the vehicle",
}
"""Aiding that takes the block's readings for those of the vehicle."""


def check_compensation(section: Compensation | None, sensor_set: str) -> None:
    """Raise ValueError for a compensation that a set of sensors cannot have.

    Args:
        section: the [compensation] section, if there is one.
        sensor_set: imu.sensor_set.type.
    """
    if section is None or sensor_set == "gyros":
        return
    if sensor_set != "redundant":
        raise ValueError(
            f'[compensation] needs gyros and accelerometers; imu.sensor_set.type = "{sensor_set}" is another set'
        )
    for key in ("accel_arms_mm", *(term.key for term in TERMS if term.calibrated)):
        if getattr(section, key) is not None:
            raise ValueError(
                f"compensation.{key} is a value for a block of two triads, but the redundant set has single sensors "
                "whose calibration errors are random: give the keys with _sigma_"
            )


def check_filter(
    section: FilterSection | None,
    imu: Imu,
    aiding: AidingSection | None,
    source: Source,
    vertical: str,
) -> None:
    """Raise ValueError for a filter without readings or without inertial sensors, and for readings without use.

    Args:
        section: the [filter] section, if there is one.
        imu: the [imu] section.
        aiding: the [aiding] section, if there is one.
        source: the source.
        vertical: the vertical channel of the navigators.
    """
    if section is not None and aiding is None and not source.has_readings:
        where = "log.gnss" if source.recorded else "aiding.gnss"
        raise ValueError(f"[filter] needs an aiding sensor: add one, for example [{where}]")
    if aiding is not None and section is None:
        if list(aiding.sensors()) != ["baro"]:
            raise ValueError("[aiding] needs a [filter] that uses it: add [filter]; its keys have defaults")
        if vertical != "baro-loop":
            raise ValueError('[aiding.baro] is not used: add [filter], or navigation.vertical = "baro-loop"')
    if section is not None and imu.sensor_set.type == PLATFORM:
        raise ValueError(
            "[filter] estimates the errors of gyros and accelerometers fixed to the vehicle; on a platform they "
            "act about its axes, and the filter would have to torque it: remove [filter], or sensor_set.type = "
            '"platform"'
        )
    if section is None:
        return
    if imu.sensor_set.type not in ("gyros", "redundant"):
        raise ValueError(
            f'[filter] needs gyros and accelerometers; imu.sensor_set.type = "{imu.sensor_set.type}" is another set'
        )
    if imu.sensor_set.type == "redundant":
        for key in ("backward", "vibration_noise"):
            if getattr(section, key):
                raise ValueError(
                    f"filter.{key} is not possible with a redundant set, whose combination and noise change at each "
                    'exclusion of a sensor: remove it, or imu.sensor_set.type = "redundant"'
                )


def check_platform(imu: Imu, navigation: NavigationSection) -> None:
    """Raise ValueError for a platform without its algorithm, and for keys without effect on one.

    Args:
        imu: the [imu] section.
        navigation: the [navigation] section.
    """
    algorithms, own = navigation.algorithms, imu.sensor_set
    if (own.type == PLATFORM) != (PLATFORM in algorithms):
        raise ValueError(
            f'imu.sensor_set.type = "platform" requires "{PLATFORM}" among navigation.algorithms, and vice versa; '
            f'here imu.sensor_set.type = "{own.type}" and navigation.algorithms = {list(algorithms)}'
        )
    if not isinstance(own, Platform):
        return
    torquer = [key for key in ("torquer_scale_ppm", "torquer_scale_sigma_ppm") if getattr(own, key) is not None]
    if torquer and navigation.frame == "inertial":
        raise ValueError(
            f'imu.sensor_set.{torquer[0]} would have no effect: with navigation.frame = "inertial" the platform '
            "keeps its direction in inertial space and is not torqued; remove it, or choose another frame"
        )
    if len(algorithms) > 1:
        return
    for term in of_triad("gyro"):
        for key in term.keys if term.stage in _OF_TURNS or term.field in ("scale", "misalignment") else ():
            if getattr(imu, key) is not None and not (key == "gyro_scale_sigma_ppm" and not torquer):
                raise ValueError(
                    f"imu.{key} would have no effect: the gyros stabilise the platform and sense no rotation; remove "
                    f"it, "
                    'or add a strapdown algorithm for the same sensors, for example "quaternion", to '
                    "navigation.algorithms"
                )


def check_rotation(
    imu: Imu,
    section: FilterSection | None,
    aiding: AidingSection | None,
    source: Source,
    navigation: NavigationSection,
) -> None:
    """Raise ValueError if a part of a scenario cannot be used with a block that turns in the vehicle.

    Args:
        imu: the [imu] section.
        section: the [filter] section, if there is one.
        aiding: the [aiding] section, if there is one.
        source: the source.
        navigation: the [navigation] section.
    """
    if imu.rotation is None:
        return
    if source.recorded:
        raise ValueError(
            f"[{source.table}] contains recorded data without the angles of a rotating IMU: remove it, or "
            "[imu.rotation]"
        )
    if navigation.alignment is not None:
        raise ValueError(
            "[navigation.alignment] assumes the inertial data of a vehicle at rest, but the IMU rotates: remove it, or "
            "[imu.rotation]"
        )
    if section is not None:
        if section.alignment_s is not None:
            raise ValueError(
                f"filter.alignment_s = {section.alignment_s:g} needs inertial data in the axes of the vehicle, but the "
                "IMU rotates: remove it, or [imu.rotation]"
            )
        if section.backward:
            raise ValueError(
                "filter.backward = true navigates in reverse time, which requires an IMU fixed to the vehicle, "
                "but the IMU rotates: remove it, or [imu.rotation]"
            )
        if section.vibration_noise:
            raise ValueError(
                f"filter.vibration_noise = {section.vibration_noise:g} treats changes of the inertial data as "
                "vibration, but the rotation of the IMU changes them: remove it, or [imu.rotation]"
            )
    for name, sensor in (aiding.sensors() if aiding else {}).items():
        if name in _FROM_READINGS:
            raise ValueError(
                f"[aiding.{name}] {_FROM_READINGS[name]}, but the IMU rotates: remove it, or [imu.rotation]"
            )
        if getattr(sensor, "detect", False):
            raise ValueError(
                f"aiding.{name}.detect = true detects stops in the inertial data, but the IMU rotates: give during_s, "
                "or remove [imu.rotation]"
            )


_GEOCENTRIC = ("wgs84", "pz-90.11")
"""Ellipsoids whose centre is that of the models."""


def check_gravity(gravity: TrueGravity | None, navigation: NavigationSection, truth: TrueEarth, sensors: str) -> None:
    """Check [gravity] and the keys of other tables that depend on it.

    Args:
        gravity, navigation, truth: the tables of a scenario.
        sensors: its imu.sensor_set.type.

    Raises:
        ValueError: a key cannot be used with the others; the message names it.
    """
    degree = navigation.gravity_degree
    model = "normal" if gravity is None else gravity.model
    if degree is not None:
        if gravity is None or model == "normal":
            raise ValueError(
                f"navigation.gravity_degree = {degree} needs the model whose disturbance is to be compensated: add "
                '[gravity] with model = "egm2008", or remove the key'
            )
        if navigation.gravity != "normal":
            raise ValueError(
                f"navigation.gravity_degree = {degree} adds to normal gravity; navigation.gravity = "
                f'"{navigation.gravity}" is another model: remove one of the two'
            )
        if sensors in ("attitude-sensor", "platform"):
            raise ValueError(
                f'navigation.gravity_degree needs strapdown gyros, which imu.sensor_set.type = "{sensors}" lacks: '
                "remove one of the two"
            )
        has = gravity.coefficients()
        if has is not None and degree > has.degree:
            raise ValueError(
                f"navigation.gravity_degree = {degree} is above gravity.degree = {has.degree}: the navigation "
                "algorithm can use the model of the truth only to the same or a lower degree"
            )
    if model != "normal" and truth.gravity != "normal":
        raise ValueError(
            f'gravity.model = "{model}" adds to normal gravity; truth.gravity = "{truth.gravity}" is another '
            "model: remove truth.gravity"
        )
    if model != "normal" and truth.ellipsoid not in _GEOCENTRIC:
        raise ValueError(
            f'gravity.model = "{model}" needs an ellipsoid about the centre of mass, {" or ".join(_GEOCENTRIC)}; here '
            f'truth.ellipsoid = "{truth.ellipsoid}"'
        )


def check_gravity_of_log(gravity: TrueGravity | None, navigation: NavigationSection) -> None:
    """Check [gravity] beside [log]: the readings contain the true field, and the table is what the navigator knows.

    Args:
        gravity, navigation: the tables of a scenario.

    Raises:
        ValueError: the table would change recorded readings, or have no effect.
    """
    if gravity is None:
        return
    if gravity.remainder is not None:
        raise ValueError(
            "[gravity.remainder] is a random part of the true field, but the data are recorded ([log]): remove it"
        )
    if navigation.gravity_degree is None:
        raise ValueError(
            "[gravity] would have no effect: recorded data ([log]) contain the true field, and the table describes "
            "only the model of the navigation algorithm. Add navigation.gravity_degree, for example 120, or remove "
            "[gravity]"
        )
