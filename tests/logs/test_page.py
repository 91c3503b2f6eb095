"""The page on recorded sensors: its scenario runs on files of its form, its mistakes are refused as it says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import sinssim
from sinssim.errors import InputError
from sinssim.toml_mistakes import read_toml
from tests.logs.drive import drive, write_csv

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "logs.md").read_text(encoding="utf-8")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Write the two files of the page, of a drive in closed form, and its scenario."""
    truth = drive(40.0)
    time = np.arange(0.0, 39.9, 0.01)
    gyro, accel = (np.column_stack((-v[:, 0], v[:, 1], -v[:, 2])) for v in truth.rates(time))
    rows = np.column_stack((1e3 * time + 261906.0, accel / 9.80665, np.degrees(gyro)))
    write_csv(tmp_path / "imu.csv", "t_ms,ax,ay,az,gx,gy,gz", rows)
    at = np.arange(0.0, 39.9, 0.25)
    s = truth.state(at)
    v = s.velocity_ned * (1.0, 1.0, -1.0)
    more = np.tile((0.02, 1.0), (len(at), 1))
    fixes = (1e3 * at + 261906.0, np.degrees(s.latitude), np.degrees(s.longitude), s.height, v, more)
    write_csv(tmp_path / "gnss.csv", "t_ms,lat,lon,alt,vn,ve,vu,acc,fix", np.column_stack(fixes))
    (scenario,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "drive.toml").write_text(scenario.replace("[0.0, 0.0, -0.3]", "[0.0, 0.0, 0.0]"))
    return tmp_path


def test_the_tutorial_from_files_to_a_figure(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    reference = 'reference = { file = "gnss.csv", time = "t_ms", height = { column = "alt", unit = "m" }, '
    reference += 'latitude = { column = "lat", unit = "deg" }, longitude = { column = "lon", unit = "deg" } }\n'
    text = (folder / "drive.toml").read_text()
    (folder / "drive.toml").write_text(text.replace("[log.imu]", f"[log]\n{reference}\n[log.imu]"))
    run = sinssim.run(sinssim.load_scenario("drive.toml"), "runs/drive")
    assert run.summary["filter"]["aided"]["max_horizontal_error_m"] < 0.1
    code = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[0]
    names: dict[str, list[float]] = {}
    exec(code, names)
    known = [value for value in names["horizontal"] if value == value]
    assert max(known) == pytest.approx(run.summary["filter"]["aided"]["max_horizontal_error_m"])


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ('log.imu.accel.unit="m/s^2"', r"specific force is 1 m/s² .*a factor of 0\.102"),
        ('log.imu.kind="increments"', "unit of gyro increments"),
        ('log.imu.axes=["backward", "left", "up"]', "not a right-handed set"),
        ('log.imu.time_unit="s"', "contradicts the name"),
        ('log.gnss.first_row="2025-07-08 19:34:21"', r"log\.imu has no date"),
        ("log.gnss.time_offset_s=1000.0", "has no row during the run"),
    ],
)
def test_mistakes_are_refused(folder: Path, setting: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        sinssim.run(sinssim.load_scenario(folder / "drive.toml", [setting]))


def test_z_up_instead_of_down_is_noted(folder: Path) -> None:
    run = sinssim.run(sinssim.load_scenario(folder / "drive.toml", ['log.imu.axes=["forward", "right", "down"]']))
    assert any("the vehicle is upside down" in note for note in run.summary["log"]["notes"])


def test_radians_for_degrees_are_noticed(folder: Path) -> None:
    run = sinssim.run(sinssim.load_scenario(folder / "drive.toml", ['log.imu.gyro.unit="rad/s"']))
    assert run.summary["filter"]["divergence"] is not None or not run.summary["filter"]["consistent"]


def test_commands_and_links() -> None:
    commands = "".join(re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL))
    for file in set(re.findall(r"(\S+\.toml)", commands)):
        assert read_toml(DOCS.parent / file)
    for link in re.findall(r"\]\(([\w./-]+)(?:#[\w-]+)?\)", PAGE):
        assert (DOCS / link).exists(), link


def test_the_example_in_python(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(DOCS.parent)
    exec(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[1], {})
    shown = capsys.readouterr().out
    assert "('position', 'velocity')" in shown
    assert "2025-07-08 19:38:42.224 GPST" in shown
