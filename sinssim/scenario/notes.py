"""Notes on a scenario: keys without effect, times after the end of the run, defaults in use, height reference.

The height reference matters because pure inertial height is unstable.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from sinssim.scenario.tables import Tables
from sinssim.sensors.aiding.air_data import Barometer
from sinssim.sensors.aiding.gnss import Gnss
from sinssim.sensors.imu.datasheet_lines import to_si
from sinssim.sensors.imu.error_term_table import CORRELATION_TIME, TERMS, of_triad
from sinssim.sensors.imu.grades import find_grade
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_section import Platform, Redundant
from sinssim.strapdown.mechanization import OF_TRUTH
from sinssim.truth.flight.legs.waypoint import WaypointLeg
from sinssim.units import PPM

FLICKER_SAMPLES = 2.5e6
"""Number of samples up to which flicker has its Allan deviation of 0.664 B; see `sinssim.sensors.flicker`."""


def keys_without_effect(imu: Imu, end: float) -> Iterator[str]:
    """Yield notes on keys of a sensor block that have no effect (end of the run, s)."""
    if not (imu.temperature_start_c or imu.temperature_steady_c):
        warming = [key for term in TERMS if term.of_temperature for key in term.keys]
        by_temperature = [key for key in warming if _says(imu, key)]
        if imu.laser_gyro is not None and imu.laser_gyro.gas_flow_mps:
            by_temperature.append("laser_gyro.gas_flow_mps")
        for name in by_temperature:
            yield (
                f"imu.{name} has no effect: temperature_start_c and temperature_steady_c are 0, the temperature of "
                "the calibration."
            )
    if imu.temperature_start_c == imu.temperature_steady_c and "warm_up_time_s" in imu.model_fields_set:
        yield "imu.warm_up_time_s has no effect: temperature_start_c and temperature_steady_c are equal."
    for triad in ("gyro", "accel"):
        keys = {term.field: term.key for term in of_triad(triad)}
        instability, correlation_time = keys["instability"], keys["correlation_time"]
        value = getattr(imu, instability)
        of_grade = getattr(find_grade(imu.grade), triad).instability
        if getattr(imu, correlation_time) is not None and not (of_grade if value is None else value):
            yield f"imu.{correlation_time} has no effect: there is no {instability}."
    for number, fault in enumerate(imu.faults, start=1):
        to = None if fault.type == "spike" else fault.to_s
        if to is not None and to > end:
            yield f"imu.faults.{number}.to_s = {to:g}: the {fault.type} ends with the run, at {end:.6g} s."
    yield from _windows_without_effect(imu, end)


def _windows_without_effect(imu: Imu, end: float) -> Iterator[str]:
    """Yield notes on given windows of a redundant set's monitoring that are never tested."""
    sensor_set = imu.sensor_set
    if not (isinstance(sensor_set, Redundant) and "windows_s" in sensor_set.model_fields_set):
        return
    if sensor_set.mode == "none":
        yield 'imu.sensor_set.windows_s has no effect: there is no test with monitoring = "none".'
        return
    for number, window in enumerate(sensor_set.windows_s, start=1):
        if window > end:
            yield (
                f"imu.sensor_set.windows_s.{number} = {window:g} has no effect: the window is longer than the run, "
                f"which ends at {end:.6g} s."
            )


def _says(imu: Imu, name: str) -> bool:
    value = getattr(imu, name)
    return any(value) if isinstance(value, tuple) else bool(value)


def times_not_reached(scenario: Tables, end: float) -> Iterator[str]:
    """Yield notes on outages, faults, stops and alignments beyond the end of the run (end of the run, s)."""
    wanted = None if scenario.filter is None else scenario.filter.alignment_s
    if wanted is not None and wanted >= end:
        yield f"filter.alignment_s = {wanted:g}: the alignment takes longer than the run, which ends at {end:.0f} s."
    for name, sensor in (scenario.aiding.sensors() if scenario.aiding else {}).items():
        times = [(f"outages_s.{i}", begin) for i, (begin, _) in enumerate(sensor.outages_s, start=1)]
        times += [(f"during_s.{i}", b) for i, (b, _) in enumerate(getattr(sensor, "during_s", None) or (), start=1)]
        if isinstance(sensor, Gnss):
            for kind, faults in (("jumps", sensor.jumps), ("ramps", sensor.ramps)):
                times += [(f"{kind}.{i}", fault.from_s) for i, fault in enumerate(faults, start=1)]
        for key, begin in times:
            if begin >= end:
                yield f"aiding.{name}.{key} begins at {begin:g} s, but the run ends at {end:.0f} s: it has no effect."
        if sensor.latency_s >= end:
            yield (
                f"aiding.{name}.latency_s = {sensor.latency_s:g}: no measurement arrives before the end of the run at "
                f"{end:.0f} s."
            )


def earth_of_the_navigator(scenario: Tables) -> Iterator[str]:
    """Yield a note if the navigator has other constants of the Earth than the truth."""
    assumed, true = scenario.navigation.ellipsoid, scenario.truth.ellipsoid
    if assumed not in (OF_TRUTH, true):
        yield (
            f'navigation.ellipsoid = "{assumed}" differs from truth.ellipsoid = "{true}": the start has the same '
            "latitude, longitude and height on both, and the position error is the difference of these coordinates."
        )


def barometer_of_the_day(scenario: Tables) -> Iterator[str]:
    """Yield a note if the filter does not know by how much the air makes the barometer wrong."""
    flight, aiding = scenario.flight, scenario.aiding
    baro = None if aiding is None else aiding.sensors().get("baro")
    if flight is None or flight.atmosphere is None or not isinstance(baro, Barometer) or scenario.filter is None:
        return
    air, heights = flight.air(), [flight.start.altitude_m]
    for leg, _, state in flight.reckoned():
        places = leg.places() if isinstance(leg, WaypointLeg) else ()
        heights += [state.altitude, *(place.height_m for place in places if place.height_m is not None)]
    errors = [(abs(air.pressure_altitude(height) - height), height) for height in heights]
    error, height = max(errors)
    known = math.hypot(baro.bias_sigma_m, PPM * math.hypot(baro.scale_sigma_ppm, baro.scale_ppm or 0.0) * height)
    if error > 3.0 * known:
        yield (
            f"aiding.baro.bias_sigma_m = {baro.bias_sigma_m:g}: in the atmosphere of [flight.atmosphere] the barometer "
            f"has an error of {error:.0f} m at a height of {height:g} m; the filter will reject its measurements. Give "
            f"bias_sigma_m = {error:.0f}."
        )


def torquer_taken(scenario: Tables) -> Iterator[str]:
    """Yield a note on the default torquing scale factor of a platform."""
    imu, sensor_set = scenario.imu, scenario.imu.sensor_set
    if not isinstance(sensor_set, Platform) or scenario.navigation.frame == "inertial":
        return
    if sensor_set.torquer_scale_ppm is not None or sensor_set.torquer_scale_sigma_ppm is not None:
        return
    sigma = imu.gyro_scale_sigma_ppm
    if sigma is None:
        sigma = 0.0 if imu.gyro_scale_ppm is not None else find_grade(imu.grade).gyro.scale / PPM
    if sigma:
        yield (
            f"imu.sensor_set.torquer_scale_sigma_ppm is not given: {sigma:g}, the 1σ of the gyros' scale factor, is "
            "used."
        )


def coarse_rates(imu: Imu) -> Iterator[str]:
    """Yield notes on rates whose rounding is not white noise."""
    for triad in ("gyro", "accel") if imu.output != "increments" else ():
        grade, terms = getattr(find_grade(imu.grade), triad), {term.field: term for term in of_triad(triad)}
        quantum, noise = (
            grade.of(term) if getattr(imu, term.key) is None else to_si(term.key, getattr(imu, term.key))
            for term in (terms["quantum"], terms["random_walk"])
        )
        of_reading = noise / math.sqrt(imu.rate_hz)
        if quantum > 2.0 * of_reading:
            steps = f"{quantum / of_reading:.3g} times" if of_reading else "without"
            yield (
                f"imu.output: the step of the {triad} rates is {steps} the noise of a reading: rates below half a step "
                "are lost, and the rounding is not the white noise that filter and budget assume; it is up to 2 times."
            )


def defaults_taken(imu: Imu, duration: float) -> Iterator[str]:
    """Yield notes on default correlation times, and on flicker in a run longer than its validity (duration of the run,
    s)."""
    for triad in ("gyro", "accel"):
        keys = {term.field: term.key for term in of_triad(triad)}
        instability = getattr(imu, keys["instability"])
        if instability and getattr(imu, keys["correlation_time"]) is None:
            yield (
                f"imu.{keys['instability']} = {instability:g} is given without {keys['correlation_time']}: "
                f"{CORRELATION_TIME:g} s is used."
            )
        flicker = getattr(imu, keys["flicker"])
        if flicker and duration * imu.rate_hz > FLICKER_SAMPLES:
            yield (
                f"imu.{keys['flicker']} = {flicker:g} is flicker noise up to {FLICKER_SAMPLES:g} samples, "
                f"{FLICKER_SAMPLES / imu.rate_hz:.4g} s at {imu.rate_hz:g} Hz; over longer times its Allan deviation "
                "falls below 0.664 B, by 1.5 % at 4e6 samples."
            )


_E_FOLD_S = math.sqrt(6.371e6 / (2.0 * 9.81))
"""√(R/2g): time in which an error of unaided height grows e-fold, s. Gravity falls by 2g/R per metre."""


def height_words(scenario: Tables) -> str:
    """Describe the height reference and its effect on the horizontal solution."""
    navigation, aiding = scenario.navigation, scenario.aiding
    if navigation.vertical == "free":
        remedy = "" if scenario.source.leaves_air else ' (navigation.vertical = "baro-loop" stabilises it)'
        return (
            f"free; its errors grow e-fold in {_E_FOLD_S / 60.0:.1f} min and eventually degrade the horizontal "
            f"solution, too{remedy}"
        )
    if navigation.vertical == "truth":
        return "the true height: the height has no error and does not affect the horizontal solution"
    channel = (
        f"stabilised by a baro loop with a time constant of {navigation.baro_time_constant_s:g} s, which prevents a "
        f"growing height error from degrading the horizontal solution"
    )
    if aiding is not None and aiding.sensor(Barometer) is not None:
        return f"{channel}; its error is that of [aiding.baro]"
    return f"{channel}; without [aiding.baro], its reference is a perfect altimeter (the true height)"
