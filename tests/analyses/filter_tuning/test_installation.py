"""A planted lever arm, time offset and delay inside their intervals; what the motion does not show; bad input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.analyses.filter_tuning_data import INSTALLED, installed_errors, installed_part
from sinssim.analyses.filter_tuning_result import Tuned, TuningResult
from sinssim.analyses.filter_tuning_search import tune, value_of
from sinssim.errors import InputError
from sinssim.scenario import load_scenario
from tests.analyses.filter_tuning.planted import AGE, ARM, LATE, MOUNTED, written, written_log, written_mounted
from tests.slow import slow

TRUE = {
    "log.gnss.lever_arm_m.1": ARM[0], "log.gnss.lever_arm_m.2": ARM[1], "log.gnss.time_offset_s": -LATE,
    "log.gnss.velocity_delay_s": AGE,
}  # fmt: skip


@pytest.mark.parametrize("runs", [1, *slow(100)])
def test_a_planted_installation_is_inside_its_intervals(tmp_path: Path, runs: int) -> None:
    """Of 100 runs at least 90 each, for a probability of 95 % each: fewer have a probability of 1.1 %.

    On a level road the height of the antenna does not show: it is refused by name, and stays.
    """
    inside, keys = np.zeros(len(TRUE)), [key for key in INSTALLED if key.startswith("log.")]
    for seed in range(1, runs + 1):
        result = tune(written_log(tmp_path, 60.0 if runs == 1 else 90.0, seed), keys=keys, held_out=0.0)
        tuned = {of.key: of for of in result.keys}
        up = tuned.pop("log.gnss.lever_arm_m.3")
        assert list(tuned) == list(TRUE)
        assert up.refused.startswith("the data cannot tell log.gnss.lever_arm_m.3: ")
        assert up.value == 0.0
        assert not any(of.refused for of in tuned.values())
        inside += [tuned[key].low <= true <= tuned[key].high for key, true in TRUE.items()]
    assert np.all(inside >= (0.9 * runs if runs > 1 else 0)), inside
    assert np.sum(inside) >= (0.93 if runs > 1 else 0.75) * runs * len(TRUE)
    half = [0.5 * (tuned[key].high - tuned[key].low) for key in TRUE]
    assert np.all(np.array(half) < (0.3, 0.3, 0.03, 0.03)), half
    again = load_scenario(tmp_path / "log.toml", result.lines).log.gnss
    assert again.lever_arm_m == pytest.approx([*(tuned[key].value for key in list(TRUE)[:2]), 0.0], rel=1e-3)
    assert again.time_offset_s == pytest.approx(tuned["log.gnss.time_offset_s"].value, rel=1e-3)


@pytest.mark.parametrize("runs", [1, *slow(100)])
def test_a_planted_mounting_is_inside_its_interval(tmp_path: Path, runs: int) -> None:
    """By the constraint of a car that sways; as above, at least 90 of 100 runs, of one run within four 1σ."""
    off = np.empty((runs, 2))
    for seed in range(runs):
        file = written_mounted(tmp_path, 60.0 if runs == 1 else 90.0, seed)
        result = tune(file, keys=["imu.mounting_deg"], held_out=0.0)
        assert [of.key for of in result.keys] == ["imu.mounting_deg.2", "imu.mounting_deg.3"]
        assert not any(of.refused for of in result.keys)
        half = np.array([0.5 * (of.high - of.low) for of in result.keys])
        assert np.all((half > 0.05) & (half < 0.25)), half
        off[seed] = (np.array([of.value for of in result.keys]) - MOUNTED[1:]) / half
    assert np.all(np.sum(np.abs(off) < (1.0 if runs > 1 else 2.0), axis=0) >= 0.9 * runs), off
    assert load_scenario(file, result.lines).imu.mounting_deg == pytest.approx(
        [0.0, *(of.value for of in result.keys)], rel=1e-3
    )


def test_values_of_an_array_are_one_setting() -> None:
    of = [
        Tuned(f"log.gnss.lever_arm_m.{k}", 0.5, k, 0.0, 9.0, "no" if k == 3 else "", (0.5, 0.5, 0.5)) for k in (1, 2, 3)
    ]
    result = TuningResult("a", (), False, tuple(of), {}, 1.0, 2.0, 1.0, (), (1, 1))
    assert result.lines == ("log.gnss.lever_arm_m=[1, 2, 0.5]",)


def test_errors_of_the_states() -> None:
    """Stamps that are moved forwards are less late; a mounting turns the forward axis the other way."""
    before = {"log.gnss.time_offset_s": 1.0, "log.gnss.lever_arm_m.2": 0.5, "log.gnss.velocity_delay_s": 0.1}
    now = {"log.gnss.time_offset_s": 1.25, "log.gnss.lever_arm_m.2": 0.75, "log.gnss.velocity_delay_s": 0.2}
    errors = {name: list(of) for name, of in installed_errors(now, before, (0.0, 0.0, 0.0)).items()}
    assert errors == {
        "gnss time offset": [-0.25], "gnss lever arm": [0.0, 0.25, 0.0], "gnss-velocity delay": [pytest.approx(0.1)],
    }  # fmt: skip
    small = installed_errors(
        {"imu.mounting_deg.2": 2.0, "imu.mounting_deg.3": 3.0}, {"imu.mounting_deg.2": 1.0, "imu.mounting_deg.3": 1.0},
        (0.0, 1.0, 1.0),
    )["land-vehicle mounting"]  # fmt: skip
    np.testing.assert_allclose(np.degrees(small), [-1.0, -2.0], atol=5e-3)
    assert installed_part("imu.mounting_deg") == ("imu.mounting_deg", 0)
    assert installed_part("log.others.1.sigma.value") == ("", 0)
    assert value_of(2.0, 0.5, 0.1) == pytest.approx(2.05)
    assert value_of(2.0, np.log(3.0), np.nan) == pytest.approx(6.0)


def test_bad_input(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is tuned on recorded sensors"):
        tune(written(tmp_path, 10.0), keys=["imu.mounting_deg"])
    file = written_log(tmp_path, 20.0)
    for keys, settings, message in (
        (["imu.mounting_deg"], (), r"shows in the constraint of a land vehicle: add \[aiding.land_vehicle\]"),
        (["log.gnss.lever_arm_m=[1, 2]"], (), "begins with 2 numbers; it has 3"),
        (["log.gnss.lever_arm_m.2"], (), "is tuned as a whole: give --key log.gnss.lever_arm_m"),
        (["log.gnss.lever_arm_m=x"], (), "the value to begin with must be a number"),
        (["log.gnss.time_offset_s", "log.gnss.time_offset_s=1"], (), "is given twice"),
        (["log.gnss.lever_arm_m"], ("log.gnss.lever_arm_sigma_m=1",), "remove log.gnss.lever_arm_sigma_m to tune it"),
        (["aiding.land_vehicle.lever_arm_m"], (), r"has no table \[aiding.land_vehicle\]"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=message):
            tune(file, settings, keys=keys)
