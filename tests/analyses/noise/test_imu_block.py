"""The table [imu] from a record: terms put in by an independent generator come out as keys of a scenario."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.analyses.noise_imu_table import _grade, block_text, imu_block
from sinssim.analyses.noise_report import noise_report
from sinssim.cli.app import main
from sinssim.errors import InputError
from sinssim.sensors.imu.grades import GRADE_TABLE
from sinssim.sensors.imu.imu_section import Imu
from tests.analyses.noise.test_report import T, increments, write
from tests.oracles import noise

DEG_H = np.pi / 180.0 / 3600.0
DRIVE = Path(__file__).parents[2] / "data" / "drive" / "drive.toml"


def command(*words: object) -> int:
    """Return the exit code of the command."""
    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return int(str(end.value.code))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A record of 33 minutes: white noise on all axes, on gyro_y also a strong rate random walk."""
    gyro, accel = increments()
    rng = np.random.default_rng(8)
    walk = noise.rate_walk(rng, len(gyro), T, 60.0 * DEG_H / 60.0)  # 60 deg/h/√h
    gyro[:, 1] += walk
    gyro += np.array([400.0, 0.0, 0.0]) * DEG_H * T
    return write(tmp_path_factory.mktemp("block") / "imu.parquet", gyro, accel)


def test_the_noise_that_was_put_in_comes_out(path: Path) -> None:
    text = block_text(noise_report(path))
    table = tomllib.loads(text)["imu"]
    section = Imu(**table)
    # 20 000 samples of white noise: N to 0.5 % (1σ) each, the rms of three to 0.3 %
    assert section.gyro_arw_deg_sqrt_h == pytest.approx(0.12, rel=0.015)
    assert section.accel_vrw_ug_sqrt_hz == pytest.approx(0.05 / 60.0 / 9.80665e-6, rel=0.015)
    # one axis of three has the walk; 33 minutes tell it to some 15 % (1σ)
    assert section.gyro_rrw_deg_h_sqrt_h == pytest.approx(60.0 / np.sqrt(3.0), rel=0.6)
    assert section.rate_hz == pytest.approx(10.0)
    # what no axis shows is switched off, whatever the grade has
    for key in ("gyro_instability_deg_h", "accel_instability_ug", "gyro_flicker_deg_h", "accel_quantum_mm_s"):
        assert getattr(section, key) == 0.0, key
    assert table["gyro_bias_sigma_deg_h"] == pytest.approx(410.0 / np.sqrt(3.0), rel=0.02)  # means 410, 0, −11 deg/h
    assert "K, rate random walk: x not observable, y " in text
    assert "accel_bias_sigma_ug" not in table, "the specific force is gravity's"


def test_the_command_prints_the_table_alone(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("allan", path, "--imu", "--channel", "accel") == 0
    table = tomllib.loads(capsys.readouterr().out)["imu"]
    assert "accel_vrw_ug_sqrt_hz" in table
    assert not any(key.startswith("gyro") for key in table)
    assert Imu(**table).grade == table["grade"]
    assert command("allan", path, "--imu", "--json") == 2


def test_a_quantity_of_another_kind_is_no_unit(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    values = np.random.default_rng(1).standard_normal(300)
    file.write_text("time_s,pressure_pa\n" + "".join(f"{0.1 * k:.1f},{v}\n" for k, v in enumerate(values)))
    with pytest.raises(InputError, match="nothing for"):
        imu_block(noise_report(file, channels=["pressure_pa"]))


def test_the_unit_of_a_scenario_with_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    """The scenario describes columns, units, axes and clock; a part of a moving car is said to be doubtful."""
    report = noise_report(DRIVE, start=60.0, end=66.0, channels=["accel_z"])
    assert report.samples.time[-1] <= 66.0 + 1e-9
    assert report.channels[0].fit.mean == pytest.approx(-9.8, abs=0.5)  # down, of a body axis that points down
    assert command("allan", DRIVE, "--from", 60, "--to", 66, "--imu", "--channel", "gyro") == 0
    assert "# doubtful: these terms do not describe gyro_y" in capsys.readouterr().out
    for options, message in (
        ({"columns": DRIVE}, "leave it out"),
        ({"channels": ["pressure=hPa"]}, "of a scenario gyros and accelerometers"),
    ):
        with pytest.raises(InputError, match=message):
            noise_report(DRIVE, **options)
    with pytest.raises(InputError, match="without \\[log\\]"):
        noise_report(Path(__file__).parents[3] / "scenarios" / "parked.toml")


def test_the_nearest_grade_is_that_of_the_root_mean_square() -> None:
    """Axes of which one is ten times as noisy as the others: the mean square is 34 times theirs; without gyros the
    accelerometers tell."""
    walks = {name: (grade.gyro.random_walk, grade.accel.random_walk) for name, grade in GRADE_TABLE.items()}
    for name, (gyro, accel) in walks.items():
        for triad, walk in (("gyro", gyro), ("accel", accel)):
            if walk > 0.0:
                sizes = np.array([1.0, 1.0, 10.0]) * walk / np.sqrt(34.0)
                axes = [SimpleNamespace(fit=SimpleNamespace(likely={"N": size})) for size in sizes]
                found = _grade({triad: axes})  # type: ignore[dict-item]
                assert walks[found][triad == "accel"] == walk, name
