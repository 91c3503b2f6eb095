"""The inputs of a calibration and its parameters: names, units, sizes, nominal attitudes and axes, by hand."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.analyses.calibration_problem import (
    Estimate,
    Solution,
    errors_of,
    make_task,
    noise_of,
    parameters,
    values_of,
)
from sinssim.analyses.calibration_result import CalibrationResult, compensation_text
from sinssim.analyses.separate_calibration import _first_trust
from sinssim.analyses.systematic_calibration import _coarse, _levelled, arm_pull, linearise, steps
from sinssim.analyses.turntable_calibration import _remarks, calibrate
from sinssim.analyses.turntable_dwells import Dwells, planned
from sinssim.data import ImuData
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.scenario import Scenario
from sinssim.scenario.true_motion import fly
from sinssim.sensors.imu.compensation import compensate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.units import ARCSEC, DEG_H, G0, PPM, UG
from tests.analyses.calibration.draws import scenario

PAIRS = ("xy", "xz", "yx", "yz", "zx", "zy")
UNITS = {"gyro bias": ("deg/h", DEG_H), "gyro scale": ("ppm", PPM), "gyro misalignment": ("arcsec", ARCSEC),
         "accel bias": ("µg", UG), "accel scale": ("ppm", PPM), "accel misalignment": ("arcsec", ARCSEC),
         "accel arm": ("mm", 1e-3)}  # fmt: skip
NAMES = [f"{triad} {what} {axis}" for triad in ("gyro", "accel")
         for what, axes in (("bias", "xyz"), ("scale", "xyz"), ("misalignment", PAIRS)) for axis in axes]  # fmt: skip
NOTHING = ImuData(np.arange(3.0), np.zeros((2, 3)), np.zeros((2, 3)))


def test_names_units_and_sizes() -> None:
    """The size is the root mean square of given errors and 1σ; a block without errors has those of a laser system."""
    section = Imu(
        grade="ideal", gyro_bias_deg_h=(1.0, -2.0, 2.0), gyro_bias_sigma_deg_h=4.0, accel_scale_sigma_ppm=7.0,
        gyro_misalignment_arcsec=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), accel_arms_mm=((1.0, 2.0, -30.0),) * 3,
    )  # fmt: skip
    both = parameters(section, "separate", arms=True)
    places = [f"accel arm {axis}{coordinate}" for axis in "yz" for coordinate in "xyz"]
    assert [one.name for one in both] == NAMES + places
    sizes = {"gyro bias": np.sqrt(3.0 + 16.0), "gyro scale": 10.0, "gyro misalignment": np.sqrt(91.0 / 6.0),
             "accel bias": 50.0, "accel scale": 7.0, "accel misalignment": 5.0, "accel arm": 30.0}  # fmt: skip
    for one in both:
        kind = one.name.rsplit(" ", 1)[0]
        assert one.unit == (UNITS[kind][0], pytest.approx(UNITS[kind][1], rel=1e-12))
        assert one.size == pytest.approx(sizes[kind] * UNITS[kind][1], rel=1e-12)
    assert parameters(Imu(), "systematic", arms=True)[-1].size == 0.01
    left = [
        name
        for name in NAMES
        if name not in ("accel misalignment xy", "accel misalignment xz", "accel misalignment yz")
    ]
    assert [one.name for one in parameters(section, "systematic")] == left


def test_values_and_errors_of_a_block() -> None:
    known = parameters(Imu(), "separate", arms=True)
    values = np.arange(1.0, 31.0)
    errors = errors_of(known, values)
    np.testing.assert_array_equal(errors.gyro.bias, [1, 2, 3])
    np.testing.assert_array_equal(errors.gyro.scale, [4, 5, 6])
    np.testing.assert_array_equal(errors.gyro.misalignment, [[0, 7, 8], [9, 0, 10], [11, 12, 0]])
    np.testing.assert_array_equal(errors.accel.bias, [13, 14, 15])
    np.testing.assert_array_equal(errors.accel.scale, [16, 17, 18])
    np.testing.assert_array_equal(errors.accel.misalignment, [[0, 19, 20], [21, 0, 22], [23, 24, 0]])
    np.testing.assert_array_equal(errors.arms, [[0, 0, 0], [25, 26, 27], [28, 29, 30]])
    # places are those from the forward accelerometer
    moved = replace(errors, arms=errors.arms + np.array([0.5, -0.25, 2.0]))
    np.testing.assert_allclose(values_of(known, moved), values)


def test_noise_and_what_is_not_modelled() -> None:
    section = Imu(grade="ideal", gyro_arw_deg_sqrt_h=0.3, gyro_instability_deg_h=0.2,
                         gyro_correlation_time_s=70.0, gyro_quantum_arcsec=3.0, accel_vrw_ug_sqrt_hz=40.0,
                         accel_flicker_ug=2.0, accel_rrw_ug_sqrt_h=5.0)  # fmt: skip
    gyro, accel = noise_of(section, "gyro"), noise_of(section, "accel")
    found = (gyro.white, gyro.instability, gyro.correlation_time, gyro.quantum)
    assert found == pytest.approx((np.radians(0.3) / 60.0, 0.2 * DEG_H, 70.0, 3.0 * ARCSEC), rel=1e-12)
    assert gyro.untold == ()
    assert (accel.white, accel.instability, accel.quantum) == (pytest.approx(40.0 * UG, rel=1e-12), 0.0, 0.0)
    assert len(accel.untold) == 2


def table(**more: Any) -> Scenario:
    turns = [{"axis": [0.0, 0.0, 2.0], "angle_deg": 90.0}, {"axis": [0.0, -3.0, 0.0], "angle_deg": 30.0}]
    calibrated = {"method": "systematic", "interval_s": 2.0, **more.pop("calibration", {})}
    return scenario(
        "systematic", None, turns=turns, heading_deg=40.0, roll_deg=10.0, pitch_deg=-20.0, latitude_deg=-35.0,
        altitude_m=700.0, position_sigma_arcsec=3.0, tilt_sigma_arcsec=7.0, calibration=calibrated, **more,
    )  # fmt: skip


def test_the_task_of_a_scenario() -> None:
    described = table(imu={"mounting_deg": [5.0, 15.0, 25.0]})
    dwells = Dwells(np.array([[0, 1]]))
    task = make_task(described, described.calibration, NOTHING, dwells)
    first, mounting = (
        Rotation.from_euler("ZYX", list(angles), degrees=True) for angles in ((40, -20, 10), (25, 15, 5))
    )
    turned = Rotation.from_rotvec([0.0, 0.0, np.pi / 2.0])
    nosed = Rotation.from_rotvec([0.0, -np.pi / 6.0, 0.0])
    for k, vehicle in enumerate((first, first * turned, first * turned * nosed)):
        q = Rotation.from_quat(task.attitude[k], scalar_first=True)
        assert (q.inv() * vehicle * mounting).magnitude() < 1e-12
    np.testing.assert_allclose(task.axis, mounting.inv().apply([[0, 0, 1.0], [0, -1.0, 0]]), rtol=0, atol=1e-12)
    np.testing.assert_allclose(task.angle, np.radians([90.0, 30.0]))
    south = np.radians(35.0)
    np.testing.assert_allclose(task.earth_rate, OMEGA_IE * np.array([np.cos(south), 0.0, np.sin(south)]), rtol=1e-12)
    assert task.force[2] == pytest.approx(-9.79527, abs=1e-4)  # Somigliana at 35° less 3.086e-6 × 700
    assert (task.position_sigma, task.tilt_sigma) == pytest.approx((3.0 * ARCSEC, 7.0 * ARCSEC))
    np.testing.assert_array_equal(task.size, [one.size for one in task.known])
    assert len(task.known) == 21
    own = table(calibration={"position_sigma_arcsec": 11.0, "tilt_sigma_arcsec": 0.0},
                imu={"accel_arms_mm": [[0, 0, 0], [1, 2, 3], [4, 5, 6]]})  # fmt: skip
    task = make_task(own, own.calibration, NOTHING, dwells)
    assert (task.position_sigma, task.tilt_sigma, len(task.known)) == (pytest.approx(11.0 * ARCSEC), 0.0, 27)


def test_steps_of_the_filter() -> None:
    """Dwells in steps of 2 s, turns of at most 1 s, at 2 Hz."""
    time = 3.0 + 0.5 * np.arange(41)
    task: Any = SimpleNamespace(
        imu=SimpleNamespace(time=time), dwells=Dwells(np.array([[0, 12], [16, 32]])),
        section=SimpleNamespace(interval_s=2.0),
    )  # fmt: skip
    ends, observed = steps(task)
    assert ends.tolist() == [4, 8, 12, 14, 16, 20, 24, 28, 32]
    assert observed.tolist() == [True, True, True, False, False, True, True, True, True]


def test_places_in_a_turn_that_becomes_faster() -> None:
    """About down: −ω²T along the radius and α T across it, by the rate in the middle of the interval."""
    edges = np.array([0.0, 0.2, 0.4, 0.6])
    rate = 0.3 + 0.5 * (edges[1:] + edges[:-1]) * 1.5
    dtheta = np.column_stack([np.zeros((3, 2)), rate * 0.2])
    found = arm_pull(ImuData(edges, dtheta, np.zeros((3, 3))))[1]  # accelerometer, coordinate of its place
    expected = 0.2 * np.array([[-(rate[1] ** 2), -1.5, 0.0], [1.5, -(rate[1] ** 2), 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)


def test_coarse_biases_and_levelling() -> None:
    described = table(imu={"grade": "ideal", "gyro_bias_sigma_deg_h": 2.0})
    dwells = Dwells(np.array([[0, 4], [6, 9], [11, 15]]))
    time = np.arange(16.0) * 0.5
    task = make_task(described, described.calibration, ImuData(time, np.zeros((15, 3)), np.zeros((15, 3))), dwells)
    dtheta, bias = np.ones((15, 3)), np.array([0.1, -0.2, 0.3])
    for (a, b), q, wander in zip(dwells.rows, task.attitude, (0.01, -0.03, 0.02), strict=True):
        earth = Rotation.from_quat(q, scalar_first=True).inv().apply(task.earth_rate)
        dtheta[a:b] = (earth + bias + wander) * 0.5
    values = _coarse(replace(task, imu=ImuData(time, dtheta, np.zeros((15, 3)))))
    np.testing.assert_allclose(values[:3], bias, rtol=1e-12)
    assert not values[3:].any()
    fine = make_task(table(), described.calibration, task.imu, dwells)
    assert not _coarse(replace(fine, imu=ImuData(time, dtheta, np.zeros((15, 3))))).any()

    tilted = Rotation.from_rotvec([0.03, -0.02, 0.0]) * Rotation.from_quat(task.attitude[0], scalar_first=True)
    dvel = np.full((15, 3), 9.0)
    dvel[:4] = 0.5 * tilted.inv().apply(task.force)
    q = _levelled(task, ImuData(time, dtheta, dvel))
    assert (Rotation.from_quat(q, scalar_first=True) * tilted.inv()).magnitude() < 1e-5  # gravity is 8e-6 rad off down


def result(method: str = "separate", scale: float = 1.0, arms: bool = False) -> CalibrationResult:
    """Values 1, 2, 3 … and 1σ 0.1, 0.2 … in the units of each parameter; the last one is not observable."""
    asymmetry = {"gyro_asymmetry_ppm": [40.0] * 3, "gyro_asymmetry_sigma_ppm": 30.0}
    described = scenario(method, "six-positions", imu={**asymmetry, "accel_delay_ms": 2.0})
    known = parameters(described.imu, method, arms=arms)
    unit, number = np.array([one.unit[1] for one in known]), np.arange(1.0, len(known) + 1.0)
    seen = number < len(known)
    solution = Solution(
        number, np.diag((0.1 * number * unit) ** 2), number, np.eye(len(known)), len(known) - 1, seen, 30.0 * scale, 20
    )
    estimate = Estimate(number * unit, solution, 3, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    truth = (number - 0.2 * number) * unit
    return CalibrationResult(described, method, known, estimate, np.zeros((1, 2)), truth, ())


def test_the_compensation_file_says_what_was_found() -> None:
    one = result()
    text = compensation_text(one)
    lines = text.split("\n")
    assert lines[:5] == [
        "# Calibration of c by the separate method.",
        "# Misalignments refer to the axes of the table's positions, in which [turntable] gives attitudes and turns.",
        '# Use: [compensation] with file = "compensation.toml", or paste this table.',
        "# Not determined by the sequence, therefore 0 with their former 1σ:",
        "#   accel misalignment zy",
    ]
    found = tomllib.loads(text)["compensation"]
    at = 0
    for triad in ("gyro", "accel"):
        for what, unit in (
            ("bias", "deg_h" if triad == "gyro" else "ug"),
            ("scale", "ppm"),
            ("misalignment", "arcsec"),
        ):
            numbers = np.arange(at + 1.0, at + (7.0 if what == "misalignment" else 4.0))
            at += len(numbers)
            assert found.pop(f"{triad}_{what}_{unit}") == pytest.approx(list(numbers), rel=1e-8)
            sigma = 0.1 * np.sqrt(np.mean(numbers**2))
            assert found.pop(f"{triad}_{what}_sigma_{unit}") == pytest.approx(sigma, rel=1e-8)
    assert found.pop("gyro_asymmetry_sigma_ppm") == 50.0  # 40 ppm in every run, 30 ppm at random
    assert all(value == 0.0 or not any(value) for value in found.values())


def test_errors_and_their_chi_square() -> None:
    """Each error is two of its 1σ: 4 for each of the 23 parameters that are observable."""
    one = result()
    unit = np.array([p.unit[1] for p in one.parameters])
    np.testing.assert_allclose(one.error, 0.2 * np.arange(1.0, 25.0) * unit)
    np.testing.assert_allclose(one.sigma, 0.1 * np.arange(1.0, 25.0) * unit)
    np.testing.assert_allclose(one.normalised_error, 2.0)
    assert one.chi_square_of_errors == (pytest.approx(92.0), 23)
    assert replace(one, truth=None).chi_square_of_errors is None
    none = replace(one.estimate.solution, observable=np.zeros(24, dtype=bool))
    assert replace(one, estimate=replace(one.estimate, solution=none)).chi_square_of_errors == (0.0, 0)


def test_rounding_of_the_velocity_has_a_twelfth_of_a_squared_pulse() -> None:
    """A pulse of 6 mm/s, as a sway of 6 mm/s/√12; the larger of the table's errors makes readings less trusted."""
    described = table()
    ideal = fly(described).increments(20.0)
    task = make_task(described, described.calibration, ideal, planned(described.turntable, ideal.time))
    ends, observed = steps(task)
    found = [
        linearise(
            replace(task, accel=replace(task.accel, quantum=quantum),
                    section=task.section.model_copy(update={"velocity_sigma_mm_s": sway})),
            ideal, task.attitude[0], ends, observed,
        )[0]
        for quantum, sway in ((6e-3, 1e-6), (0.0, 6.0 / np.sqrt(12.0)))
    ]  # fmt: skip
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9, atol=1e-12)
    white = [1e9 * np.eye(2), 2e6 * np.eye(2)]
    level = (7.0 * ARCSEC) ** 2  # of the tilt; the positions have 3″
    longest = float(np.diff(task.dwells.seconds(ideal.time)).max())
    beyond = level * max(2.0 * np.pi * 1e9, np.linalg.norm(task.force) * longest * 2e6)
    assert _first_trust(task, white) == pytest.approx(1.0 / beyond)
    assert _first_trust(task, [1e-3 * w for w in white]) == 1.0


def test_remarks() -> None:
    """χ²/20 of 1.5 is within 99.9 %, 2.5 and 0.2 are not; too small a value is remarked for a log alone."""
    left = "Not modelled by the calibration, and therefore in its residuals: gyro asymmetry, accelerometer delay."
    for scale, of_log, words in (
        (1.0, False, None),
        (1.65, False, "larger than the stated noise explains: χ² = 49.5 with 20"),
        (0.13, False, None),
        (0.13, True, "smaller than the stated noise: χ² = 3.9 with 20"),
    ):
        one = result(scale=scale)
        described: Any = SimpleNamespace(imu=one.scenario.imu, log="log" if of_log else None)
        task: Any = SimpleNamespace(
            known=one.parameters, gyro=noise_of(one.scenario.imu, "gyro"), accel=noise_of(one.scenario.imu, "accel")
        )
        first, *others = _remarks(described, task, one)
        assert first == left
        assert len(others) == (words is not None)
        assert words is None or words in others[0]


def test_residuals_are_mean_readings_less_the_ideal_ones() -> None:
    """Dwells and turns in the order of time, on a table without errors."""
    described = scenario("separate", "six-positions-and-rates", seed=5, dwell_s=5.0)
    found = calibrate(described)
    ideal = fly(described).increments(20.0)
    from sinssim.sensors.imu.emulation import emulate

    own = compensate(emulate(ideal, described.imu, 5), errors_of(found.parameters, found.values))
    edges = np.searchsorted(ideal.time, found.dwells)
    turns = np.column_stack([edges[:-1, 1], edges[1:, 0]])
    every = np.concatenate([edges, turns])
    every = every[np.argsort(every[:, 0])]
    assert len(every) == 23
    for rows, values, name in (
        (every, found.estimate.residual_gyro, "dtheta"),
        (edges, found.estimate.residual_accel, "dvel"),
    ):
        difference = getattr(own, name) - getattr(ideal, name)
        expected = [difference[a:b].sum(axis=0) / (ideal.time[b] - ideal.time[a]) for a, b in rows]
        size = np.abs(expected).max()
        assert size < 1e-3 * G0
        np.testing.assert_allclose(values, expected, rtol=0, atol=1e-3 * size)
    assert np.sum(found.estimate.normalised**2) == pytest.approx(found.estimate.solution.chi_square, rel=1e-3)


def test_the_compensation_file_gives_the_arm_of_each_accelerometer_in_a_row() -> None:
    """The systematic method's arms, each other: accelerometer x is first, its forward, right and down place."""
    one = result("systematic", arms=True)
    arms = errors_of(one.parameters, one.estimate.values).arms
    assert len(np.unique(arms)) > 3
    rows = tomllib.loads(compensation_text(one))["compensation"]["accel_arms_mm"]
    np.testing.assert_allclose(rows, 1e3 * arms, rtol=1e-6)


def test_the_table_in_a_notebook() -> None:
    """Values 1, 2 … with 1σ 0.1, 0.2 … in the unit of each parameter; the last one of 24 is not observable."""
    page = result()._repr_html_()
    assert "Calibration of c, separate" in page
    cells = [re.findall(r">([^<]+)</t[hd]>", row) for row in page.split("<tr>")[1:]]
    assert cells[0] == ["parameter", "estimate", "1σ", "unit"]
    assert cells[1] == ["gyro bias x", "1", "0.1", "deg/h"]
    assert cells[4] == ["gyro scale x", "4", "0.4", "ppm"]
    assert cells[24] == ["accel misalignment zy", "not observable", "2.4", "arcsec"]
