"""[imu.rotation] refuses what cannot turn or be followed, by key, value and what is right."""

from __future__ import annotations

from pathlib import Path

import pytest

from sinssim.analyses.alignment_session import align
from sinssim.errors import InputError
from sinssim.scenario import Scenario, load_scenario
from sinssim.truth.motions.imu_rotation import SEQUENCES

TEXT = """\
name = "turning"

[parked]
latitude_deg = 45.0
duration_s = 100.0

[imu]
rate_hz = 10.0
{imu}
[imu.rotation]
{rotation}
{rest}
"""

FILTER = "[aiding.gnss]\n[aiding.baro]\n[filter]\n"


def load(folder: Path, rotation: str, imu: str = "", rest: str = "") -> Scenario:
    file = folder / "turning.toml"
    file.write_text(TEXT.format(rotation=rotation, imu=imu, rest=rest), encoding="utf-8")
    return load_scenario(file)


@pytest.mark.parametrize(
    "rotation",
    [
        'type = "continuous"',
        'type = "reversing"\ndwell_s = 0.0',
        'type = "indexed"',
        *(f'type = "indexed"\nsequence = "{name}"' for name in SEQUENCES),
        'type = "indexed"\nsteps = [{turn_deg = 90.0}, {axis = "inner", turn_deg = -45.0}]',
    ],
)
def test_loads_and_accepts_its_written_defaults(tmp_path: Path, rotation: str) -> None:
    scenario = load(tmp_path, rotation)
    again = tmp_path / "again.toml"
    again.write_text(scenario.to_toml(), encoding="utf-8")
    assert load_scenario(again) == scenario


@pytest.mark.parametrize(
    ("rotation", "imu", "rest", "words"),
    [
        ('type = "spinning"', "", "", ["imu.rotation", "spinning", "continuous"]),
        ('type = "indexed"\nsequence = "12-position"', "", "", ["sequence", "12-position", "16-position"]),
        ('type = "indexed"\ndwell_s = 0.0', "", "", ["dwell_s", "0", "greater than 0"]),
        ('type = "continuous"\nrate_deg_s = 0.0', "", "", ["rate_deg_s = 0", "does not rotate"]),
        ('type = "continuous"\nrate_deg_s = 30.0', "", "", ["rotation.rate_deg_s = 30", "rate_hz = 10", "at most 20"]),
        (
            'type = "continuous"\ninner_rate_deg_s = -25.0',
            "",
            "",
            ["rotation.inner_rate_deg_s = -25", "rate_hz = 10", "at most 20"],
        ),
        ('type = "reversing"\nramp_s = 0.3', "", "", ["rotation.ramp_s = 0.3", "rate_hz = 10", "at least 0.5"]),
        ('type = "reversing"\nturn_deg = 5.0', "", "", ["ramp_s = 1", "turn_deg = 5", "at most 0.83"]),
        ('type = "indexed"\nsteps = [{turn_deg = 0.0}]', "", "", ["turn_deg = 0", "dwell_s"]),
        ('type = "indexed"\nsequence = "8-position"\nsteps = [{turn_deg = 90.0}]', "", "", ["sequence and steps"]),
        ('type = "continuous"\nencoder_noise_arcsec = -1.0', "", "", ["encoder_noise_arcsec", "-1"]),
        ('type = "continuous"\ndwell_s = 1.0', "", "", ["dwell_s"]),
        ('type = "continuous"', '[imu.sensor_set]\ntype = "redundant"\n', "", ["rotation", "redundant"]),
        ('type = "continuous"', "", FILTER + "alignment_s = 10.0", ["filter.alignment_s = 10", "[imu.rotation]"]),
        ('type = "continuous"', "", FILTER + "vibration_noise = 1.0", ["filter.vibration_noise = 1"]),
        (
            'type = "continuous"',
            "",
            "[navigation.alignment]\nduration_s = 60.0",
            ["[navigation.alignment] assumes the inertial data of a vehicle at rest", "[imu.rotation]"],
        ),
        ('type = "continuous"', "", FILTER + "[aiding.zero_rate]", ["[aiding.zero_rate]", "IMU rotates"]),
    ],
)
def test_refused_by_key_value_and_remedy(tmp_path: Path, rotation: str, imu: str, rest: str, words: list[str]) -> None:
    with pytest.raises(InputError) as refused:
        load(tmp_path, rotation, imu, rest)
    for word in words:
        assert word in str(refused.value)


def test_what_does_not_turn_is_refused_by_name(tmp_path: Path) -> None:
    load(tmp_path, 'type = "continuous"')
    with pytest.raises(InputError, match=r"\[imu.rotation\]"):
        align(str(tmp_path / "turning.toml"))


def test_the_mean_square_rate_of_two_axes(tmp_path: Path) -> None:
    """Perpendicular rates add by squares: 10 and 6 deg/s give 136 deg²/s²."""
    turning = 'type = "continuous"\nrate_deg_s = 10.0\ninner_rate_deg_s = 6.0'
    rotation = load(tmp_path, turning, 'grade = "ideal"').imu.rotation
    assert rotation is not None
    assert rotation.mean_square_rate_deg2_s2 == pytest.approx(136.0)
