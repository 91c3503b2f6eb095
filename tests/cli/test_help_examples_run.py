"""Every example in the commands' help runs, in a folder with small files of the names that it uses."""

from __future__ import annotations

import re
import shlex
import shutil
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import jsbsim
import numpy as np
import pytest

from sinssim import content
from sinssim.cli.app import main
from tests.cli.test_help_examples import EXAMPLES

pytestmark = pytest.mark.usefixtures("hardly_counted")

DRIVE = Path(__file__).parents[1] / "data" / "drive"
KF_GINS = Path(__file__).parents[1] / "data" / "kf_gins"
EARTH_RATE, GRAVITY = 7.292115e-5, 9.80665

MOVING = """
name = "{name}"
seed = 7

[great_circle]
latitude_deg = 50.0
longitude_deg = 14.5
altitude_m = 3000.0
course_deg = 60.0
speed_mps = 120.0
duration_s = {duration}

[imu]
grade = "{grade}"
rate_hz = {rate}

[navigation]
algorithms = ["quaternion"]
vertical = "baro-loop"
"""
AIDED = """
[navigation.initial_error]
position_sigma_m = 3.0
velocity_sigma_mps = 0.3
tilt_sigma_arcmin = 60.0
heading_sigma_arcmin = 300.0

[aiding.gnss]
rate_hz = 2.0
{baro}
[filter]
"""
FLIGHT = """
name = "my_flight"
seed = 3

[flight]
aircraft = "737"
start = { on = "air", latitude_deg = 50.0, longitude_deg = 14.5, altitude_m = 3000.0, heading_deg = 60.0 }
legs = [{ type = "hold", duration_s = 10.0 }]

[imu]
rate_hz = 20.0

[navigation]
algorithms = ["quaternion"]
"""
STUDY = """
name = "my_study"
description = "one cone"

[[parts]]
title = "coning"
algorithms = ["quaternion"]
rates_hz = [50.0]

[[parts.motions]]

[parts.motions.motion]
type = "coning"
half_angle_deg = 1.0
frequency_hz = 1.0
duration_s = 5.0
"""
UNIT = """
description = "my unit"
source = "its data sheet"
gyro_bias_sigma_deg_h = 1.0
gyro_arw_deg_sqrt_h = 0.1
accel_bias_sigma_mg = 1.0
"""
LOG = """
kind = "rates"
time = "t"
time_unit = "s"
gyro = { columns = ["wx", "wy", "wz"], unit = "rad/s" }
accel = { columns = ["fx", "fy", "fz"], unit = "m/s^2" }
"""
TRACK = """<?xml version="1.0"?>
<gpx version="1.1" creator="test" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>
{points}
</trkseg></trk></gpx>
"""
SHORTER = {
    "parked": ("duration_s = 3600.0", "duration_s = 600.0", "rate_hz = 100.0", "rate_hz = 5.0"),
    "gyrocompassing": ("duration_s = 3600.0", "duration_s = 240.0", "rate_hz = 100.0", "rate_hz = 5.0"),
    "calibration_table": ("dwell_s = 180.0", "dwell_s = 20.0"),
    "calibration_systematic": ("first_dwell_s = 300.0", "first_dwell_s = 60.0", "rate_hz = 50.0", "rate_hz = 25.0"),
    "studies/coning": (
        'algorithms = ["*"]', 'algorithms = ["quaternion", "poisson-2"]',
        "duration_s = 60.0", "duration_s = 5.0",
        "duration_s = 0.3", "duration_s = 0.1",
        "rates_hz = [10.0, 20.0, 40.0, 80.0, 160.0, 320.0]", "rates_hz = [20.0, 40.0, 80.0]",
    ),
}  # fmt: skip
"""What shipped scenarios and studies say, and what their small namesakes say instead."""
LONG = (
    *("compare coning", "compare gyro_trade", "--vary", "--runs 1000", "--sheet", "--until-decided"),
    *("run imu.csv gnss.pos", "run my_drive.toml", "inspect imu.csv gnss.pos", "allan drive.toml", "allan log.npz"),
    *(
        "calibration_systematic",
        "aircraft add",
        "align parked",
        "--require",
        "tune m",
        "--to pty:",
        "--as mavlink",
        "--guide",
    ),
)
"""Parts of the examples that take one to twenty seconds of processor time: they run with -m slow."""


def _sinssim(line: str) -> None:
    with pytest.raises(SystemExit) as end:
        main(shlex.split(line)[1:])
    assert end.value.code == 0


def _at_rest(rows: int, interval: float) -> np.ndarray:
    """Return time, rates and specific forces of a unit at rest at a latitude of 50°, with white noise, (rows, 7)."""
    rng, latitude = np.random.default_rng(1), np.radians(50.0)
    means = [EARTH_RATE * np.cos(latitude), 0.0, -EARTH_RATE * np.sin(latitude), 0.0, 0.0, -GRAVITY]
    noise = rng.standard_normal((rows, 6)) * np.repeat([1e-6, 1e-4], 3)
    return np.column_stack([np.arange(1, rows + 1) * interval, means + noise])


def _write_scenarios(folder: Path) -> None:
    """Write the small namesakes, which take precedence in the current folder, and the user's scenarios."""
    (folder / "scenarios" / "studies").mkdir(parents=True)
    for name, pairs in SHORTER.items():
        text = (content.package_content("scenarios") / f"{name}.toml").read_text(encoding="utf-8")
        for long, short in zip(pairs[::2], pairs[1::2], strict=True):
            assert long in text
            text = text.replace(long, short)
        (folder / "scenarios" / f"{name}.toml").write_text(text, encoding="utf-8")
    first = MOVING.format(name="first_flight", duration=3600.0, grade="laser-standard", rate=2.0)
    (folder / "scenarios" / "first_flight.toml").write_text(first, encoding="utf-8")
    uav = MOVING.format(name="mems_uav", duration=120.0, grade="mems-industrial", rate=10.0)
    (folder / "mems_uav.toml").write_text(uav + AIDED.format(baro="[aiding.baro]"), encoding="utf-8")
    (folder / "gnss.toml").write_text(uav + AIDED.format(baro=""), encoding="utf-8")
    for name, text in (("my_flight", FLIGHT), ("my_study", STUDY), ("my_unit", UNIT)):
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")


def _write_records(folder: Path) -> None:
    """Write the records of sensors: a unit at rest, a barometer, a car, a track, solutions of other programs."""
    (folder / "log.toml").write_text(LOG, encoding="utf-8")
    (folder / "weather.toml").write_text('time = "t"\ntime_unit = "s"\n', encoding="utf-8")
    names = ("t", "wx", "wy", "wz", "fx", "fy", "fz")
    np.savetxt(folder / "log.csv", _at_rest(6000, 0.1), delimiter=",", header=",".join(names), comments="")
    np.savez(folder / "log.npz", **dict(zip(names, _at_rest(36700, 1.0).T, strict=True)))
    air = np.random.default_rng(2).standard_normal((600, 2))
    weather = np.column_stack([np.arange(600.0), 1013.0 + air[:, 0], 20.0 + air[:, 1]])
    np.savetxt(folder / "weather.csv", weather, delimiter=",", header="t,pressure,air_c", comments="")
    for name, share in (("imu.csv", 0.4), ("gnss.pos", 0.4)):
        lines = (DRIVE / name).read_text(encoding="utf-8").splitlines(keepends=True)
        (folder / name).write_text("".join(lines[: int(share * len(lines))]), encoding="utf-8")
    shutil.copy(DRIVE / "drive.toml", folder / "drive.toml")
    shutil.copy(DRIVE / "drive.toml", folder / "my_drive.toml")
    points = "\n".join(
        f'<trkpt lat="{50.0 + 1e-4 * k:.6f}" lon="14.5"><ele>300</ele><time>2026-01-01T00:00:{k:02d}Z</time></trkpt>'
        for k in range(40)
    )
    (folder / "drive.gpx").write_text(TRACK.format(points=points), encoding="utf-8")


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with all files and runs that the examples name."""
    folder = tmp_path_factory.mktemp("examples")
    _write_scenarios(folder)
    _write_records(folder)
    model = folder / "models" / "my_model"
    shutil.copytree(Path(jsbsim.get_default_root_dir()) / "aircraft" / "c172x", model)
    (model / "c172x.xml").rename(model / "my_model.xml")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for scenario, run in (
            ("parked", "parked"),
            ("first_flight --set great_circle.duration_s=300", "first_flight"),
            ("first_flight --set great_circle.duration_s=300 --set imu.grade=tactical", "tactical"),
            ("mems_uav.toml", "mems_uav"),
            ("gnss.toml", "gnss"),
        ):
            _sinssim(f"sinssim run {scenario} -o runs/{run} --keep streams --quiet")
        _sinssim("sinssim export runs/mems_uav --to csv -o rows --quiet")
        _sinssim("sinssim export runs/mems_uav --to kf-gins -o kf --quiet")
        _sinssim("sinssim export runs/mems_uav --to rtklib-pos -o rtk.pos --quiet")
    shutil.move(folder / "rows" / "truth.csv", folder / "mine.csv")
    shutil.move(folder / "kf" / "truth.nav", folder / "KF_GINS_Navresult.nav")
    shutil.copytree(folder / "runs" / "mems_uav", folder / "runs" / "gnss_baro")
    shutil.copytree(folder / "runs", folder / "results" / "2026")
    return folder


@contextmanager
def _navigator() -> Iterator[None]:
    """Take the packets of a stream, and answer the start of the flight, and a second later the next."""
    start = np.radians(50.0), np.radians(14.5), 3000.0, 60.0, 104.0, 0.0, np.cos(np.pi / 6.0), 0.0, 0.0, 0.5
    answers = [struct.pack("<HHI11d", 6, 0, 88, time, *start) for time in (0.0, 1.0)]
    with socket.create_server(("127.0.0.1", 5005)) as server:

        def take() -> None:
            with server.accept()[0] as link:
                link.sendall(b"SINSSIM\0" + struct.pack("<II", 1, 0) + b"".join(answers))
                while link.recv(65536):
                    pass

        thread = threading.Thread(target=take)
        thread.start()
        yield
        thread.join()


@pytest.mark.parametrize(
    "example",
    [pytest.param(line, marks=pytest.mark.slow) if any(part in line for part in LONG) else line for line in EXAMPLES],
)
def test_an_example_runs(
    example: str, prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command, _, output = example.partition(" >> ")
    folder = tmp_path / "here"
    shutil.copytree(prepared, folder)
    monkeypatch.chdir(folder)
    if re.match(r"sinssim (run|budget|compare|ensemble|calibrate) ", command):
        shutil.rmtree("runs")
    for name in re.findall(r" (?:-o|--out) (\S+)", command):
        Path(name).unlink(missing_ok=True)
    if "--disturbed" in command:  # in ten hours gravity turns too far
        np.savez("log.npz", **{name: values[:600] for name, values in np.load("log.npz").items()})
    monkeypatch.setattr("sinssim.analyses.inspection.suggestion_trial._LONGEST_S", 22.0)  # one pass, with one outage
    for name in ("open_viewer", "serve", "screenshot"):
        monkeypatch.setattr(f"sinssim.recording.rerun_viewer.{name}", lambda place, *_, **__: Path(place).stat())
    with _navigator() if "--guide" in command else nullcontext():
        _sinssim(command)
    assert capsys.readouterr().out or output or command.startswith("sinssim view")
