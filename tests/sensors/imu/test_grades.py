"""The table of grades against numbers worked out by hand, and the section that a scenario file fills."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from pydantic import ValidationError

from sinssim.errors import InputError
from sinssim.sensors import GRADES, draw
from sinssim.sensors.imu.grades import GRADE_TABLE, TriadGrade, find_grade
from sinssim.sensors.imu.imu_section import Imu

ARCSEC = 4.84813681109536e-6
DEG_H = 4.84813681109536e-6
DEG_SQRT_H = 2.908882086657216e-4

# bias [deg/h], random walk [deg/√h], scale [ppm], bias [µg], random walk [m/s/√s], scale [ppm], misalignment [rad],
# gyro instability [deg/h]
TABLE = {
    "ideal": (0, 0, 0, 0, 0, 0, 0, 0),
    "laser-navigation": (0.0035, 0.002, 5, 25, 9.80665e-5, 100, 9.69627362219072e-6, 0),
    "laser-standard": (0.01, 0.003, 10, 50, 9.80665e-5, 50, 2.42406840554768e-5, 0),
    "tactical": (1, 0.125, 150, 1000, 3.333333333333333e-4, 300, 4.84813681109536e-4, 0),
    "mems-tactical": (0.5, 0.15, 500, 750, 1e-3, 300, 1e-3, 0),
    "mems-industrial": (25, 0.1, 1000, 2000, 1.666666666666667e-3, 1000, 1e-3, 2),
    "consumer": (200, 0.2, 10000, 10000, 3.333333333333333e-3, 10000, 1e-2, 10),
}


@pytest.mark.parametrize("name", TABLE)
def test_every_figure_of_the_table(name):
    bias, arw, scale, accel_bias, vrw, accel_scale, misalignment, instability = TABLE[name]
    grade = GRADE_TABLE[name]
    assert (grade.gyro.bias, grade.gyro.scale, grade.gyro.misalignment) == pytest.approx(
        (bias * DEG_H, scale * 1e-6, misalignment), rel=1e-13
    )
    assert (grade.gyro.random_walk, grade.gyro.instability) == pytest.approx(
        (arw * DEG_SQRT_H, instability * DEG_H), rel=1e-13
    )
    assert (grade.accel.bias, grade.accel.scale, grade.accel.misalignment) == pytest.approx(
        (accel_bias * 9.80665e-6, accel_scale * 1e-6, misalignment), rel=1e-13
    )
    assert (grade.accel.random_walk, grade.accel.instability) == pytest.approx((vrw, 0.0), rel=1e-13)


def test_the_names_and_a_sentence_and_a_source_each():
    assert set(GRADES) == set(TABLE)
    assert all(len(text.split()) > 3 for text in GRADES.values())
    assert all(grade.source for grade in GRADE_TABLE.values())
    assert GRADE_TABLE["ideal"].gyro == GRADE_TABLE["ideal"].accel == TriadGrade()


def test_units_worked_out_by_hand():
    section = Imu(
        grade="ideal",
        gyro_bias_deg_h=(0.01, -1.0, 15.0),
        gyro_scale_ppm=(10.0, -5.0, 0.5),
        gyro_misalignment_arcsec=(1.0, 2.0, 3.0, 4.0, 5.0, 3600.0),
        gyro_quadratic_ppm_per_deg_s=(1.0, 0.0, -10.0),
        gyro_cubic_ppm_per_deg2_s2=(0.0, 0.1, 0.0),
        gyro_arw_deg_sqrt_h=0.003,
        gyro_quantum_arcsec=1.0,
        gyro_instability_deg_h=2.0,
        gyro_correlation_time_s=300.0,
        accel_bias_ug=(50.0, -1000.0, 1e6),
        accel_scale_ppm=(50.0, 0.0, -300.0),
        accel_misalignment_arcsec=(0.0, 0.0, 0.0, 0.0, 0.0, -1.0),
        accel_quadratic_ug_per_g2=(10.0, 0.0, -1.0),
        accel_cubic_ug_per_g3=(0.0, 2.0, 0.0),
        accel_vrw_ug_sqrt_hz=10.0,
        accel_quantum_mm_s=2.5,
        accel_instability_ug=3.6,
        accel_correlation_time_s=60.0,
    )
    errors = draw(section)
    assert errors.gyro.bias == pytest.approx([4.848136811e-8, -4.848136811e-6, 7.272205217e-5], rel=1e-9)
    assert errors.gyro.scale == pytest.approx([1e-5, -5e-6, 5e-7], rel=1e-14)
    m = errors.gyro.misalignment
    assert [m[0, 1], m[0, 2], m[1, 0], m[1, 2], m[2, 0], m[2, 1]] == pytest.approx(
        [4.848136811e-6, 9.696273622e-6, 1.454441043e-5, 1.939254724e-5, 2.424068406e-5, 1.745329252e-2], rel=1e-9
    )
    assert m.diagonal() == pytest.approx([0, 0, 0], abs=0)
    assert errors.gyro.quadratic == pytest.approx([5.729577951e-5, 0.0, -5.729577951e-4], rel=1e-9)
    assert errors.gyro.cubic == pytest.approx([0.0, 3.282806350e-4, 0.0], rel=1e-9)
    assert errors.gyro.random_walk == pytest.approx(8.726646260e-7, rel=1e-9)
    assert errors.gyro.quantum == pytest.approx(4.848136811e-6, rel=1e-9)
    assert errors.gyro.instability == pytest.approx(9.696273622e-6, rel=1e-9)
    assert errors.gyro.correlation_time == 300.0
    assert errors.accel.bias == pytest.approx([4.903325e-4, -9.80665e-3, 9.80665], rel=1e-14)
    assert errors.accel.scale == pytest.approx([5e-5, 0.0, -3e-4], rel=1e-14)
    assert errors.accel.misalignment[2, 1] == pytest.approx(-4.848136811e-6, rel=1e-9)
    assert errors.accel.quadratic == pytest.approx([1.019716213e-6, 0.0, -1.019716213e-7], rel=1e-9)
    assert errors.accel.cubic == pytest.approx([0.0, 2.0796432e-8, 0.0], rel=1e-7)
    assert errors.accel.random_walk == pytest.approx(9.80665e-5, rel=1e-14)
    assert errors.accel.quantum == pytest.approx(2.5e-3, rel=1e-14)
    assert errors.accel.instability == pytest.approx(3.530394e-5, rel=1e-14)
    assert errors.accel.correlation_time == 60.0


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"grade": "laser-standrd"}, "Did you mean 'laser-standard'.*Known: consumer, ideal"),
        ({"rate_hz": 0}, "greater than 0"),
        ({"rate_hz": -100.0}, "greater than 0"),
        ({"rate_hz": float("inf")}, "finite"),
        ({"rate_hz": "100"}, "valid number"),
        ({"rate_hz": True}, "valid number"),
        ({"gyro_bias_sigma_deg_h": -0.01}, "greater than or equal to 0"),
        ({"gyro_bias_deg_h": 0.01}, "one number per axis.*gyro_bias_sigma_deg_h"),
        ({"accel_misalignment_arcsec": 5}, "one number per axis.*accel_misalignment_sigma_arcsec"),
        ({"gyro_bias_deg_h": [0.01, 0.0]}, "Field required"),
        ({"gyro_bias_deg_h": [0.01, 0.0, float("nan")]}, "finite"),
        ({"gyro_bias_deg_h": [0.0, 0.0, 0.0], "gyro_bias_sigma_deg_h": -1.0}, "greater than or equal to 0"),
        ({"gyro_bias": [0.0, 0.0, 0.0]}, "Extra inputs"),
        ({"gyro_correlation_time_s": 0.0}, "greater than 0"),
        ({"lever_arm_m": [1.0, 2.0]}, "Field required"),
    ],
)
def test_what_the_section_refuses(data, message):
    with pytest.raises(ValidationError, match=f"(?s){message}"):
        Imu.model_validate(data)


def test_what_the_section_takes_and_keeps():
    section = Imu.model_validate(
        {"grade": "tactical", "rate_hz": 200, "lever_arm_m": [1, 0, -0.5], "mounting_deg": [0.0, 2.0, 180.0]}
    )
    assert section.rate_hz == 200.0
    assert section.lever_arm_m == (1.0, 0.0, -0.5)
    assert section.mounting_deg == (0.0, 2.0, 180.0)
    assert Imu().lever_arm_m is None
    assert Imu().mounting_deg is None
    with pytest.raises(ValidationError):
        section.rate_hz = 100.0


def test_mean_and_sigma_of_one_error():
    """The errors of one seed are the mean plus the errors of that seed without a mean; a mean alone has no spread."""
    mean, spread = (0.02, -0.01, 0.005), 0.01
    for seed in range(5):
        both = draw(Imu(grade="ideal", gyro_bias_deg_h=mean, gyro_bias_sigma_deg_h=spread), seed).gyro.bias
        about_zero = draw(Imu(grade="ideal", gyro_bias_sigma_deg_h=spread), seed).gyro.bias
        np.testing.assert_array_equal(both, np.radians(mean) / 3600.0 + about_zero)
        alone = draw(Imu(grade="laser-standard", gyro_bias_deg_h=mean), seed).gyro.bias
        np.testing.assert_allclose(alone, np.radians(mean) / 3600.0, rtol=1e-15)
    keys = {"accel_misalignment_arcsec": (1.0, 2.0, 3.0, 4.0, 5.0, 6.0), "accel_misalignment_sigma_arcsec": 2.0}
    section = Imu(grade="ideal", **keys)
    drawn = np.array([draw(section, seed).accel.misalignment for seed in range(800)]) * 180.0 / np.pi * 3600.0
    assert not drawn[:, range(3), range(3)].any()
    off = drawn[:, ~np.eye(3, dtype=bool)]
    # six means within 4.5 σ/√800 and six spreads within 4.5 σ/√1600: 8e-5 by chance
    np.testing.assert_allclose(off.mean(axis=0), [1, 2, 3, 4, 5, 6], rtol=0, atol=4.5 * 2.0 / 800**0.5)
    np.testing.assert_allclose(off.std(axis=0), 2.0, rtol=4.5 / 1600**0.5)


def test_unknown_grade_by_name():
    with pytest.raises(InputError, match="unknown IMU grade 'lasre-standard'"):
        find_grade("lasre-standard")


def test_the_list_of_grades_needs_no_compiler():
    code = "import sys, sinssim.sensors; sys.exit('numba' in sys.modules or 'scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
