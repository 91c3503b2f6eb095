"""Units against exact numbers, written out: NIST Special Publication 811, appendix B, and the definitions."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from sinssim import units
from sinssim.analyses.noise_report import UNITS
from sinssim.logs.column_names import UNITS_OF
from sinssim.sensors.imu.datasheet_lines import to_si
from sinssim.statistics.circular_error import to_nmi_h

ARCSEC = 4.848136811095360e-6  # rad
SQRT_H = 60.0  # root of an hour [√s]
G = Fraction("9.80665")  # m/s²


@pytest.mark.parametrize(
    ("unit", "exact"),
    [
        (units.ARCSEC, ARCSEC),
        (units.ARCMIN, 2.908882086657216e-4),
        (units.DEG, 1.745329251994330e-2),
        (units.DEG_H, ARCSEC),  # a degree per hour is a second of arc per second
        (units.DEG_SQRT_H, 1.745329251994330e-2 / SQRT_H),
        (units.MPS_SQRT_H, 1.0 / SQRT_H),
        (units.UG, float(G / 10**6)),
        (units.KNOT, float(Fraction(1852, 3600))),
        (units.LENGTHS["ft"], 0.3048),
        (units.LENGTHS["nmi"], 1852.0),
        (units.SPEEDS["nmi/h"], float(Fraction(1852, 3600))),
        (units.SPEEDS["km/h"], float(Fraction(1000, 3600))),
        (units.SPEEDS["ft/s"], 0.3048),
        (units.SPEEDS["m/h"], float(Fraction(1, 3600))),
        (units.ANGLES['"'], ARCSEC),
        (units.ANGLES["'"], 60.0 * ARCSEC),
        (units.ANGLES["mrad"], 1e-3),
    ],
)
def test_constants(unit: float, exact: float) -> None:
    assert unit == pytest.approx(exact, rel=1e-15)


@pytest.mark.parametrize(
    ("key", "exact"),
    [
        ("gyro_bias_deg_h", ARCSEC),
        ("gyro_bias_mdeg_s", 3.6 * ARCSEC),
        ("gyro_arw_deg_sqrt_h", 60.0 * ARCSEC),
        ("gyro_arw_deg_h_sqrt_hz", ARCSEC),
        ("gyro_arw_mdeg_s_sqrt_hz", 3.6 * ARCSEC),
        ("gyro_rrw_deg_h_sqrt_h", ARCSEC / SQRT_H),
        ("gyro_scale_percent", 1e-2),
        ("gyro_scale_ppm", 1e-6),
        ("gyro_misalignment_arcmin", 60.0 * ARCSEC),
        ("gyro_g_sensitivity_deg_h_per_g", ARCSEC / float(G)),
        ("accel_bias_mg", float(G / 1000)),
        ("accel_vrw_ug_sqrt_hz", float(G / 10**6)),
        ("accel_vrw_mps_sqrt_h", 1.0 / SQRT_H),
        ("accel_vrw_ftps_sqrt_h", 0.3048 / SQRT_H),
        ("accel_rrw_ug_sqrt_h", float(G / 10**6) / SQRT_H),
        ("accel_quantum_mm_s", 1e-3),
    ],
)
def test_lines_of_data_sheets(key: str, exact: float) -> None:
    assert to_si(key, 1.0) == pytest.approx(exact, rel=2e-15)


def test_terms_of_allan_deviations() -> None:
    gyro = {"Q": ARCSEC, "N": 60.0 * ARCSEC, "B": ARCSEC, "K": ARCSEC / 60.0, "R": ARCSEC / 3600.0, "sigma_b": ARCSEC}
    ug = 9.80665e-6
    accel = {"Q": 1e-3, "N": ug, "B": ug, "K": ug / 60.0, "R": ug / 3600.0, "sigma_b": ug}
    for triad, exact in (("gyro", gyro), ("accel", accel)):
        assert {name: size for name, (_, size) in UNITS[triad].terms.items()} == pytest.approx(exact, rel=1e-15)


def test_rates_in_nautical_miles_an_hour() -> None:
    assert float(to_nmi_h(1.0)) == pytest.approx(float(Fraction(3600, 1852)), rel=1e-15)
    assert math.isclose(float(to_nmi_h(units.KNOT)), 1.0, rel_tol=1e-15)


@pytest.mark.parametrize(
    ("dimension", "unit", "exact"),
    [("length", "mm", 0.001), ("length", "cm", 0.01), ("speed", "mm/s", 0.001), ("speed", "cm/s", 0.01),
     ("angle", "1e-7 deg", 1.7453292519943295e-9)],
)  # fmt: skip
def test_units_of_recorded_fixes(dimension: str, unit: str, exact: float) -> None:
    assert UNITS_OF[dimension][unit] == pytest.approx(exact, rel=1e-15)
