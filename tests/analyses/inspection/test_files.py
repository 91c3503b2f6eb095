"""Text files that nobody described: columns, units, clock and mounting are found, and a scenario is suggested."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim import rotation
from sinssim.analyses.inspection import inspected_files
from sinssim.analyses.inspection.inertial_columns import guess_layout
from sinssim.analyses.inspection.inspected_files import inspect
from sinssim.analyses.inspection.stream_findings import wrong
from sinssim.analyses.inspection.text_columns import read_table
from sinssim.errors import InputError
from sinssim.logs.formats import folder_of
from sinssim.scenario import load_scenario
from tests.analyses.inspection import worlds
from tests.logs.formats.samples import FILES
from tests.slow import slow

_DEG = np.pi / 180.0


def _pos(path: Path, delay: float) -> Path:
    """Write the fixes in RTKLIB's layout, 2026-01-04 00:00:00 GPST being the world's time 0."""
    seen = worlds.fixes(delay=delay)
    assert seen.velocity_ned is not None
    lines = ["%  GPST latitude(deg) longitude(deg) height(m) Q ns sdn sde sdu sdne sdeu sdun age ratio vn ve vu sdvn sdve sdvu sdvne sdveu sdvun"]  # fmt: skip  # noqa: E501
    for k, t in enumerate(seen.time):
        v = seen.velocity_ned[k]
        place = f"{np.degrees(seen.latitude[k]):.9f} {np.degrees(seen.longitude[k]):.9f} {seen.height[k]:.4f}"
        lines.append(
            f"2026/01/04 00:{int(t // 60):02d}:{t % 60:06.3f} {place} 1 12 0.01 0.01 0.01 0 0 0 0 0 "
            f"{v[0]:.4f} {v[1]:.4f} {-v[2]:.4f} 0.03 0.03 0.03 0 0 0"
        )
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_log_without_a_line_of_names(tmp_path: Path) -> None:
    """A unit that is mounted backward and upside down writes g, °/s and the milliseconds since it was switched on."""
    unit = worlds.readings()
    turn = np.diag((-1.0, 1.0, -1.0))
    columns = np.column_stack([unit.accel @ turn / 9.80665, unit.gyro @ turn / _DEG, np.rint(1e3 * unit.time) + 70_000])
    log = tmp_path / "drive log.csv"
    np.savetxt(log, columns, delimiter=",", fmt=["%.4f"] * 6 + ["%d"])
    found = inspect([log, _pos(tmp_path / "gnss.pos", 0.125)], tmp_path)
    assert found.scenario is not None
    told = tomllib.loads(found.scenario)
    assert "aiding" not in told, "nobody said that it is a land vehicle"
    own = told["log"]["imu"]
    assert own["file"] == "drive log.csv"
    assert (own["kind"], own["time"], own["time_unit"]) == ("rates", 7, "ms")
    assert own["accel"] == {"columns": [1, 2, 3], "unit": "g"}
    assert own["gyro"] == {"columns": [4, 5, 6], "unit": "deg/s"}
    assert own["axes"] == ["backward", "right", "up"]
    first = float(own["first_row"].rsplit(":", 1)[1])  # the first stamp is the middle of the first interval
    assert own["first_row"].startswith("2026-01-0")
    assert min(abs(first - unit.time[0]), abs(first - 60.0 - unit.time[0])) < 0.015
    assert told["log"]["gnss"]["velocity_delay_s"] == pytest.approx(0.125, abs=0.01)
    # roll 180° and yaw 180° turn the small angles: those of the renamed axes stay
    assert told["imu"]["mounting_deg"] == pytest.approx([0.0, -4.0, 6.0], abs=0.4)
    # the world's noise, 0.05 °/s and 0.02 m/s² in each sample of 10 ms, and its gyros' largest bias
    assert told["imu"]["gyro_arw_deg_sqrt_h"] == pytest.approx(0.05 * 0.1 * 60.0, rel=0.15)
    assert told["imu"]["accel_vrw_ug_sqrt_hz"] == pytest.approx(0.02 * 0.1 / 9.80665e-6, rel=0.15)
    largest = np.abs(np.array([0.1, -0.2, 0.15]) @ worlds.TO_UNIT).max() * 3600.0
    assert told["imu"]["gyro_bias_sigma_deg_h"] == pytest.approx(largest, rel=0.05)


@pytest.mark.slow
def test_the_unit_of_the_gyros_is_decided_by_the_fixes(tmp_path: Path) -> None:
    """A slow drive's rates in °/s are below 6 and look like rad/s."""
    unit = worlds.readings(rate_hz=50.0)
    log = tmp_path / "imu.txt"
    table = np.column_stack([unit.time + 1.0, unit.gyro / (6.0 * _DEG), unit.accel])
    table[:, 1:4] *= 6.0
    table[:, 1:4] = np.clip(table[:, 1:4], -5.9, 5.9)
    np.savetxt(log, table, fmt="%.6f")
    layout = guess_layout(read_table(log))
    assert (layout.gyro_unit, layout.gyro_unit_sure) in {("rad/s", False), ("deg/s", False)}
    found = inspect([log, _pos(tmp_path / "gnss.pos", 0.0)], tmp_path)
    assert found.scenario is not None
    assert tomllib.loads(found.scenario)["log"]["imu"]["gyro"]["unit"] == "deg/s"


def test_names_give_columns_and_units(tmp_path: Path) -> None:
    unit = worlds.readings()
    log = tmp_path / "phone.csv"
    names = "index,TimeUS,temperature,acc_x [mg],acc_y [mg],acc_z [mg],gyro_x_dps,gyro_y_dps,gyro_z_dps"
    rows = np.column_stack(
        [np.arange(len(unit)), 1e6 * unit.time, np.full(len(unit), 25.0), unit.accel / 9.80665e-3, unit.gyro / _DEG]
    )
    np.savetxt(log, rows, delimiter=";", header=f"made by a phone\n{names.replace(',', ';')}", comments="", fmt="%.5f")
    table = read_table(log)
    layout = guess_layout(table)
    assert table.delimiter == ";"
    assert layout.gyro_unit_sure
    assert layout.description(table) == {
        "kind": "rates", "time": "TimeUS", "time_unit": "us", "delimiter": ";", "skip_lines": 1,
        "gyro": {"columns": ["gyro_x_dps", "gyro_y_dps", "gyro_z_dps"], "unit": "deg/s"},
        "accel": {"columns": ["acc_x [mg]", "acc_y [mg]", "acc_z [mg]"], "unit": "mg"},
    }  # fmt: skip


def test_increments_are_recognised(tmp_path: Path) -> None:
    unit = worlds.readings(rate_hz=200.0)
    log = tmp_path / "increments.txt"
    np.savetxt(log, np.column_stack([unit.time, unit.gyro / 200.0, unit.accel / 200.0]), fmt="%.9f")
    layout = guess_layout(read_table(log))
    assert (layout.kind, layout.gyro_unit, layout.accel_unit) == ("increments", "rad", "m/s")


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("hello\nworld\n", "is not a table of numbers"),
        ("9,2,3\n4,5,6\n7,1,2\n8,2,1\n", "no column increases"),
        ("", "is empty"),
    ],
)
def test_what_is_no_log(tmp_path: Path, text: str, named: str) -> None:
    path = tmp_path / "some.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=named):
        inspect([path])


def test_no_file_at_all(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"does not exist|cannot be read"):
        inspect([tmp_path / "missing.csv"])


@pytest.mark.slow
def test_a_scenario_with_its_clocks_described_has_nothing_left_to_describe(tmp_path: Path) -> None:
    """The offset that was found and written is not found again."""
    unit = worlds.readings(late=0.4)
    log = tmp_path / "imu.csv"
    np.savetxt(log, np.column_stack([unit.time + 70.0, unit.gyro, unit.accel]), delimiter=",", fmt="%.6f")
    first = inspect([log, _pos(tmp_path / "gnss.pos", 0.0)], tmp_path)
    assert first.scenario is not None
    assert "first_row" in first.scenario
    (tmp_path / "drive.toml").write_text(first.scenario)
    again = inspect([tmp_path / "drive.toml"]).inspection
    (said,) = (f for f in again.findings if f.subject == "clocks")
    assert said.grade == "fact"
    assert abs(float(said.text.split(" are ")[1].split(" ms")[0].split(" ")[0])) < 10.0


@pytest.mark.slow
def test_a_described_delay_and_refused_qualities_are_not_found_again(tmp_path: Path) -> None:
    """Float fixes that claim centimetres lie 0.3 m off: the suggested scenario refuses them, and nothing is left."""
    unit = worlds.readings()
    log, seen = tmp_path / "imu.csv", _pos(tmp_path / "gnss.pos", 0.125)
    np.savetxt(log, np.column_stack([unit.time + 70.0, unit.gyro, unit.accel]), delimiter=",", fmt="%.6f")
    lines = seen.read_text().splitlines()
    for k in range(200, 212):
        words = lines[k].split(" ")
        words[2], words[5] = f"{float(words[2]) + np.degrees(0.3 / 6.38e6):.9f}", "2"
        lines[k] = " ".join(words)
    seen.write_text("\n".join(lines) + "\n")
    first = inspect([log, seen], tmp_path)
    assert first.scenario is not None
    assert tomllib.loads(first.scenario)["log"]["gnss"]["quality_factors"] == {"1": 1.0}
    (tmp_path / "drive.toml").write_text(first.scenario)
    again = inspect([tmp_path / "drive.toml"]).inspection
    assert not any("contradict" in f.text for f in again.findings)
    (said,) = (f for f in again.findings if "velocity_delay_s" in f.numbers)
    assert said.grade == "fact"
    assert "are described" in said.text
    wrong = (tmp_path / "drive.toml").read_text().replace("velocity_delay_s = 0.1", "velocity_delay_s = 0.2")
    (tmp_path / "drive.toml").write_text(wrong)
    (said,) = (f for f in inspect([tmp_path / "drive.toml"]).inspection.findings if "velocity_delay_s" in f.numbers)
    assert said.grade == "doubt"


def test_a_vehicle_on_wheels_that_shakes(tmp_path: Path) -> None:
    """The noise is that of the calmest axis, since the filter adds the shaking of each, and the tables are on."""
    unit = worlds.readings()
    rng = np.random.default_rng(3)
    moving = (unit.time > 32.0)[:, None]
    gyro = unit.gyro + rng.normal(0.0, 1.0, unit.gyro.shape) * np.where(moving, 0.02, 0.002) * (0.2, 1.0, 0.2)
    log = tmp_path / "imu.csv"
    np.savetxt(log, np.column_stack([unit.time, gyro, unit.accel]), delimiter=",", fmt="%.6f")
    found = inspect([log, _pos(tmp_path / "gnss.pos", 0.0)], tmp_path, land=True)
    assert found.scenario is not None
    told = tomllib.loads(found.scenario)
    calm = np.hypot(np.radians(0.05), 0.0004) * np.sqrt(0.01)  # rad/√s, of the axes that hardly shake
    assert told["imu"]["gyro_arw_deg_sqrt_h"] == pytest.approx(np.degrees(calm) * 60.0, rel=0.1)
    assert told["filter"]["vibration_noise"] == 0.4
    assert set(told["aiding"]) == {"land_vehicle", "zero_velocity", "zero_rate"}
    wheels = told["aiding"]["land_vehicle"]
    assert 0.0 < wheels["drift_lateral_mps"] < wheels["drift_vertical_mps"] < wheels["sigma_vertical_mps"]
    assert told["imu"]["gyro_flicker_deg_h"] > 0.0
    assert load_scenario(str(_written(tmp_path / "drive.toml", found.scenario))).aiding is not None


def _written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


@pytest.mark.parametrize("off_deg", [*slow(0.0), 6.0])
def test_the_attitude_of_a_reference_is_judged_without_a_filter(tmp_path: Path, off_deg: float) -> None:
    """The true attitude agrees with readings and fixes; one whose heading is off by 6° does not."""
    unit = worlds.readings()
    np.savetxt(tmp_path / "imu.csv", np.column_stack([unit.time, unit.gyro, unit.accel]), delimiter=",", fmt="%.6f")
    seen = worlds.fixes()
    assert seen.velocity_ned is not None
    place = np.degrees(np.column_stack([seen.latitude, seen.longitude]))
    rows = np.column_stack([seen.time, place, seen.height, seen.velocity_ned])
    np.savetxt(tmp_path / "gnss.csv", rows, delimiter=",", fmt="%.10f")
    time = np.arange(1.0, worlds.DURATION - 1.0, 0.05)
    angles = np.degrees(rotation.euler_from_quaternion(worlds.drive().state(time).q_nb))
    rows = np.column_stack([time, angles[0], angles[1], angles[2] + off_deg])
    np.savetxt(tmp_path / "attitude.csv", rows, delimiter=",", fmt="%.6f")
    to_unit = np.degrees(rotation.euler_from_quaternion(rotation.quaternion_from_dcm(worlds.TO_UNIT)))
    (tmp_path / "drive.toml").write_text(_DESCRIBED.format(*to_unit))
    (said,) = (f for f in inspect([tmp_path / "drive.toml"]).inspection.findings if f.subject == "reference")
    assert said.grade == ("doubt" if off_deg else "fact")
    assert said.numbers["heading_deg"] == pytest.approx(off_deg, abs=0.5)
    assert said.numbers["tilt_deg"] < 0.3


_DESCRIBED = """
name = "drive"
log.imu = {{ file = "imu.csv", kind = "rates", time = 1, gyro = {{ columns = [2, 3, 4], unit = "rad/s" }}, accel = {{ columns = [5, 6, 7], unit = "m/s^2" }} }}
imu = {{ grade = "mems-industrial", mounting_deg = [{}, {}, {}] }}
[log.gnss]
file = "gnss.csv"
time = 1
latitude = {{ column = 2, unit = "deg" }}
longitude = {{ column = 3, unit = "deg" }}
height = {{ column = 4, unit = "m" }}
velocity = {{ columns = [5, 6, 7], unit = "m/s" }}
position_sigma_m = [0.01, 0.01, 0.02]
velocity_sigma_mps = [0.05, 0.05, 0.05]
[log.reference]
file = "attitude.csv"
time = 1
roll = {{ column = 2, unit = "deg" }}
pitch = {{ column = 3, unit = "deg" }}
heading = {{ column = 4, unit = "deg" }}
"""  # noqa: E501


@pytest.mark.parametrize("relative", [False, True])
def test_a_folder_of_a_format_takes_only_its_own_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, relative: bool
) -> None:
    """Beside the folder mav0 of EuRoC lies the log of another logger, which is read for itself."""
    folder = tmp_path / "mav0" / "imu0"
    folder.mkdir(parents=True)
    own = FILES["euroc"][0](folder / "data.csv")
    unit = worlds.readings()
    other = tmp_path / "imu.csv"
    names = "t_s,gx,gy,gz,ax,ay,az"
    np.savetxt(other, np.column_stack([unit.time, unit.gyro, unit.accel]), delimiter=",", header=names, comments="")
    monkeypatch.chdir(tmp_path)
    start = Path() if relative else tmp_path
    assert folder_of(start / "imu.csv") is None
    assert folder_of(start / "mav0" / "imu0" / "data.csv") == start / "mav0"
    assert [one.path.name for one in inspect([start / "imu.csv"], tmp_path).files] == ["imu.csv"]
    assert own.is_file()


def test_rows_of_another_width_are_named_as_a_run_refuses_them(tmp_path: Path) -> None:
    """Of seven such rows in two files the lines of five are named; a run names the first one."""
    unit = worlds.readings(50.0)
    gyro, accel = tmp_path / "gyro.csv", tmp_path / "accel.csv"
    for path, values in ((gyro, unit.gyro), (accel, unit.accel)):
        names = f"t_s,{path.stem}_x,{path.stem}_y,{path.stem}_z"
        np.savetxt(path, np.column_stack([unit.time, values]), delimiter=",", header=names, comments="", fmt="%.5f")
    assert not any("another number" in f.text for f in inspect([gyro, accel], tmp_path).inspection.findings)
    for path, odd in ((gyro, range(12, 78, 11)), (accel, (40,))):
        lines = path.read_text().splitlines()
        for line in odd:
            lines[line - 1] += ",0"
        path.write_text("\n".join(lines) + "\n")
    found = inspect([gyro, accel], tmp_path)
    said = [f for f in found.inspection.findings if "another number" in f.text]
    fix = "The inspection leaves them out, and a run refuses the file: repair or remove them."
    many = "6 rows have another number of fields than the 4 of the others: lines 12, 23, 34, 45, 56 and 1 more."
    one = "1 row has another number of fields than the 4 of the others: line 40."
    assert said == [wrong(str(gyro), many, fix, uneven_rows=6), wrong(str(accel), one, fix, uneven_rows=1)]
    assert not found.inspection.usable
    assert found.scenario is not None
    (tmp_path / "drive.toml").write_text(found.scenario)
    with pytest.raises(
        InputError, match=r"gyro\.csv, line 12: it has 5 fields; 4 separated by ',' are needed, as in line 1"
    ):
        inspect([tmp_path / "drive.toml"])


def test_what_a_suggested_scenario_is_made_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """The keys of the unit, with even stamps if two are equal, the receiver and the reference, each of its file."""
    asked: list[Any] = []
    monkeypatch.setattr(
        inspected_files, "suggested_scenario", lambda *given, **more: asked.append((given, more)) or "x"
    )
    at, later = np.array([0.0, 1.0, 1.0]), np.array([0.0, 1.0, 2.0])
    track = SimpleNamespace(latitude=np.array([np.nan, 0.5]))

    def file(name: str, **parts: Any) -> Any:
        usual: dict[str, Any] = {"inertial": {}, "fixes": {}, "solutions": {}}
        return SimpleNamespace(path=name, format=f"{name}-format", clock=f"{name}-clock", **{**usual, **parts})

    units = {"a": SimpleNamespace(time=at), "b": SimpleNamespace(time=later)}
    unit, fixes, solution = file("u", inertial=units), file("f", fixes={"one": 1}), file("s", solutions={"t": track})
    none: Any = None
    guessed: Any = SimpleNamespace(unit=None, fixes=())
    assert inspected_files._scenario(none, [fixes, unit, solution], guessed, Path("d"), True) == "x"
    ((given, more),) = asked
    assert given[1] == ("u", {"format": "u-format", "stream": "a", "stamps": "even"}, "u-clock")
    assert given[2] == ("f", {"format": "f-format"}, "f-clock")
    assert (given[3], given[4], more) == (Path("d"), ("s", "s-format", "s-clock"), {"land": True})
    asked.clear()
    even = file("u", inertial={"b": units["b"]})
    assert inspected_files._scenario(none, [even], guessed, Path("d"), False) == "x"
    assert asked[0][0][1:3] == (("u", {"format": "u-format"}, "u-clock"), None)
    assert asked[0][0][4] is None
    text = file("u", inertial=units)
    text.format = "text"
    assert inspected_files._scenario(none, [text, fixes], guessed, Path("d"), False) is None
