"""Planted noises inside their intervals, what the data cannot tell, the held-out part, settings that run, bad input."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sinssim import run
from sinssim.analyses.filter_tuning_data import _value
from sinssim.analyses.filter_tuning_result import Judged, Tuned, TuningResult
from sinssim.analyses.filter_tuning_search import tune
from sinssim.cli.app import main
from sinssim.errors import InputError
from sinssim.exhibits import Sentence, Table
from sinssim.scenario import load_scenario
from tests.analyses.filter_tuning.planted import PLANTED, written
from tests.slow import slow

WRONG = dict(zip(PLANTED, (0.4, 2.5, 3.0, 0.5, 0.3), strict=True))
"""Factors by which the search begins from other values."""


@pytest.mark.parametrize("runs", [1, *slow(100)])
def test_planted_noises_are_inside_their_intervals(tmp_path: Path, runs: int) -> None:
    """Of 100 runs at least 90 each, for a probability of 95 % each: fewer have a probability of 1.1 %."""
    inside = np.zeros(len(PLANTED))
    for seed in range(1, runs + 1):
        file = written(tmp_path, 60.0 if runs == 1 else 200.0, seed)
        keys = [f"{key}={WRONG[key] * value}" for key, value in PLANTED.items()]
        tuned = tune(file, keys=keys, held_out=0.0).keys
        assert [of.key for of in tuned] == list(PLANTED)
        inside += [of.low <= PLANTED[of.key] <= of.high for of in tuned]
        assert all(of.low <= of.value <= of.high for of in tuned if not of.refused)
    assert np.all(inside >= (0.9 * runs if runs > 1 else 0)), inside
    assert np.sum(inside) >= (0.93 if runs > 1 else 0.8) * runs * len(PLANTED)


@pytest.mark.slow
def test_the_filter_of_the_recorded_drive_knows_its_errors_in_outages() -> None:
    """30 outages of 15 s of nine passes: with the tuned values the errors at their ends are 0.8 to 1.2 of their 1σ."""
    file = Path(__file__).parents[2] / "data" / "drive" / "drive.toml"
    outages = [f"log.outages.{key}" for key in ("length_s=15.0", "every_s=45.0")]
    outages.append(f"log.outages.first_s={[20.0 + 5.0 * k for k in range(9)]}")
    before, after = (
        run(file, overrides=[*settings, *outages]).summary["outages"]["error_over_sigma"]
        for settings in ((), tune(file, held_out=0.0).lines)
    )
    assert before < 0.6
    assert 0.8 < after < 1.2


def test_factors_of_a_simulation_and_the_settings_that_apply_them(tmp_path: Path) -> None:
    """A filter that assumes four times the noise of its readings; the end of the data confirms it."""
    file = written(tmp_path, 60.0)
    settings = ["filter.measurement_noise_factor=4.0"]
    result = tune(file, settings)
    noise, readings = result.keys
    assert (noise.key, readings.key) == ("filter.inertial_noise_factor", "filter.measurement_noise_factor")
    assert (readings.start, noise.start) == (4.0, 1.0)
    assert readings.low < 1.0 < readings.high < 1.4
    assert result.confirmed
    assert result.gain > 50.0
    assert result.split == pytest.approx(0.5 + 2.0 / 3.0 * 59.5, abs=1.0)
    assert all(of.before < 0.2 and 0.6 < of.after < 1.5 for of in result.judged)
    (command,) = re.findall(r"sinssim run \S+ ((?:--set \S+ ?)+)", text_of(result))
    again = load_scenario(file, re.findall(r"--set (\S+)", command))
    assert again.filter.measurement_noise_factor == pytest.approx(readings.value, rel=1e-3)
    assert "changes" not in text_of(result)


@pytest.mark.parametrize(
    ("key", "value"),
    [("imu.gyro_bias_sigma_deg_h", 0.01), ("imu.accel_bias_sigma_ug", 50.0), ("imu.gyro_arw_deg_sqrt_h", 0.003)],
)
def test_a_value_to_begin_with_is_that_of_the_grade_in_the_unit_of_its_key(key: str, value: float) -> None:
    """Those of a laser unit of 1 nmi/h, as its grade lists them."""
    assert _value(load_scenario("parked"), key) == pytest.approx(value, rel=1e-12)


def text_of(result: TuningResult) -> str:
    items = result.exhibits.items
    notes = [item.note for item in items if isinstance(item, Table)]
    return " ".join([*(item.text for item in items if isinstance(item, Sentence)), *notes]).replace("`", "")


def test_a_noise_that_the_data_cannot_tell(tmp_path: Path) -> None:
    """A tiny instability is below anything that shows in a minute: the data only bound it from above, and it stays."""
    key = "imu.gyro_instability_deg_h"
    result = tune(written(tmp_path, 60.0), keys=[f"{key}=0.5"], held_out=0.0)
    (of,) = result.keys
    assert of.refused.startswith(f"the data cannot tell {key}")
    assert of.value == of.start == 0.5
    assert of.low == 0.0
    assert of.high > 5.0
    assert result.lines == ()
    assert f"The data cannot tell {key}" in text_of(result)
    assert "The data determine none of the keys." in text_of(result)


def test_a_noise_that_the_data_exclude_takes_the_limit(tmp_path: Path) -> None:
    """An instability of 5000 °/h would show at once; zero is as probable as the true 2 °/h, and more."""
    key = "imu.gyro_instability_deg_h"
    (of,) = tune(written(tmp_path, 60.0), keys=[f"{key}=5000"], held_out=0.0).keys
    assert of.refused == ""
    assert of.low == 0.0
    assert 2.0 < of.value < 2000.0
    assert of.value == pytest.approx(of.high)


RESULT = TuningResult(
    "a b.toml", ("seed=3", "log.gnss.sigma_factor=9"), True,
    (Tuned("log.gnss.sigma_factor", 9.0, 0.41234, 0.39, 0.43), Tuned("imu.a", 1.0, 1.0, 0.0, np.inf, "the data cannot"),
     Tuned("imu.b_c", 2.0, 3.0, 1.0, 9.0)),
    {"gnss-position": 3}, 120.4, 180.6, -12.34, (Judged("baro", 5, 0.5, 1.5),), (2, 40),
)  # fmt: skip


def test_what_a_result_shows() -> None:
    text = text_of(RESULT)
    assert "3 of gnss-position" in text
    assert "The data cannot. It stays at 1" in text
    assert "from 120 s to 181 s, which the values were not fitted to) does not confirm the values" in text
    assert "is 12.3 smaller" in text
    assert "sinssim run 'a b.toml' --set seed=3 --set log.gnss.sigma_factor=0.4123 --set imu.b_c=3" in text
    assert "[log.gnss] sigma_factor = 0.4123; [imu] b_c = 3." in text
    assert "keys outside [filter] change what they read, too" in text
    summary = RESULT.summary
    assert summary["settings"] == ["log.gnss.sigma_factor=0.4123", "imu.b_c=3"]
    assert summary["held_out"]["confirmed"] is False
    assert replace(RESULT, gain=1.0).confirmed
    table = RESULT.exhibits.items[0]
    assert [row[3] for row in table.rows] == ["0.390 … 0.430", "0 … ∞", "1.00 … 9.00"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["parked"], "parked has no [filter] to tune: add [filter] and an aiding sensor."),
        (["mems_uav", "--key", "imu.grade"], "imu.grade has no number to begin with in this scenario"),
        (["mems_uav", "--key", "filter.gate=x"], "filter.gate=x: the value to begin with must be a number."),
        (["mems_uav", "--key", "imu.gyro_arw_deg_sqrt_h=-1"], "needs a positive value to begin with"),
        (["mems_uav", "--held-out", "2"], "--held-out = '2': Input should be less than or equal to 0.9."),
    ],
)
def test_bad_input(
    arguments: list[str], message: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from sinssim.analyses import filter_tuning_data

    monkeypatch.setattr(filter_tuning_data, "fly", lambda scenario: None)  # refused before anything flies
    monkeypatch.setattr(filter_tuning_data, "truth_along", lambda *_: type("Truth", (), {"trajectory": None}))
    monkeypatch.setattr(filter_tuning_data, "sense", lambda *_: type("Sensed", (), {"imu": None}))
    monkeypatch.setattr(filter_tuning_data, "readings_along", lambda *_: ())
    with pytest.raises(SystemExit) as stopped:
        main(["tune", *arguments])
    assert stopped.value.code == 2
    assert message in " ".join(capsys.readouterr().err.split())


def test_a_key_that_is_no_noise_or_is_given_twice(tmp_path: Path) -> None:
    file = written(tmp_path, 10.0)
    with pytest.raises(InputError, match=r"filter\.gate is no noise of the filter"):
        tune(file, keys=["filter.gate=0.1"])
    with pytest.raises(InputError, match="is given twice"):
        tune(file, keys=["aiding.gnss.height_sigma_m", "aiding.gnss.height_sigma_m=2"])
