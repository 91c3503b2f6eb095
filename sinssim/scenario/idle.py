"""What a scenario writes of its sensors that changes nothing in its run: a person should know."""

from __future__ import annotations

from collections.abc import Iterator

from sinssim.scenario.grades import find_grade
from sinssim.scenario.imu import ImuSection


def idle(imu: ImuSection, end: float) -> Iterator[str]:
    """Say which keys of a sensor block change nothing.

    Args:
        imu: the [imu] section.
        end: when the run ends, s.

    Yields:
        Whole sentences, each with its key.
    """
    if not (imu.temperature_start_c or imu.temperature_steady_c):
        by_temperature = [name for name in type(imu).model_fields if "_temperature_" in name and _says(imu, name)]
        if imu.laser_gyro is not None and imu.laser_gyro.gas_flow_mps:
            by_temperature.append("laser_gyro.gas_flow_mps")
        for name in by_temperature:
            yield (
                f"imu.{name} changes nothing: temperature_start_c and temperature_steady_c are 0, the temperature of "
                "the calibration."
            )
    if imu.temperature_start_c == imu.temperature_steady_c and "warm_up_time_s" in imu.model_fields_set:
        yield "imu.warm_up_time_s changes nothing: temperature_start_c and temperature_steady_c are the same."
    for triad in ("gyro", "accel"):
        unit = {"gyro": "deg_h", "accel": "ug"}[triad]
        given = getattr(imu, f"{triad}_instability_{unit}")
        of_grade = getattr(find_grade(imu.grade), triad).instability
        if getattr(imu, f"{triad}_correlation_time_s") is not None and not (of_grade if given is None else given):
            yield f"imu.{triad}_correlation_time_s changes nothing: there is no {triad}_instability_{unit}."
    for number, fault in enumerate(imu.faults, start=1):
        to = None if fault.type == "spike" else fault.to_s
        if to is not None and to > end:
            yield f"imu.faults.{number}.to_s = {to:g}: the run ends at {end:.6g} s, and with it the {fault.type}."


def _says(imu: ImuSection, name: str) -> bool:
    value = getattr(imu, name)
    return any(value) if isinstance(value, tuple) else bool(value)
