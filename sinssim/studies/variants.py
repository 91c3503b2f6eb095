"""What a study's sensor-set variants are in the words of a scenario."""

from __future__ import annotations

from sinssim.scenario.imu import ImuSection
from sinssim.scenario.sensor_set import AttitudeSensor, Gyros, SensorSet, SixAccelerometers

_SETS: dict[str, SensorSet] = {
    "rate-gyros": Gyros(type="gyros"),
    "attitude-sensor": AttitudeSensor(type="attitude-sensor"),
    "six-accelerometers-0.1m": SixAccelerometers(type="accelerometers", arm_m=0.1),
    "six-accelerometers-1m": SixAccelerometers(type="accelerometers", arm_m=1.0),
}


def with_set(section: ImuSection, variant: str, rate_hz: float) -> ImuSection:
    """Return a block's [imu] section for one of a study's sensor-set variants.

    Args:
        section: the block's errors. Those of sensors that the variant does not have stay without effect, except that
            an attitude sensor drifts as the gyros would be biased.
        variant: one of `sinssim.studies.claim_names.VARIANTS`.
        rate_hz: samples per second.

    Returns:
        The section.
    """
    return section.model_copy(update={"sensor_set": _SETS[variant], "rate_hz": rate_hz})
