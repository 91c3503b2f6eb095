"""The sources of budgets with their sizes: keys in the units of people, columns in SI."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.analyses.error_budget import error_sources
from sinssim.analyses.error_budget.error_sources import (
    SensorConstant,
    SensorGiven,
    SensorNoise,
    SensorProcess,
    Source,
    aiding_sources,
    constants,
    inertial_noises,
    initial_errors,
)
from sinssim.analyses.error_budget.source_propagation import AlongWay, Flicker, GaussMarkov, Sum, Walk
from sinssim.data import Array
from sinssim.sensors.aiding_sensor import SensorState
from sinssim.truth.true_gravity_disturbance import RemainderModel
from tests.analyses.error_budget.worlds import scenario

DEG, G = math.pi / 180.0, 9.80665
STANDING = {"latitude_deg": 50.0, "duration_s": 20.0}


def told(source: Source) -> tuple[Any, ...]:
    return source.name, source.label, source.group, source.kind, source.value, source.unit


def test_constants_of_the_inertial_sensors() -> None:
    """A bias about given values shares its columns; misalignments have one column for each pair of axes."""
    found = constants(scenario(parked=STANDING, imu={
        "gyro_bias_deg_h": [0.3, -0.5, 0.0], "gyro_bias_sigma_deg_h": 0.2, "gyro_asymmetry_sigma_ppm": 40.0,
        "accel_misalignment_arcsec": [20.0, 0.0, -30.0, 0.0, 0.0, 7.0],
    }))  # fmt: skip
    assert [told(one) for one in found.sources] == [
        ("gyro_bias", "bias", "gyros", "random", 0.2, "deg/h"),
        ("gyro_bias_given", "bias, given", "gyros", "given", 0.5, "deg/h"),
        ("gyro_asymmetry", "asymmetry", "gyros", "random", 40.0, "ppm"),
        ("accel_misalignment_given", "misalignment, given", "accelerometers", "given", 30.0, "arcsec"),
    ]

    def places(name: str) -> list[tuple[int, str, int, int]]:
        """Return triad, field, sensitive axis and axis of the value of each column."""
        columns = [found.columns[k] for k in found.parts[name][0]]
        assert all(c.direction.tolist() == c.sensitive.tolist() for c in columns)
        return [(c.triad, c.term.field, int(np.argmax(c.sensitive)), int(np.argmax(c.along))) for c in columns]

    assert places("gyro_bias") == [(0, "bias", axis, axis) for axis in range(3)]
    assert places("gyro_bias_given") == places("gyro_bias")[:2]
    assert places("gyro_asymmetry") == [(0, "asymmetry", axis, axis) for axis in range(3)]
    pairs = [(i, j) for i in range(3) for j in range(3) if i != j]  # rows of the matrix, without its diagonal
    assert places("accel_misalignment_given") == [(1, "misalignment", *pairs[n]) for n in (0, 2, 5)]
    sizes = {name: size for name, (_, size) in found.parts.items()}
    assert sizes["gyro_bias"] == pytest.approx(np.full(3, 0.2 * DEG / 3600.0), rel=1e-12)
    assert sizes["gyro_bias_given"] == pytest.approx(np.array([0.3, -0.5]) * DEG / 3600.0, rel=1e-12)
    assert sizes["gyro_asymmetry"] == pytest.approx(np.full(3, 40e-6), rel=1e-12)
    assert sizes["accel_misalignment_given"] == pytest.approx(np.array([20.0, -30.0, 7.0]) * DEG / 3600.0, rel=1e-12)


NOISES = {
    "gyro_arw_deg_sqrt_h": 0.03, "gyro_quantum_arcsec": 2.0, "gyro_rrw_deg_h_sqrt_h": 0.7, "gyro_flicker_deg_h": 0.02,
    "accel_vrw_ug_sqrt_hz": 9.0, "accel_quantum_mm_s": 3.0, "accel_instability_ug": 20.0,
    "accel_correlation_time_s": 70.0,
}  # fmt: skip


def test_noises_of_the_inertial_sensors() -> None:
    """A sum of pulses Q drives as white noise of density Q √(T/12), at 20 samples a second."""
    found = inertial_noises(scenario(parked=STANDING, imu=NOISES))
    arc = 2.0 * DEG / 3600.0
    wanted: dict[str, Any] = {
        # label, group, value, unit, triad, what, size, density, process
        "gyro_arw": ("angle random walk", "gyros", 0.03, "deg/√h", 0, "white", 0.03 * DEG / 60.0, 1.0, None),
        "gyro_quantum": ("quantisation", "gyros", 2.0, "arcsec", 0, "quantum", arc, math.sqrt(0.05 / 12.0), None),
        "gyro_rrw": ("rate random walk", "gyros", 0.7, "deg/h/√h", 0, "process", 0.7 * DEG / 216e3, 0.0, Walk()),
        "gyro_flicker": ("flicker", "gyros", 0.02, "deg/h", 0, "process", 0.02 * DEG / 3600.0, 0.0, Flicker(0.05)),
        "accel_vrw": ("velocity random walk", "accelerometers", 9.0, "µg/√Hz", 1, "white", 9e-6 * G, 1.0, None),
        "accel_quantum": (
            "quantisation", "accelerometers", 3.0, "mm/s", 1, "quantum", 3e-3, math.sqrt(0.05 / 12.0), None,
        ),
        "accel_instability": (
            "bias instability", "accelerometers", 20.0, "µg", 1, "process", 20e-6 * G, 0.0, GaussMarkov(70.0),
        ),
    }  # fmt: skip
    assert {one.source.name for one in found} == set(wanted)
    for one in found:
        label, group, value, unit, triad, what, size, density, process = wanted[one.source.name]
        assert told(one.source)[1:] == (label, group, "random", value, unit)
        assert (one.triad, one.what, one.process, one.sizes) == (triad, what, process, None)
        assert (one.size, one.density) == pytest.approx((size, size * density), rel=1e-12)
        assert one.mix.tolist() == np.eye(3).tolist()


def test_noises_of_rates_and_with_readings_of_a_mean_rate() -> None:
    """Each reading Q/T rounded by itself is white noise of density Q √(1/12T); a mean rate shares the gyros' noise."""
    rounded = {one.source.name: one for one in inertial_noises(
        scenario(parked=STANDING, imu={"output": "mean-rates", **NOISES}), summed=True
    )}  # fmt: skip
    assert {name: rounded[name].what for name in ("gyro_quantum", "accel_quantum")} == {
        "gyro_quantum": "white", "accel_quantum": "white",
    }  # fmt: skip
    for name, quantum in (("gyro_quantum", 2.0 * DEG / 3600.0), ("accel_quantum", 3e-3)):
        density = quantum * math.sqrt(20.0 / 12.0)
        assert (rounded[name].size, rounded[name].density) == pytest.approx((density, density), rel=1e-12)
    assert isinstance(rounded["gyro_arw"].process, Sum)
    assert rounded["accel_vrw"].process is None


def test_errors_of_the_initial_state() -> None:
    start = {"position_sigma_m": 7.0, "height_sigma_m": 3.0, "velocity_sigma_mps": 0.2, "tilt_sigma_arcmin": 0.5,
             "heading_sigma_arcmin": 6.0}  # fmt: skip
    given = np.array([1.0, -2.0, 3.0, 0.1, 0.0, 0.0, 1e-4, 0.0, -2e-4])
    found = initial_errors(scenario(parked=STANDING, navigation={"initial_error": start}), given)
    assert [told(one)[:-2] for one in found.sources] == [
        ("initial_position", "position, north and east", "initial state", "random"),
        ("initial_height", "height", "initial state", "random"),
        ("initial_velocity", "velocity", "initial state", "random"),
        ("initial_tilt", "tilts", "initial state", "random"),
        ("initial_heading", "heading", "initial state", "random"),
        ("initial_given", "given errors", "initial state", "given"),
    ]
    assert [(one.value, one.unit) for one in found.sources[:-1]] == [
        (7.0, "m"), (3.0, "m"), (0.2, "m/s"), (0.5, "arcmin"), (6.0, "arcmin"),
    ]  # fmt: skip
    total = sum(part @ part.T for name, part in found.parts.items() if name != "initial_given")
    arcmin = DEG / 60.0
    sizes = np.array([7.0, 7.0, 3.0, 0.2, 0.2, 0.2, 0.5 * arcmin, 0.5 * arcmin, 6.0 * arcmin])
    np.testing.assert_allclose(total, np.diag(sizes**2), rtol=1e-12)
    np.testing.assert_array_equal(found.parts["initial_given"], given[:, None])
    assert not initial_errors(scenario(parked=STANDING), np.zeros(9)).sources


def test_errors_of_aiding_sensors() -> None:
    """Satellites with their own 1σ on each axis, an altimeter with noise, a process and a scale factor."""
    plan = scenario(
        parked=STANDING,
        navigation={"vertical": "baro-loop"},
        filter={},
        aiding={
            "gnss": {"rate_hz": 0.5, "position_sigma_m": 2.0, "height_sigma_m": 3.0, "velocity_sigma_mps": 0.07},
            "baro": {"rate_hz": 0.25, "sigma_m": 1.5, "bias_sigma_m": 8.0, "bias_correlation_time_s": 900.0,
                     "scale_ppm": 120.0, "scale_sigma_ppm": 300.0, "bias_m": 6.0},
        },
    )  # fmt: skip
    found = aiding_sources(plan, sinssim.fly(plan))
    by_name = {one.source.name: one for one in found.sources}
    assert found.tables == ("gnss", "baro")
    wanted = {
        "gnss_position_noise_ne": ("position noise, north and east", "gnss", "random", 2.0, "m"),
        "gnss_position_noise_d": ("position noise, d", "gnss", "random", 3.0, "m"),
        "gnss_velocity_noise": ("velocity noise", "gnss", "random", 0.07, "m/s"),
        "baro_noise": ("noise", "baro", "random", 1.5, "m"),
        "baro_bias": ("bias", "baro", "random", 8.0, "m"),
        "baro_scale": ("scale", "baro", "random", 300.0, "ppm"),
    }
    given = {name for name in by_name if name.endswith("_given")}
    assert given == {"gnss_position_given", "gnss_velocity_given", "baro_given"}
    for name in given:
        assert isinstance(by_name[name], SensorGiven)
        assert told(by_name[name].source)[1:4] == ("errors equal in every run", name.split("_")[0], "given")
    random = {name: told(one.source)[1:] for name, one in by_name.items() if name not in given}
    random["gnss_position_noise_d"] = (random["gnss_position_noise_d"][0].replace("down", "d"),
                                       *random["gnss_position_noise_d"][1:])  # fmt: skip
    assert random == wanted
    noise, process, scale = by_name["gnss_position_noise_ne"], by_name["baro_bias"], by_name["baro_scale"]
    assert isinstance(noise, SensorNoise)
    assert (noise.label, noise.sigma.tolist()) == ("gnss-position", [2.0, 2.0, 0.0])
    assert isinstance(process, SensorProcess)
    assert (process.block, process.sigma.tolist(), process.correlation_time) == ("baro bias", [8.0], 900.0)
    assert isinstance(scale, SensorConstant)
    assert (scale.block, scale.sigma.tolist()) == ("baro scale", [pytest.approx(3e-4)])
    assert {name: sizes.tolist() for name, sizes in found.blocks.items()} == {
        "baro bias": [8.0], "baro scale": [pytest.approx(3e-4)],
    }  # fmt: skip
    altimeter = next(m for m in found.measurements if m.label == "baro")
    height = sinssim.fly(plan).state(altimeter.time).height
    assert altimeter.value[:, 0] == pytest.approx(height * (1.0 + 120e-6) + 6.0, rel=1e-12)
    assert np.asarray(altimeter.sigma).ravel().tolist() == [1.5] * len(altimeter.time)


def test_a_heading_reads_in_minutes_of_arc() -> None:
    """Two antennas: 0.25° are 15', 0.1° are 6'."""
    plan = scenario(parked=STANDING, filter={}, aiding={
        "dual_antenna": {"rate_hz": 0.5, "sigma_deg": 0.25, "bias_sigma_deg": 0.1},
    })  # fmt: skip
    found = [told(one.source) for one in aiding_sources(plan, sinssim.fly(plan)).sources]
    assert [one[4:] for one in found if one[3] == "random"] == [
        (pytest.approx(15.0, rel=1e-9), "arcmin"),
        (pytest.approx(6.0, rel=1e-9), "arcmin"),
    ]


def test_a_standstill_reads_zero_in_deg_per_hour() -> None:
    plan = scenario(
        parked=STANDING,
        navigation={"vertical": "free"},
        filter={},
        aiding={
            "zero_rate": {"rate_hz": 0.5, "sigma_deg_h": 4.0},
            "zero_velocity": {"rate_hz": 0.5, "sigma_mps": 0.03},
        },
    )
    found = aiding_sources(plan, sinssim.fly(plan))
    noises = {one.source.name: told(one.source)[4:] for one in found.sources if isinstance(one, SensorNoise)}
    assert noises == {"zero_rate_noise": (4.0, "deg/h"), "zero_velocity_noise": (0.03, "m/s")}
    assert all(not m.value.any() for m in found.measurements)


def correlation(order: int, b: float, distance: float) -> float:
    """Return the correlation of a Gauss-Markov process of the second or third order at a distance."""
    x = b * distance
    return math.exp(-x) * (1.0 + x + (order - 2.0) * x * x / 3.0)


@pytest.mark.parametrize("order", [2, 3])
def test_gravity_along_the_way(order: int) -> None:
    """Values before and after steps of 700 m have the closed correlations; the mean is that of both ends."""
    model = RemainderModel(order, (1.0, 1.0, 1.0), 4000.0)
    process = AlongWay(model)
    step, start = process.step(700.0), process.start
    after: Array = step.keep @ start @ step.keep.T + step.fresh @ step.fresh.T
    np.testing.assert_allclose(after, start, rtol=1e-9, atol=1e-18)
    one, two = correlation(order, model.beta, 700.0), correlation(order, model.beta, 1400.0)
    assert start[0, 0] == pytest.approx(1.0)
    assert (step.keep @ start)[0, 0] == pytest.approx(one, rel=1e-9)
    assert (step.keep @ step.keep @ start)[0, 0] == pytest.approx(two, rel=1e-9)
    mean = step.mean_of_state @ start @ step.mean_of_state + step.mean_of_fresh @ step.mean_of_fresh
    assert mean == pytest.approx(0.5 * (1.0 + one), rel=1e-9)
    assert process.value.tolist() == [1.0, 0.0, 0.0][:order]


def test_the_sum_of_white_noise() -> None:
    """Over 4 s: the sum grows by 4, the mean has the variance ¼, and both are the same number."""
    step = Sum().step(4.0)
    assert (step.keep.tolist(), step.fresh.tolist()) == ([[1.0]], [[2.0]])
    assert (step.mean_of_state.tolist(), step.mean_of_fresh.tolist()) == ([0.0], [0.5])


def test_the_size_of_a_sensors_error_is_its_largest_component() -> None:
    """Constants in one source, of 3 m; a scale factor in ppm; what the filter alone has, and what is zero, is none."""
    sensor: Any = SimpleNamespace(states=lambda: (
        SensorState("gnss-position bias", (1.0, 3.0, 2.0)), SensorState("baro scale", (2e-4,)),
        SensorState("airspeed wind", (5.0, 5.0), drawn=False), SensorState("baro bias", (0.0,)),
    ))  # fmt: skip
    kinds = {"gnss-position": "gnss-position", "baro": "baro-height"}
    position, scale = error_sources._states("gnss", sensor, kinds)
    assert (position.source.value, position.source.unit, position.source.label) == (3.0, "m", "position bias")
    assert (scale.source.value, scale.source.unit) == (200.0, "ppm")
    assert position.sigma.tolist() == [1.0, 3.0, 2.0]
