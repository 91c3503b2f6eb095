"""The command line as a stranger meets it: help, lists, checks, runs, and every kind of bad input."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import NoReturn

import pytest

import sinssim
from sinssim.cli import app as cli
from sinssim.cli.app import command_names
from sinssim.errors import InputError
from tests.fork import Fork
from tests.scenario.examples import FLIGHT, PARKED
from tests.slow import slow

HEAVY = ("numba", "scipy", "rerun", "jsbsim", "pyarrow", "matplotlib")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments: str) -> int:
    """Run the command line in this process and return its exit code."""
    with pytest.raises(SystemExit) as stopped:
        cli.main(arguments)
    code = stopped.value.code
    return code if isinstance(code, int) else 0


def everything_in(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def process(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "sinssim", *arguments], cwd=cwd, capture_output=True, text=True, check=False
    )


# Help and lists


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["list", "scenarios"], ["list", "views"],
     *slow((["--version"],), (["run", "--help"],), (["list", "algorithms"],))],
)  # fmt: skip
def test_light_commands_import_nothing_heavy(arguments: list[str]) -> None:
    code = (
        "import sys\nfrom sinssim.cli.app import main\n"
        "try:\n    main(sys.argv[1:])\n"
        f"except SystemExit as stop:\n    print([m for m in {HEAVY} if m in sys.modules], stop.code, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[] 0"
    assert done.stdout


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("--version") == 0
    assert capsys.readouterr().out == f"sinssim {sinssim.__version__}\n"


def test_the_help_begins_with_the_commands_of_every_day(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_names()[:4] == ["run", "view", "check", "compare"]
    assert call("--help") == 0
    out = capsys.readouterr().out
    places = [out.index(f"│ {name} ") for name in command_names()]
    assert places == sorted(places)


@pytest.mark.parametrize("command", command_names())
def test_every_command_has_help_with_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(command, "--help") == 0
    out = capsys.readouterr().out
    assert "Example" in out
    assert f"sinssim {command} " in out


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("aircraft", {"737", "c172x", "f16"}),
        ("scenarios", {"first_flight", "closure", "aerobatics", "trainer", "parked"}),
        ("algorithms", {"quaternion", "poisson", "euler"}),
        ("frames", {"level"}),
        ("gravity", {"normal", "j2", "somigliana", "order-1e-5", "order-1e-4", "order-1e-2"}),
        ("grades", {"ideal", "laser-navigation", "laser-standard", "tactical", "consumer"}),
        ("views", {"flight", "navigation", "sensors"}),
        ("aiding", {"gnss", "baro", "master", "zero_velocity", "star_tracker"}),
        ("states", {"gyro", "accelerometer"}),
    ],
)
def test_lists(kind: str, expected: set[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert call("list", kind) == 0
    lines = capsys.readouterr().out.splitlines()
    assert expected <= {line.split()[0] for line in lines}
    assert call("list", kind, "--json") == 0
    names = json.loads(capsys.readouterr().out)
    assert len(names) == len(lines)
    assert all(isinstance(sentence, str) and len(sentence) > 10 for sentence in names.values()), names


def test_list_shows_a_broken_scenario_beside_the_others(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "scenarios").mkdir()
    (folder / "scenarios" / "broken.toml").write_text("a = ")
    assert call("list", "scenarios") == 0
    out = capsys.readouterr().out
    assert "broken" in out
    assert "cannot be used" in out
    assert "first_flight" in out


def test_list_shows_views_by_their_first_line_and_broken_ones_beside_them(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SINSSIM_VIEWS", str(folder))
    (folder / "broken.py").write_text("def blueprint(run)")
    (folder / "binary.py").write_bytes(b"\xff\xfe")
    (folder / "long.py").write_text('"""The wind.\n\nIts levels, too.\n"""\n')
    assert call("list", "views", "--json") == 0
    views = json.loads(capsys.readouterr().out)
    assert views["broken"].startswith("(cannot be used: SyntaxError")
    assert views["binary"].startswith("(cannot be used: UnicodeDecodeError")
    assert views["flight"].startswith("The motion: its path")
    assert views["long"] == "The wind."


def test_a_grade_for_one_run(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "my_unit.toml"
    file.write_text('description = "mine"\nsource = "certificate 12"\ngyro_arw = 1\n', encoding="utf-8")
    assert call("run", "parked", "--grade", str(file), "-o", str(tmp_path / "run")) == 2
    assert "my_unit.toml, line 3: unknown key 'gyro_arw'" in capsys.readouterr().err
    assert call("sensors", str(file)) == 2
    assert "my_unit.toml, line 3: unknown key 'gyro_arw'" in capsys.readouterr().err
    file.write_text('description = "mine"\nsource = "certificate 12"\ngyro_arw_deg_sqrt_h = 1\n', encoding="utf-8")
    assert call("sensors", str(file)) == 0
    assert capsys.readouterr().out.startswith("my_unit: mine\nSource: certificate 12; not given and therefore zero:")


def test_list_of_grades_says_where_they_are_explained(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("list", "grades") == 0
    assert "sinssim sensors GRADE" in capsys.readouterr().err


# Sensors


def test_what_a_grade_means(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("sensors", "laser-standard", "--latitude", "45") == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "1,355 0.732 gyro bias, north at rest" in out
    assert "gyro_bias 0.01 deg/h 4.848e-08 rad/s" in out
    assert "Half of all runs end within 0.97 nmi per hour" in out


def test_what_a_grade_means_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    setting = "imu.gyro_quantum_arcsec=1.6"
    assert call("sensors", "laser-navigation", "--json", "--set", setting) == 0
    result = json.loads(capsys.readouterr().out)
    positions = [row["position_m"] for row in result["contributions"]]
    assert positions == sorted(positions, reverse=True)
    assert result["root_sum_square_m"] == pytest.approx(sum(p * p for p in positions) ** 0.5)
    assert {"name": "gyro_quantum", "value": 1.6, "unit": "arcsec"}.items() <= result["terms"][4].items()
    assert result["linear"] is True


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["laser-standrd"], "Did you mean 'laser-standard'?"),
        (["tactical", "--set", "gyro_quantum_arcsec=-1"], "gyro_quantum_arcsec = -1 must be at least 0"),
        (["tactical", "--set", "gyro_quantum=1"], "unknown key 'gyro_quantum'"),
        (["tactical", "--latitude", "91"], "--latitude"),
    ],
)
def test_sensors_that_are_not(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("sensors", *arguments) == 2
    assert said in capsys.readouterr().err


# Check


def test_check_shows_the_plan(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "plan.toml").write_text(FLIGHT)
    assert call("check", "plan.toml") == 0
    out = capsys.readouterr().out
    assert "flight      737, starts in the air at 51°, -0.5°, 3000 m" in out
    assert "leg 2   turn" in out
    assert "navigation  quaternion, euler" in out
    assert everything_in(folder) == {"plan.toml": FLIGHT.encode()}


def test_a_run_warns_of_what_check_refuses(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run goes on: here to a stop in the place of the flight."""

    def stop(*_: object, **__: object) -> None:
        raise InputError("the run began.")

    monkeypatch.setattr("sinssim.truth.flight.flight.cached_flight", stop)
    (folder / "plan.toml").write_text(FLIGHT)
    steep = ("--set", "flight.legs.1.altitude_m=14000.0")
    assert call("check", "plan.toml", *steep) == 2
    said = capsys.readouterr().err.strip()
    assert "is above the ceiling of the 737" in said
    assert call("run", "plan.toml", *steep) == 2
    warning, refusal = capsys.readouterr().err.strip().splitlines()
    assert warning.startswith("WARNING: ")
    assert warning.removeprefix("WARNING: ") in said
    assert "the run began." in refusal
    assert call("run", "plan.toml") == 2
    assert "WARNING" not in capsys.readouterr().err


def test_a_missing_package_is_named(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "plan.toml").write_text(FLIGHT)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "sinssim.recording.figures", None)
    monkeypatch.delitem(sys.modules, "sinssim.recording.figures")
    assert call("check", "plan.toml", "--plot", "plan.png") == 1
    said = capsys.readouterr().err
    assert "the package matplotlib, which this command needs, cannot be loaded" in said
    assert "make setup or by pip" in said
    assert "Traceback" not in said


def test_check_estimates_the_duration(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "plan.toml").write_text(FLIGHT)
    assert call("check", "plan.toml", "--json", "--set", "flight.legs.1.vertical_speed_mps=10.0") == 0
    result = json.loads(capsys.readouterr().out)
    # 1000 m at 10 m/s; then 90° at V/(g tan bank), the 737's 25° and 280 kt in air of the standard density at 4 km.
    turn = 1.5708 * (280 * 0.514444 * (1.225 / 0.8194) ** 0.5) / (9.81 * 0.46631)
    assert result["expected_duration_s"] == pytest.approx(100.0 + turn, abs=1.0)
    assert result["scenario"]["name"] == "short"


def test_check_of_a_parked_vehicle(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "plan.toml").write_text(PARKED)
    assert call("check", "plan.toml", "--json") == 0
    assert json.loads(capsys.readouterr().out)["expected_duration_s"] == 20


# Bad input


@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PARKED.replace("rate_hz = 20.0", "rate_hz ="), "plan.toml, line 8, column 10: TOML syntax: Invalid value"),
        (PARKED.replace("rate_hz", "rate_hs"), "line 8: unknown key 'imu.rate_hs'. Did you mean 'imu.rate_hz'?"),
        (PARKED.replace("duration_s", "duration_min"), "use 'duration_s' (duration_s = 1200)"),
        (PARKED.replace("20.0", '"long"', 1), "parked.duration_s must be a number, not the text 'long'"),
        (PARKED.replace("20.0", "0.0", 1), "parked.duration_s = 0.0 must be greater than 0"),
        (PARKED.replace("rate_hz = 20.0", "rate_hz = -20.0"), "imu.rate_hz = -20.0 must be greater than 0"),
        (PARKED.replace("56.0", "90.1"), "parked.latitude_deg = 90.1 must be at most 90"),
        (PARKED.replace("[imu]", '[imu]\ngrade = "gold"'), "unknown IMU grade 'gold'. Known: consumer, ideal,"),
        (FLIGHT.replace("737", "747"), "unknown aircraft '747'. Did you mean 'B747'?"),
        (FLIGHT.replace('"euler"', '"eular"'), "unknown algorithm 'eular'. Did you mean 'euler'?"),
    ],
)
def test_bad_scenario(folder: Path, capsys: pytest.CaptureFixture[str], command: str, text: str, said: str) -> None:
    (folder / "plan.toml").write_text(text)
    assert call(command, "plan.toml") == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("sinssim: plan.toml")
    assert said in captured.err
    assert captured.err.count("\n") == 1
    assert everything_in(folder) == {"plan.toml": text.encode()}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", "nowhere.toml"], "no scenario file 'nowhere.toml'"),
        (["run", "frist_flight"], "unknown scenario 'frist_flight'. Did you mean 'first_flight'?"),
        (["run", "plan.toml", "--set", "imu.rate=5"], "use 'rate_hz' (set from outside the file)"),
        (["run", "plan.toml", "--view", "navigatoin"], "unknown view 'navigatoin'. Did you mean 'navigation'?"),
        (["view", "nowhere"], "nowhere does not exist"),
        (["view", "."], "contains no recording.rrd"),
        (["view", "plan.toml", "--view", "flight"], "plan.toml is not a recording"),
    ],
)
def test_bad_arguments(folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str) -> None:
    (folder / "plan.toml").write_text(PARKED)
    assert call(*arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert said in captured.err
    assert everything_in(folder) == {"plan.toml": PARKED.encode()}


@pytest.mark.parametrize(
    "arguments",
    [
        ["run"],
        ["fly"],
        ["list"],
        ["list", "colours"],
        ["run", "x", "--nonsense"],
        ["view", "x", "--web", "--screenshot", "y"],
    ],
)
def test_wrong_usage(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert call(*arguments) == 2
    assert capsys.readouterr().out == ""


def test_no_traceback_but_with_debug(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "plan.toml").write_text(PARKED.replace("20.0", "-1.0"))
    assert call("run", "plan.toml") == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    debug = process("run", "plan.toml", "--debug", cwd=folder)
    assert debug.returncode == 1
    assert "Traceback" in debug.stderr
    assert "InputError" in debug.stderr


# Runs


def test_run_prints_the_errors_and_what_to_open(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "plan.toml").write_text(PARKED)
    assert call("run", "plan.toml") == 0
    captured = capsys.readouterr()
    assert captured.err == ""  # no progress bars where there is no terminal
    assert "standing: errors against the truth" in captured.out
    assert "quaternion" in captured.out
    assert "sinssim view runs/standing    (--web: in a browser)" in captured.out
    assert "runs/standing/report.html    (in any browser)" in captured.out
    for name in ("report.html", "scenario.toml", "summary.json", "recording.rrd", "streams/truth.parquet"):
        assert (folder / "runs" / "standing" / name).is_file()


def test_quiet_and_json(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "plan.toml").write_text(PARKED)
    assert call("run", "plan.toml", "-o", "a", "--quiet") == 0
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")
    assert call("run", "plan.toml", "-o", "b", "--json") == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    summary = json.loads(captured.out)
    assert summary == json.loads((folder / "b" / "summary.json").read_text())
    assert summary["algorithms"]["quaternion"]["max_horizontal_error_m"] > 0.0


def test_existing_directory_is_left_alone(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "plan.toml").write_text(PARKED)
    assert call("run", "plan.toml", "-o", "out", "--quiet") == 0
    before = everything_in(folder)
    assert call("run", "plan.toml", "-o", "out") == 2
    message = capsys.readouterr().err
    assert "out" in message
    assert "--overwrite" in message
    assert everything_in(folder) == before
    assert call("run", "plan.toml", "-o", "out", "--overwrite", "--quiet", "--set", "seed=5") == 0
    assert everything_in(folder).keys() == before.keys()
    assert "seed = 5" in (folder / "out" / "scenario.toml").read_text()


def test_output_that_cannot_be_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "plan.toml").write_text(PARKED)
    assert call("run", "plan.toml", "-o", "plan.toml/out") == 2
    assert "plan.toml" in capsys.readouterr().err
    assert everything_in(folder) == {"plan.toml": PARKED.encode()}


def test_more_samples_than_memory(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "plan.toml").write_text(PARKED)
    long = ("--set", "parked.duration_s=1e9", "--set", "imu.rate_hz=1e5")
    assert call("run", "plan.toml", *long) == 2  # known beforehand
    assert "imu.rate_hz = 100000 makes 1e+14 samples" in capsys.readouterr().err
    for module in ("scenario.planned_limits", "truth.sampling"):  # the memory is not known
        monkeypatch.setattr(f"sinssim.{module}.machine_memory", lambda: float("inf"))
    assert call("run", "plan.toml", *long) == 1
    message = capsys.readouterr().err
    assert message.startswith("sinssim: not enough memory")
    assert message.count("\n") == 1
    assert everything_in(folder) == {"plan.toml": PARKED.encode()}


def test_progress_on_a_terminal_only_and_on_standard_error(folder: Path) -> None:
    (folder / "plan.toml").write_text(PARKED)
    ours, theirs = os.openpty()

    def on_a_terminal() -> None:
        sys.stderr = open(theirs, "w")  # noqa: SIM115
        os.environ["TERM"] = "xterm"
        cli.main(["run", "plan.toml", "--json"])

    child = Fork(on_a_terminal)
    os.close(theirs)
    shown = b""
    with contextlib.suppress(OSError):  # the terminal's end
        while part := os.read(ours, 65536):
            shown += part
    os.close(ours)
    assert child.wait() == 0, shown
    json.loads(child.stdout.read())
    for word in ("Sensing", "Navigating", "Recording", "100%"):
        assert word in shown.decode()


@pytest.mark.parametrize("closed", slow(((1,),), ((2,),), ((0, 1, 2),)))
def test_closed_standard_streams(folder: Path, closed: tuple[int, ...]) -> None:
    """What is written there is lost and nothing else: no file of a run gets the number of standard output."""
    (folder / "plan.toml").write_text(PARKED)

    def close() -> None:
        for number in closed:
            os.close(number)

    command = [sys.executable, "-m", "sinssim", "run", "plan.toml", "-o", "out"]
    done = subprocess.run(command, cwd=folder, preexec_fn=close, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert bool(done.stdout) == (1 not in closed)
    assert json.loads((folder / "out" / "summary.json").read_text())["status"] == "finished"


@pytest.mark.parametrize("command", [["--help"], *slow((["list", "grades"],), (["check", "parked"],))])
def test_a_reader_that_has_enough(folder: Path, command: list[str]) -> None:
    """As `head -1`: the exit code of a program that SIGPIPE ends, and not a word."""
    ours, theirs = os.pipe()
    os.close(ours)
    done = subprocess.run(
        [sys.executable, "-m", "sinssim", *command], stdout=theirs, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(theirs)
    assert (done.returncode, done.stderr) == (141, "")


def test_a_new_project_with_closed_standard_streams(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its files do not get their numbers either."""
    command = [sys.executable, "-m", "sinssim", "new", "mine"]
    done = subprocess.run(command, cwd=folder, preexec_fn=lambda: os.closerange(0, 3), capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")
    assert call("new", "again") == 0
    capsys.readouterr()
    assert everything_in(folder / "mine") == everything_in(folder / "again")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_before_anything_is_loaded(folder: Path, number: signal.Signals) -> None:
    """While the modules of the command line are imported: as later, code 130 and one line."""
    text = f"import os, signal, time\nos.kill(os.getpid(), {int(number)})\ntime.sleep(10)\n"
    (folder / "typer.py").write_text(text)
    done = subprocess.run(
        [sys.executable, "-m", "sinssim", "--version"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), *sys.path])},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "Interrupted.\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_errors_onto_a_full_disk_keep_their_code(folder: Path) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-m", "sinssim", "list", "colours"], stderr=full, check=False)
    assert done.returncode == 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_output_onto_a_full_disk(folder: Path) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "sinssim", "list", "grades"], stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert done.returncode == 1
    assert (
        done.stderr.decode() == "sinssim: the operating system reported an error: [Errno 28] No space left on device.\n"
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt(folder: Path, number: signal.Signals) -> None:
    """Ctrl-C, or being told to terminate, ends a run with code 130, one line, and no broken files."""
    (folder / "plan.toml").write_text(PARKED.replace("20.0", "4000.0", 1).replace("rate_hz = 20.0", "rate_hz = 100.0"))
    child = Fork(lambda: cli.main(["run", "plan.toml", "-o", "out"]))
    deadline = time.monotonic() + 60.0
    while len(list(folder.iterdir())) < 2 and time.monotonic() < deadline and child.poll() is None:
        time.sleep(0.02)  # until the run has begun to write
    child.kill(number)
    err = child.stderr()
    assert child.returncode == 130, err
    assert child.stdout.read() == b""
    assert err.startswith("Interrupted.")
    assert "Traceback" not in err
    for summary in folder.glob("*/summary.json"):
        json.loads(summary.read_text())
    assert not list(folder.glob(".*"))


@pytest.mark.parametrize("where", ["sinssim.cli.commands.content.names_of", "sinssim.cli.app.app"])
def test_interrupt_of_any_command_at_any_time(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], where: str
) -> None:
    """Whether the command was under way or typer was still putting it together: code 130 and one line."""

    def interrupted(*args: object, **kwargs: object) -> NoReturn:
        raise KeyboardInterrupt

    monkeypatch.setattr(where, interrupted)
    with pytest.raises(SystemExit) as end:
        cli.main(["list", "grades"])
    assert end.value.code == 130
    assert capsys.readouterr() == ("", "Interrupted.\n")
