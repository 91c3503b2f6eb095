"""Scenario files, mangled: each is loaded or refused in words, and none is flown."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path
from typing import Any, get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from sinssim.content import list_content
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.notes import keys_without_effect
from sinssim.scenario.plan_summary import plan_lines
from sinssim.toml_mistakes import read_toml, validate
from tests.fuzz import mangle

EVERYTHING = """
name = "everything"
[motion]
type = "rotation-table"
steps = [{type = "dwell", duration_s = 2.0},
  {type = "turn", axis = [0.0, 0.0, 1.0], angle_deg = 90.0, rate_deg_s = 20.0}]
[[vibration]]
coordinate = "roll"
rms_arcsec = 3.0
low_hz = 20.0
high_hz = 30.0
[isolator]
linear_hz = 30.0
angular_hz = 40.0
[imu]
gyro_bias_deg_h = [0.1, 0.2, 0.3]
accel_scale_sigma_ppm = 20.0
accel_arms_mm = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]
[[imu.faults]]
type = "spike"
at_s = 1.0
gyro_arcsec = [1.0, 0.0, 0.0]
[[imu.faults]]
type = "freeze"
from_s = 1.0
to_s = 2.0
channels = ["gyro_x"]
[imu.laser_gyro]
perimeter_mm = 280.0
area_mm2 = 3500.0
lock_in_deg_h = 200.0
dither_amplitude_arcsec = 150.0
dither_frequency_hz = 400.0
[compensation]
gyro_bias_sigma_deg_h = 0.01
[aiding.gnss]
outages_s = [[1.0, 2.0]]
[[aiding.gnss.jumps]]
from_s = 1.0
north_m = 5.0
[aiding.baro]
[aiding.magnetometer]
[aiding.zero_rate]
during_s = [[0.0, 1.0]]
[aiding.master]
[filter]
states = ["gyro bias", "gyro scale"]
[filter.initial_sigma]
position_m = 3.0
[navigation]
algorithms = ["quaternion"]
[navigation.initial_error]
north_m = 10.0
"""


def sources() -> list[dict[str, Any]]:
    shipped = [read_toml(file)[1] for file in list_content("scenarios").values()]
    return [*({"name": "x", **data} for data in shipped), *[tomllib.loads(EVERYTHING)] * 6]


def tables(model: type[BaseModel], path: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], str]]:
    """Return the path of the table and the name of every key that a scenario may have."""
    found = []
    for name, field in model.model_fields.items():
        found.append((path, name))
        for inner in models(field.annotation):
            found += tables(inner, (*path, name))
    return found


def models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for part in get_args(annotation) for m in models(part)] if get_origin(annotation) is not tuple else []


KEYS = tables(Scenario)


def mangled(rng: np.random.Generator, original: dict[str, Any]) -> dict[str, Any]:
    """Return a scenario with one to three values replaced, removed, renamed, moved or added."""
    data = copy.deepcopy(original)
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        paths = list(mangle.places(data))
        path = paths[rng.integers(len(paths))] if paths else ()
        deed = int(rng.integers(0, 8))
        if deed < 3 and path:
            mangle.at(data, path[:-1])[path[-1]] = mangle.value(rng)
        elif deed < 6:
            inside, key = KEYS[rng.integers(len(KEYS))]
            table: Any = data
            for name in inside:
                table = table.setdefault(name, {}) if isinstance(table, dict) else {}
            if isinstance(table, dict):
                table[key] = mangle.value(rng)
        elif deed == 6 and path:
            del mangle.at(data, path[:-1])[path[-1]]
        elif path and isinstance(mangle.at(data, path[:-1]), dict):
            table = mangle.at(data, path[:-1])
            other = paths[rng.integers(len(paths))]
            table[str(other[-1])[:-1] if rng.integers(2) else str(other[-1])] = copy.deepcopy(mangle.at(data, other))
    return data


def look_at(scenario: Scenario) -> None:
    """Do what `sinssim check` does, and write the scenario down."""
    plan_lines(scenario)
    list(keys_without_effect(scenario.imu, 100.0))
    again = Scenario.model_validate(tomllib.loads(scenario.to_toml()))
    assert again == scenario


def tables_of_scenarios(count: int, seed: int) -> mangle.Verdict:
    """Mangle the contents of scenario files."""
    verdict, originals = mangle.Verdict(), sources()
    for k in range(count):
        rng = np.random.default_rng((seed, k))
        data = mangled(rng, originals[rng.integers(len(originals))])
        verdict.judge(lambda data=data: look_at(validate(Scenario, data, "", "x.toml")), lambda k=k: f"case {seed, k}")
    return verdict


def texts_of_scenarios(count: int, seed: int, folder: Path) -> mangle.Verdict:
    """Mangle the text of scenario files."""
    verdict, file = mangle.Verdict(), folder / "x.toml"
    originals = [file.read_text() for file in list_content("scenarios").values()] + [EVERYTHING]
    for k in range(count):
        rng = np.random.default_rng((seed, k))
        wounded = mangle.text(rng, originals[rng.integers(len(originals))])
        content = wounded.encode()
        if rng.integers(20) == 0:
            content = wounded.encode(("utf-16", "latin-1")[rng.integers(2)], "replace")
        file.write_bytes(content)
        verdict.judge(lambda: look_at(load_scenario(file)), lambda k=k: f"case {seed, k}")
    return verdict


def settings_of_scenarios(count: int, seed: int) -> mangle.Verdict:
    """Set any key from outside to anything."""
    verdict = mangle.Verdict()
    for k in range(count):
        rng = np.random.default_rng((seed, k))
        inside, key = KEYS[rng.integers(len(KEYS))]
        shown = (repr(mangle.value(rng)), str(mangle.value(rng)))[rng.integers(2)]
        setting = ".".join((*inside, key)) + ("=", " = ", "", "==")[rng.choice([0, 0, 0, 0, 1, 2, 3])] + shown
        if rng.integers(5) == 0:
            setting = mangle.text(rng, setting)
        verdict.judge(lambda s=setting: look_at(load_scenario("parked", s)), lambda k=k, s=setting: f"{k}: {s[:99]}")
    return verdict


def test_mangled_scenarios(tmp_path: Path) -> None:
    tables_of_scenarios(120, 1).must_be_sound()
    texts_of_scenarios(50, 1, tmp_path).must_be_sound()
    settings_of_scenarios(150, 5).must_be_sound()  # one in fifty is taken


@pytest.mark.slow
def test_thirty_thousand_mangled_scenarios(tmp_path: Path) -> None:
    tables_of_scenarios(22_000, 2).must_be_sound()
    texts_of_scenarios(8_000, 2, tmp_path).must_be_sound()
    settings_of_scenarios(8_000, 2).must_be_sound()
