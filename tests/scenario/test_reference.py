"""The reference of the scenario file: every table has a line and a page, and the pages are a scenario that loads."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path

import pytest

from sinssim.errors import InputError
from sinssim.scenario import Scenario
from sinssim.scenario.schema import key_tables, keys_under, toml_lines
from sinssim.sensors.imu.imu_section import Imu

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    spec = importlib.util.spec_from_file_location("scenario_reference", DOCS / "scenario_reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    made: dict[str, str] = module.pages()
    return made


def test_every_table_has_a_line_and_a_page(pages: dict[str, str]) -> None:
    of_file = {key.name for key in next(key_tables()).keys}
    tables = set(Scenario.model_json_schema()["properties"]) - of_file
    listed = re.findall(r"^\| `\[(\w+)\]` \|", (DOCS / "scenario.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(listed) == tables == set(pages) - {"head"}
    assert len(listed) == len(tables)


def test_keys_of_a_place() -> None:
    (start, *_) = tables = keys_under("flight.start")
    assert [(table.path, table.tag) for table in tables] == [("flight.start", "air"), ("flight.start", "runway")]
    assert list(toml_lines(start))[:3] == [
        "# The flight begins in the air, in trimmed straight and level flight.", "[flight.start]",
        'on = "air"           # required',
    ]  # fmt: skip
    (block,) = keys_under("imu.gyro_bias_sigma")
    assert list(toml_lines(block))[1:] == [
        "[imu]",
        "# gyro_bias_sigma_deg_h = 0.0  # 1σ of the random error of the same name, added to the given one; default: "
        "that of the grade, or 0 if an error is given; at least 0",
        "",
    ]
    assert {"imu", "imu.faults", "imu.rotation"} <= {table.path for table in keys_under("imu")}
    with pytest.raises(
        InputError, match=r"no table or key 'imu\.gryo_bias_deg_h'; the nearest: imu\.gyro_bias_deg_h, "
    ):
        keys_under("imu.gryo_bias_deg_h")


GROUND = ("takeoff", "take_off", "parked", "park", "taxi", "land")
SOURCES = {
    "flight", "parked", "great_circle", "motion", "track", "drive", "voyage", "rocket", "turntable", "log",
    "one_component",
}  # fmt: skip


@pytest.mark.parametrize("motion", sorted(SOURCES))
def test_examples_load(pages: dict[str, str], motion: str) -> None:
    blocks = [tomllib.loads(block) for block in re.findall(r"```toml\n(.*?)```", "".join(pages.values()), re.DOTALL)]
    data = {key: value for block in blocks for key, value in block.items()}
    for other in SOURCES - {motion}:
        del data[other]
    if motion != "turntable":
        del data["calibration"]
    if motion == "one_component":
        data = {key: value for key, value in data.items() if key in ("name", "description", "seed", motion)}
    if motion == "log":  # the other tables of the page are for simulated sensors
        data = {key: value for key, value in data.items() if key in ("name", "description", "seed", motion)}
        scenario = Scenario.model_validate({**data, "imu": {"grade": "mems-industrial"}, "filter": {}})
        assert scenario.log is not None
        assert scenario.log.gnss is not None
        assert scenario.log.gnss.latitude is not None
        return
    if motion == "great_circle":  # the carrier of a bomb, in still air and the gravity of [truth]
        del data["gravity"], data["aiding"]["airspeed"]
    else:
        data.pop("drop", None)
    if motion == "rocket":  # which leaves the air, in the gravity of [truth]
        del data["gravity"], data["aiding"]["baro"], data["aiding"]["airspeed"]
        data["navigation"]["vertical"] = "free"
    if motion == "flight":  # the page shows every kind of leg; on the ground it starts only from a runway
        data["flight"]["legs"] = [leg for leg in data["flight"]["legs"] if leg["type"] not in GROUND]
    if "imu" in data:  # the other tables of the page are for a block at rest
        turning = {**data["imu"], "rotation": data["imu"].pop("rotation")}
        assert Imu.model_validate(turning).rotation is not None
    scenario = Scenario.model_validate(data)
    shown = set(scenario.as_written())
    assert set(data) == {key for key in shown if getattr(scenario, key) is not None} - (
        {"use", "views", "recording"} - set(data)
    )
