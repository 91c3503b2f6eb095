"""What the page of a budget is given for other sizes of the sources, from a budget whose every number is chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.error_budget import what_if as page
from sinssim.analyses.error_budget.error_sources import Source
from sinssim.sensors.imu.grades import find_grade
from sinssim.statistics.requirements import parse_requirement

TIME = np.array([0.0, 50.0, 100.0])
DRAWN = np.arange(243.0).reshape(3, 9, 9)
GIVEN = 1000.0 + np.arange(27.0).reshape(3, 9)
SOURCES = [
    Source("gyro_bias", "gyro bias", "gyros", "random", 0.5, "deg/h", "imu.gyro_bias_sigma_deg_h", (0.5, 0.75)),
    Source("gnss_lever", "lever arm", "gnss_position", "given", float("nan"), "m"),
    Source("turbulence", "turbulence", "flight", "one run", 2.0, "m/s", "flight.turbulence"),
]  # fmt: skip


def budget(solution: str = "inertial", *, aided: bool = True) -> Any:
    """Return a drawn source, a given one, and one without effect; rows 1 and 2 are in its table."""
    imu = SimpleNamespace(stated=lambda term: (np.zeros(3), np.zeros(3)))
    scenario = SimpleNamespace(name="trial", filter=object() if aided else None, imu=imu)
    rows = {50.0: 1, 100.0: 2}
    return SimpleNamespace(
        time=TIME, sources=SOURCES, covariance={"gyro_bias": DRAWN}, mean={"gnss_lever": GIVEN}, solution=solution,
        scenario=scenario, instants_to_rank=[100.0], row=rows.__getitem__, table_rows=lambda times: [1, 2],
    )  # fmt: skip


def answer(text: str) -> Any:
    return SimpleNamespace(requirement=parse_requirement(text))


def test_the_arrays_of_a_page() -> None:
    """Per source: north, north with east, east, or their means; then the squares, or means, of all nine in the rows."""
    texts = ("r95(run) <= 1 nmi", "velocity_east(50 s) <= 2 m/s", "heading(end) <= 3 arcmin", "rate(100 s) <= 1 nmi/h")
    plain, arrays = page.what_if(budget(), [answer(text) for text in texts], [50.0])
    assert arrays[0] is TIME
    drawn, given, none, required = arrays[1:5], arrays[5:9], arrays[9:13], arrays[13:]
    assert [a.tolist() for a in drawn[:3]] == [[0.0, 81.0, 162.0], [1.0, 82.0, 163.0], [10.0, 91.0, 172.0]]
    assert drawn[3].tolist() == [81.0 + 10.0 * k for k in range(9)] + [162.0 + 10.0 * k for k in range(9)]
    assert [a.tolist() for a in given] == [
        [1000.0, 1009.0, 1018.0], [1001.0, 1010.0, 1019.0], [], [*np.arange(1009.0, 1027.0)]]  # fmt: skip
    assert [a.tolist() for a in none] == [[0.0] * 3, [0.0] * 3, [], [0.0] * 18]
    assert [a.tolist() for a in required] == [[81.0 + 40.0], [1013.0], [0.0], [162.0 + 80.0], [1026.0], [0.0]]
    assert [r["rows"] for r in plain["requirements"]] == [[0, 1, 2], [1], [2], [2]]
    assert [r["component"] for r in plain["requirements"]] == [-1, 4, 8, -1]
    assert [r["share"] for r in plain["requirements"]] == [0.95, 0.0, 0.0, 0.95]
    assert [r["rate"] for r in plain["requirements"]] == [False, False, False, True]
    assert [r["text"] for r in plain["requirements"]] == list(texts)
    assert plain["requirements"][0]["limit"] == plain["requirements"][0]["size"] == 1852.0
    assert (plain["requirements"][2]["unit"], plain["requirements"][2]["limit"]) == (
        "arcmin",
        pytest.approx(3 * np.pi / 10_800),
    )
    assert (plain["rows"], plain["ranked"], plain["title"]) == ([1, 2], [2], "trial")


@pytest.mark.parametrize(
    ("solution", "aided", "options", "notes"),
    [("inertial", True, ["--inertial"], 1), ("inertial", False, [], 1), ("filter", True, [], 2)],
)
def test_the_words_of_a_page(solution: str, aided: bool, options: list[str], notes: int) -> None:
    """Only a size that a number describes, and that more than one run gives, can be changed."""
    plain, _ = page.what_if(budget(solution, aided=aided), [], [])
    assert (plain["options"], len(plain["notes"])) == (options, notes)
    assert [source["value"] for source in plain["sources"]] == [0.5, None, None]
    assert [source["random"] for source in plain["sources"]] == [True, False, False]
    assert [source["group"] for source in plain["sources"]] == ["gyros", "gnss position", "flight"]
    assert [source["grade"] for source in plain["sources"]] == ["gyro_bias_sigma_deg_h", "", ""]
    assert plain["sources"][0] == {
        "name": "gyro_bias", "label": "gyro bias", "group": "gyros", "unit": "deg/h", "value": 0.5, "random": True,
        "key": "imu.gyro_bias_sigma_deg_h", "values": (0.5, 0.75), "grade": "gyro_bias_sigma_deg_h",
    }  # fmt: skip


def test_the_values_of_grades_and_what_else_they_have() -> None:
    """The gyro bias of a tactical unit in deg/h; its other errors by their names, without ranges."""
    plain, _ = page.what_if(budget(), [], [])
    grade = plain["grades"]["tactical"]
    per_hour = np.pi / 648_000.0
    assert grade["values"] == {"gyro_bias": pytest.approx(float(find_grade("tactical").gyro.bias) / per_hour)}
    assert "gyro_bias" not in grade["more"]
    assert "gyro_arw" in grade["more"]
    assert not any("limit" in name or "correlation" in name for name in grade["more"])
    assert plain["grades"]["ideal"] == {"values": {"gyro_bias": 0.0}, "more": []}
    others = budget()
    others.sources = SOURCES[1:]
    assert page.what_if(others, [], [])[0]["grades"] == {}
    assert page.what_if(others, [], [])[0]["rest"] == {}


def test_what_a_grade_has_beside_the_sources() -> None:
    """The largest of three values in the key's unit: 6 of a 1σ, 3 of any other; none of what is a source or zero."""
    one = budget()
    one.scenario.imu.stated = lambda term: (
        term.unit * np.array([2.0, 3.0, 1.0]),
        term.unit * np.array([4.0, 6.0, 5.0]),
    )
    rest = page.what_if(one, [], [])[0]["rest"]
    assert "gyro_bias_sigma_deg_h" not in rest
    assert (rest["accel_bias_sigma_ug"], rest["gyro_arw_deg_sqrt_h"]) == (6.0, 3.0)
    assert {rest[key] for key in rest if "_sigma_" in key} == {6.0}
    assert page.what_if(budget(), [], [])[0]["rest"] == {}
