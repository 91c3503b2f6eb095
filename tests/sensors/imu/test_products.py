"""The grades of real products: source, class, and the numbers of two of them worked out by hand."""

from __future__ import annotations

import math
import re
import tomllib

import pytest

from sinssim.content import list_content
from sinssim.sensors.imu.grades import GRADE_TABLE, Grade, find_grade
from sinssim.sensors.imu.imu_section import Imu
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, MPS_SQRT_H, PPM, UG

PRODUCTS = list_content("grades")


def test_there_are_twenty_and_none_hides_a_grade_of_the_table() -> None:
    assert len(PRODUCTS) >= 20
    assert not set(PRODUCTS) & set(GRADE_TABLE)


@pytest.mark.parametrize("name", PRODUCTS)
def test_source_and_comments(name: str) -> None:
    text = PRODUCTS[name].read_text(encoding="utf-8")
    data = tomllib.loads(text)
    assert re.search(r"data ?sheet|brochure|specification sheet|leaflet|documentation|table", data["source"])
    assert re.search(r"revision|N61|20\d\d|undated|NAVIGATION|Luxonis|commit", data["source"])
    assert len(data["description"].split()) > 3
    for line in text.splitlines():  # every number has the data sheet's line beside it
        if re.match(r"(gyro|accel)_", line):
            key, value, comment = re.split(r" = |  # ", line)
            if "flicker" not in key:
                beside = re.search(rf"(?<![\d.]){re.escape(value)}(?![\d.])", comment)
                assert beside or comment.startswith("the same line"), line


@pytest.mark.parametrize("name", PRODUCTS)
def test_numbers_are_of_their_class(name: str) -> None:
    grade: Grade = find_grade(name)
    gyro, accel = grade.gyro, grade.accel
    limits = {
        "gyro random walk": (gyro.random_walk / DEG_SQRT_H, 0.001, 1.0),
        "gyro bias": (gyro.bias / DEG_H, 0.001, 3600.0),
        "gyro scale": (gyro.scale / PPM, 1.0, 2e4),
        "gyro misalignment": (gyro.misalignment / ARCSEC, 1.0, 3600.0),
        "gyro flicker": (gyro.others.get("flicker", 0.0) / DEG_H, 0.1, 20.0),
        "gyro range": (math.degrees(gyro.others.get("limit", 0.0)), 100.0, 4001.0),
        "accel random walk": (accel.random_walk / UG, 5.0, 300.0),
        "accel bias": (accel.bias / UG, 10.0, 1e5),
        "accel scale": (accel.scale / PPM, 10.0, 2e4),
        "accel flicker": (accel.others.get("flicker", 0.0) / UG, 1.0, 200.0),
        "accel range": (accel.others.get("limit", 0.0) / (1e6 * UG), 5.0, 50.0),
    }
    for what, (value, least, most) in limits.items():
        assert value == 0.0 or least <= value <= most, what
    assert gyro.random_walk > 0.0
    order = gyro.random_walk / DEG_SQRT_H
    if "navigation grade" in grade.description:
        assert order < 0.01
    elif "tactical" in grade.description:
        assert 0.03 < order <= 0.3
    assert Imu(grade=name).grade == name


def test_two_worked_out_by_hand() -> None:
    stim, hg = find_grade("stim300"), find_grade("hg1700")
    assert stim.gyro.random_walk == pytest.approx(0.15 * math.pi / 180.0 / 60.0, rel=1e-14)
    assert stim.gyro.others["flicker"] * 0.664 == pytest.approx(0.5 * DEG_H, rel=1e-3)
    assert stim.gyro.others["g_sensitivity"] == pytest.approx(DEG_H / 9.80665, rel=1e-14)
    assert (stim.accel.bias, stim.accel.random_walk) == pytest.approx((750.0 * UG, 0.06 * MPS_SQRT_H), rel=1e-14)
    assert hg.accel.random_walk == pytest.approx(0.065 * 0.3048 / 60.0, rel=1e-14)  # ft/s/√h
    assert hg.source.endswith("zero: gyro_scale, gyro_misalignment, accel_scale, accel_misalignment")


@pytest.mark.parametrize("name", [name for name in PRODUCTS if "flicker" in PRODUCTS[name].read_text("utf-8")])
def test_floors_are_divided_by_0664(name: str) -> None:
    for line in PRODUCTS[name].read_text(encoding="utf-8").splitlines():
        found = re.match(r"(\w+)_flicker_(\w+) = (\S+)  # in-run bias stability (?:\(.*\) )?([\d.]+) ([^ :,]+)", line)
        if "_flicker_" in line:
            assert found, line
            _, unit, value, floor, written = found.groups()
            factor = {"mg": 1e3, "µm/s²": 1e-6}.get(written, 1.0)
            assert float(value) * math.sqrt(2.0 * math.log(2.0) / math.pi) == pytest.approx(
                float(floor) * factor, rel=1.5e-3
            ), (line, unit)
