"""What a scenario navigates: one of several tables, each of which says itself what it needs."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from sinssim.content import list_content
from sinssim.errors import InputError
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.tables import TABLES, TRAVELLING

PARKED = {"latitude_deg": 56.0, "duration_s": 20.0}
CIRCLE = {"latitude_deg": 56.0, "course_deg": 30.0, "speed_mps": 200.0, "duration_s": 20.0}


@pytest.mark.parametrize("name", list_content("scenarios"))
def test_the_source_is_the_table_of_the_file(name: str) -> None:
    scenario = load_scenario(name)
    given = [table for table in TABLES if getattr(scenario, table) is not None]
    assert given == [scenario.source.table]
    assert getattr(scenario, given[0]) is scenario.source
    written = tomllib.loads(scenario.to_toml())
    assert [table for table in TABLES if table in written] == given
    assert "source" not in written
    assert Scenario.model_validate(written) == scenario


def test_each_table_says_whether_its_vehicle_travels() -> None:
    assert TRAVELLING == ["flight", "great_circle", "track", "drive", "voyage"]
    for tables, vertical in (({"parked": PARKED}, "free"), ({"great_circle": CIRCLE}, "baro-loop")):
        assert Scenario(name="x", **tables).navigation.vertical == vertical  # type: ignore[arg-type]
        free = load_scenario("parked", "navigation.vertical=free").navigation
        assert Scenario(name="x", **tables, navigation=free).navigation.vertical == "free"  # type: ignore[arg-type]


def test_a_copy_with_another_source() -> None:
    scenario, other = load_scenario("parked"), load_scenario("closure").great_circle
    copy = scenario.model_copy(update={"great_circle": other})
    assert (copy.source, copy.parked) == (other, None)
    assert scenario.parked is not None


def test_a_misspelt_source_is_told_once() -> None:
    with pytest.raises(InputError) as told:
        Scenario(name="x", park=PARKED)
    assert str(told.value) == "Scenario: unknown key 'park'. Did you mean 'parked'?"
    with pytest.raises(
        InputError, match=r"2 mistakes:\n  - exactly one of .*all of them are missing.\n  - unknown key"
    ):
        Scenario(name="x", ship=PARKED)


def test_two_sources_are_told_whatever_they_hold() -> None:
    """A table that a setting begins lacks keys; that there are two of them is what is wrong."""
    with pytest.raises(InputError, match=r"here there are \[flight\] and \[parked\] \(set from outside the file\)\.$"):
        load_scenario("parked", "flight.aircraft=737")


def test_the_second_of_two_sources_is_told_by_its_line(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text("[parked]\nlatitude_deg = 1.0\nduration_s = 1.0\n[flight]\n")
    with pytest.raises(InputError, match=r"x\.toml, line 4: exactly one of"):
        load_scenario(tmp_path / "x.toml")


def test_a_source_has_its_place_in_mistakes() -> None:
    with pytest.raises(InputError) as told:
        Scenario(name="x", parked={**PARKED, "latitude_deg": 91.0, "height": 3.0})  # type: ignore[arg-type]
    assert "parked.latitude_deg = 91.0 must be at most 90" in str(told.value)
    assert "unknown key 'parked.height'" in str(told.value)
    with pytest.raises(InputError, match="unknown key 'source'"):
        Scenario(name="x", parked=PARKED, source=PARKED)  # type: ignore[arg-type]


def test_the_time_constant_of_the_loop_needs_the_loop() -> None:
    for navigation in ({}, {"vertical": "free"}):
        with pytest.raises(InputError, match=r'it belongs to vertical = "baro-loop"; here vertical = "free"'):
            Scenario(name="x", parked=PARKED, navigation={"baro_time_constant_s": 20.0, **navigation})  # type: ignore[arg-type]
    assert load_scenario("closure", "navigation.baro_time_constant_s=20.0").navigation.baro_time_constant_s == 20.0
