"""Navigators of others: what they get, what their answers become, each fault, and what is started."""

from __future__ import annotations

import math
import os
import shutil
import signal
import struct
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.cli.app import main
from sinssim.content import new_navigator, package_content
from sinssim.data import ImuData, Measurements, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError, RunError
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.navigation_section import NavigatorSection
from sinssim.simulation import foreign_navigator
from sinssim.simulation.foreign_navigator import (
    VARIABLE,
    _end_words,
    check_programs,
    end_programs,
    first_message,
    foreign_solutions,
)
from sinssim.simulation.navigator_protocol import Feed, _check_rows, rows_of, solution_of
from sinssim.simulation.truth_and_sensors import RecordedMotion
from tests.slow import slow

TEMPLATES = package_content("scenarios") / "new_navigator"
MOST = 5000

PROGRAM = '''
import os, struct, sys, time
fault, text = sys.argv[1], len(sys.argv) > 2
read, out = sys.stdin.buffer.read, sys.stdout.buffer
STATE = (0.8, 0.2, 100.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
def answer(t, state=STATE):
    out.write(struct.pack("<HHI11d", 6, 0, 88, t, *state)); out.flush()
print("begun", fault, file=sys.stderr, flush=True)
if fault == "exits": sys.exit(3)
if fault == "killed": os.kill(os.getpid(), 11)
if fault == "hangs": time.sleep(60)
if fault == "no header": print("latitude 0.8 0.2 100.0 0 0 0"); sys.exit()
read(16)
out.write(struct.pack("<8sII", b"SINSSIM\\0", 2 if fault == "version" else 1, 0))
if fault == "kind": out.write(struct.pack("<HHI", 9, 0, 4000))
while fault == "floods": answer(0.0)
number = 0
while True:
    kind, index, size = struct.unpack("<HHI", read(8))
    data = read(size)
    if kind == 5: break
    if kind != 3: continue
    t, number = struct.unpack_from("<d", data)[0], number + 1
    if fault == "stops" and number > 50: continue
    if fault == "leaves" and number > 50: sys.exit()
    if fault == "stuck" and number > 50: time.sleep(60)
    if number == 50:
        if fault == "nan": answer(t, (float("nan"),) * 10); continue
        if fault == "twice": answer(t)
        if fault == "behind": answer(t - 0.05); continue
        if fault == "ahead": answer(t + 100.0); continue
        if fault == "degrees": answer(t, (50.0, *STATE[1:])); continue
        if fault == "norm": answer(t, (*STATE[:6], 0.5, 0.0, 0.0, 0.0)); continue
        if fault == "cut": out.write(b"1234"); continue
    if fault == "late": t -= 0.02
    answer(t)
if fault == "child":
    if not os.fork(): time.sleep(60)
'''  # fmt: skip

FAULTS = {
    "exits": r"it ends with status 3; it was sent .*\. Its standard error ends with: begun exits$",
    "killed": r"it ends with the signal SIGSEGV",
    "hangs": r"it hangs: for 0\.4 s it has neither read nor answered",
    "stuck": r"it hangs: for 0\.4 s it has neither read nor answered; it was sent the samples up to 2 s",
    "no header": r"its answer begins with 'latitude 0\.8 0\.2' instead of the header of the protocol; form = .text. in",
    "version": r"it answers in version 2 of the protocol, but this is version 1\.",
    "kind": r"it answers with a message of kind 9 and 4000 bytes; a solution has kind 6 and 88 or 216 bytes\.",
    "floods": r"it floods: it has written \d+ bytes for 100 samples\.",
    "stops": r"its last solution is that of 1 s, and the run ends at 2 s\.",
    "leaves": r"its last solution is that of 1 s, and the run ends at 2 s\.",
    "nan": r"its solution of 1 s is not finite\.",
    "twice": r"its solution of 1 s comes twice\.",
    "behind": r"its solution of 0\.95 s is out of order: it comes after that of 0\.98 s\.",
    "ahead": r"its solution of 101 s lies after the end of the run\.",
    "degrees": r"its solution of 1 s has a latitude of 50\.0 rad\.",
    "norm": r"its solution of 1 s has a quaternion of the norm 0\.500\.",
    "cut": r"a message of kind 12849 and|has another size|its last message ends",
}


@pytest.fixture(autouse=True)
def allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "allow")


def scenario_of(*navigators: dict[str, Any], **tables: Any) -> Scenario:
    """Return two seconds at rest with navigators of others."""
    return Scenario.model_validate(
        {
            "name": "rest",
            "parked": {"latitude_deg": 45.0, "longitude_deg": 10.0, "altitude_m": 100.0, "duration_s": 2.0},
            "imu": {"grade": "tactical", "rate_hz": 50.0},
            "navigator": list(navigators),
            **tables,
        }
    )


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("programs") / "faulty.py"
    file.write_text(PROGRAM)
    return file


@pytest.fixture
def one(program: Path) -> Callable[..., dict[str, Any]]:
    """A navigator with a fault."""

    def table(fault: str, **keys: Any) -> dict[str, Any]:
        return {"name": "mine", "command": [sys.executable, "-I", "-S", str(program), fault], **keys}

    return table


def failure_of(scenario: Scenario) -> str:
    from sinssim.scenario.true_motion import fly
    from sinssim.simulation.navigation_stage import navigate
    from sinssim.simulation.truth_and_sensors import sense, truth_along

    sensed = sense(scenario, truth_along(fly(scenario), scenario))
    navigated = navigate(scenario, sensed)
    assert list(navigated.solutions) == ["quaternion"], "the run goes on with the others"
    return str(navigated.failures["mine"])


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_named_and_the_run_goes_on(fault: str, one: Callable[..., dict[str, Any]]) -> None:
    import re

    begin = time.monotonic()
    failure = failure_of(scenario_of(one(fault, timeout_s=0.4)))
    assert re.search(FAULTS[fault], failure), failure
    if fault == "floods":  # more than two full answers of 224 bytes for each sample, and a thousand of them
        assert int(failure.split("written ")[1].split()[0]) > (2 * 100 + 1000) * 224
    assert time.monotonic() - begin < 20.0, "nothing waits for the sleep of a minute"


def test_stepwise_an_answer_to_another_sample_is_late(one: Callable[..., dict[str, Any]]) -> None:
    failure = failure_of(scenario_of(one("late", step="stepwise")))
    assert failure.startswith("it is late: it answers the sample of 0.02 s with the solution of 0 s.")
    assert failure_of(scenario_of(one("twice", step="stepwise"))).startswith("it answers more than once a sample")
    assert failure_of(scenario_of(one("leaves", step="stepwise"))).startswith("it answers nothing any more")


def test_a_program_that_is_missing_is_a_failure_if_it_goes_after_the_check(program: Path) -> None:
    there = program.with_name("gone")
    there.write_text("#!/nowhere\n")
    there.chmod(0o755)
    failure = failure_of(scenario_of({"name": "mine", "command": [str(there)]}))
    assert failure.startswith(f"it cannot be started: {str(there)!r}: No such file or directory.")


def test_the_children_of_a_program_end_with_it(one: Callable[..., dict[str, Any]]) -> None:
    """The child of the program holds its standard output for a minute; that is a hang, and both are ended."""
    begin = time.monotonic()
    assert "it hangs" in failure_of(scenario_of(one("child", timeout_s=0.4)))
    assert time.monotonic() - begin < 20.0


def test_an_interruption_ends_the_program(one: Callable[..., dict[str, Any]]) -> None:
    timer = threading.Timer(1.0, signal.pthread_kill, (threading.main_thread().ident, signal.SIGINT))
    scenario = scenario_of(one("hangs"))
    timer.start()
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        failure_of(scenario)
    assert time.monotonic() - started < 20.0
    end_programs()


def readings() -> Measurements:
    """Two measurements: valid at 0.010 s and arriving at 0.035 s; valid and arriving at 0.040 s."""
    return Measurements(
        "baro-height", np.array([0.010, 0.040]), np.array([0.035, 0.040]), np.array([[101.0], [102.0]]),
        np.array([[3.0], [4.0]]), name="baro",
    )  # fmt: skip


def begin() -> dict[str, Any]:
    from sinssim.simulation.navigator_protocol import BEGIN_TYPE

    numbers = {name: np.zeros(BEGIN_TYPE[name].shape) for name in BEGIN_TYPE.names or ()}
    return {**numbers, "state": np.arange(10.0), "gravity": "normal"}


def test_messages_by_hand() -> None:
    """Samples of 20 ms, and each measurement after the sample at or after its arrival, decoded without numpy."""
    imu = ImuData(0.02 * np.arange(4), np.arange(9.0).reshape(3, 3), 10.0 + np.arange(9.0).reshape(3, 3))
    feed = Feed(begin(), imu, (readings(),), rates=True)
    opening = feed.opening()
    assert struct.unpack_from("<8sII", opening) == (b"SINSSIM\0", 1, 0)
    assert struct.unpack_from("<HHI", opening, 16) == (1, 0, 528)
    assert struct.unpack_from("<10d", opening, 24 + 16) == tuple(range(10))
    assert struct.unpack_from("<HHI", opening, 24 + 528) == (2, 0, 96)
    assert opening[560:571].rstrip(b"\0") == b"baro"
    (block,) = feed.blocks()
    data, messages = bytes(block.data), []
    while data:
        kind, index, size = struct.unpack_from("<HHI", data)
        messages.append((kind, index, struct.unpack_from(f"<{size // 8}d", data, 8)))
        data = data[8 + size :]
    kinds = [(kind, index) for kind, index, _ in messages]
    assert kinds == [(3, 0), (3, 2), (4, 0), (4, 0), (3, 0)]
    assert messages[0][2] == pytest.approx((0.02, 0.02, 0.0, 50.0, 100.0, 500.0, 550.0, 600.0))
    assert messages[2][2] == (0.035, 0.010, 101.0, 3.0)
    assert messages[3][2] == (0.040, 0.040, 102.0, 4.0)
    assert [len(bytes(part)) for part in block.parts] == [72, 72 + 2 * 40, 72]


def test_the_first_message_has_the_errors_of_start_and_sensors() -> None:
    """1σ of the heading is the hypotenuse of 3′ and 4′; the sensors have 6 and 12 times their unit."""
    errors = {"heading_arcmin": 3.0, "heading_sigma_arcmin": 4.0, "north_m": 5.0, "position_sigma_m": 12.0,
              "roll_arcmin": 2.0, "pitch_arcmin": 3.0, "tilt_sigma_arcmin": 6.0, "height_m": 8.0,
              "height_sigma_m": 15.0,
              "velocity_north_mps": 1.5, "velocity_down_mps": 2.0, "velocity_sigma_mps": 2.0}  # fmt: skip
    sensors = {"gyro_rrw_deg_h_sqrt_h": 6.0, "gyro_instability_deg_h": 12.0,
               "accel_rrw_ug_sqrt_h": 6.0, "accel_instability_ug": 12.0}  # fmt: skip
    scenario = scenario_of(
        imu={"grade": "ideal", "rate_hz": 50.0, **sensors}, navigation={"initial_error": errors},
    )  # fmt: skip
    imu = ImuData(0.02 * np.arange(3), np.zeros((2, 3)), np.zeros((2, 3)))
    start = NavState(0.8, 0.2, 100.0, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    numbers = first_message(scenario, WGS84, 7.0, imu, start)
    arcmin, per_hour, microg = math.pi / 10_800.0, math.pi / 648_000.0, 9.80665e-6
    assert numbers["state_sigma"] == pytest.approx(
        [13.0, 12.0, 17.0, 2.5, 2.0, 8.0**0.5, 7.0 * arcmin, 7.0 * arcmin, 5.0 * arcmin], rel=1e-12, abs=0.0
    )
    assert numbers["gyro_walk"] == pytest.approx(6.0 * per_hour / 60.0, rel=1e-12, abs=0.0)
    assert numbers["gyro_instability"] == pytest.approx(12.0 * per_hour, rel=1e-12, abs=0.0)
    assert numbers["accel_walk"] == pytest.approx(6.0 * microg / 60.0, rel=1e-12, abs=0.0)
    assert numbers["accel_instability"] == pytest.approx(12.0 * microg, rel=1e-12, abs=0.0)


def test_lines_of_text_say_the_same() -> None:
    imu = ImuData(0.02 * np.arange(4), np.arange(9.0).reshape(3, 3), 10.0 + np.arange(9.0).reshape(3, 3))
    feed = Feed(begin(), imu, (readings(),), text=True)
    opening = feed.opening().decode().splitlines()
    assert opening[0] == "sinssim 1"
    assert opening[3] == "state 0.0 1.0 2.0 3.0 4.0 5.0 6.0 7.0 8.0 9.0"
    assert opening[-2:] == ["sensor 0 baro baro-height 0.0 0.0 0.0 1 1", "begin"]
    (block,) = feed.blocks()
    lines = bytes(block.data).decode().splitlines()
    assert lines[1] == "imu 0.04 0.02 3.0 4.0 5.0 13.0 14.0 15.0 2"
    assert lines[2:4] == ["measurement 0 0.035 0.01 101.0 3.0", "measurement 0 0.04 0.04 102.0 4.0"]
    assert [bytes(part).count(b"\n") for part in block.parts] == [1, 3, 1]


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> sinssim.Run:
    """A turn of a drive, navigated by the adapters in Python and in C, in every way that they can be run."""
    cc = shutil.which("cc")
    if cc is None:
        pytest.skip("there is no C compiler")
    import subprocess

    folder = tmp_path_factory.mktemp("navigators")
    for file in (TEMPLATES / "c").iterdir():
        shutil.copy(file, folder)
    for way in (["-shared", "-fPIC", "-o", "mine.so"], ["-DSINSSIM_PROGRAM", "-o", "mine"]):
        subprocess.run(
            [cc, "-O2", "-Wall", "-Wextra", "-Werror", "my_navigator.c", *way, "-lm"], cwd=folder, check=True
        )
    python = [sys.executable, "-I", "-S", str(TEMPLATES / "python" / "my_navigator.py")]
    inputs = ["imu", "gnss"]
    scenario = scenario_of(
        {"name": "python", "command": python, "inputs": inputs},
        {"name": "library", "library": str(folder / "mine.so"), "inputs": inputs},
        {"name": "program", "command": [str(folder / "mine")], "inputs": inputs},
        {"name": "steps", "command": [str(folder / "mine")], "inputs": inputs, "step": "stepwise"},
        {"name": "alone", "library": str(folder / "mine.so"), "step": "stepwise"},
        parked=None,
        great_circle={"latitude_deg": 50.0, "longitude_deg": 14.5, "altitude_m": 120.0, "course_deg": 80.0,
                      "speed_mps": 100.0, "duration_s": 20.0},
        aiding={"gnss": {"rate_hz": 5.0, "latency_s": 0.13}},
        navigation={"algorithms": ["quaternion"], "vertical": "free",
                    "initial_error": {"velocity_east_mps": 0.1, "heading_arcmin": 5.0}},
    )  # fmt: skip
    os.environ[VARIABLE] = "allow"
    run = sinssim.run(scenario)
    del os.environ[VARIABLE]
    assert isinstance(run, sinssim.Run)
    return run


def test_adapters_navigate_as_the_algorithm_does(compared: sinssim.Run) -> None:
    """Other code of the same order: apart by what one sample a step misses, a thousandth of the errors of the run."""
    assert compared.summary["failures"] == {}
    ours = compared.errors["quaternion"]
    assert ours.horizontal[-1] > 2.0
    for name in ("python", "library", "program", "steps", "alone"):
        theirs = compared.errors[name]
        assert np.array_equal(theirs.time, ours.time), name
        assert np.abs(theirs.position_ned - ours.position_ned).max() < 2e-3, name
        assert np.abs(theirs.velocity_ned - ours.velocity_ned).max() < 2e-4, name
        assert np.abs(theirs.attitude - ours.attitude).max() < 1e-6, name


def test_the_same_code_gives_the_same_bits_by_every_way(compared: sinssim.Run) -> None:
    solutions = compared.solutions
    for name in ("program", "steps", "alone"):
        assert np.array_equal(solutions[name].q_nb, solutions["library"].q_nb)
        assert np.array_equal(solutions[name].latitude, solutions["library"].latitude)


def test_nothing_is_started_unasked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE)
    program, trace = tmp_path / "navigators" / "nav", tmp_path / "started"
    program.parent.mkdir()
    program.write_text(f"#!/bin/sh\ntouch {trace}\n")
    program.chmod(0o755)
    file = tmp_path / "rest.toml"
    file.write_text(
        'name = "rest"\n[parked]\nlatitude_deg = 45.0\nduration_s = 2.0\n[[navigator]]\nname = "mine"\n'
        'command = ["./navigators/nav"]\n'
    )
    scenario = load_scenario(file)
    assert scenario.navigator[0].command == (str(program),)
    for words in (["check", str(file)], ["list", "algorithms"], ["run", str(file), "-o", str(tmp_path / "run"), "-q"]):
        with pytest.raises(SystemExit) as end:
            main(words)
        assert end.value.code == (2 if words[0] == "run" else 0)
    with pytest.raises(InputError, match="is started only if you allow it: give --allow-programs, or keep it in"):
        sinssim.run(scenario, tmp_path / "run")
    with pytest.raises(InputError, match="allow-programs"):
        sinssim.ensemble(scenario, 2)
    with pytest.raises(InputError, match="allow-programs"):
        foreign_solutions(scenario, None, None, None, None)  # type: ignore[arg-type]
    assert not trace.exists()
    assert not (tmp_path / "run").exists()
    check_programs(load_scenario(file, 'use=["."]'.replace(".", str(tmp_path))))
    monkeypatch.setenv("SINSSIM_CONTENT", str(tmp_path))
    check_programs(scenario)
    program.chmod(0o757)  # which others may change
    with pytest.raises(InputError, match="allow-programs"):
        check_programs(scenario)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"command": ["./nav"], "library": "nav.so"}, "give exactly one of them; here command and library are given"),
        ({}, "command names a program, library a shared library: give exactly one of them; here none is given"),
        ({"command": ["nav"], "inputs": ["imu", "sextant"]}, "navigator.1.inputs: unknown input 'sextant'"),
        ({"command": ["nav"], "inputs": ["gnss"]}, 'inputs must have "imu"'),
        ({"name": "quaternion", "command": ["nav"]}, 'name = "quaternion" is the name of another solution'),
        ({"library": "nav.so", "form": "text"}, 'form = "text" is for programs'),
    ],
)
def test_mistakes_in_a_table(table: dict[str, Any], message: str) -> None:
    import re

    from pydantic import ValidationError

    with pytest.raises(ValidationError, match=re.escape(message)):
        scenario_of({"name": "mine", **table})


def test_files_that_are_missing_or_no_libraries(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"navigator\.1\.command: there is no program 'no-such-navigator'\."):
        check_programs(scenario_of({"name": "mine", "command": ["no-such-navigator"]}))
    with pytest.raises(InputError, match=r"navigator\.1\.library: there is no file '/nowhere/nav\.so'\."):
        check_programs(scenario_of({"name": "mine", "library": "/nowhere/nav.so"}))
    text = tmp_path / "nav.so"
    text.write_text("no library")
    with pytest.raises(InputError, match=r"navigator\.1\.library: .*nav\.so cannot be loaded: .*file too short"):
        check_programs(scenario_of({"name": "mine", "library": str(text)}))
    if shutil.which("cc"):
        import subprocess

        for number, code in enumerate(("int x;", "unsigned sinssim_version(void) { return 7; } int sinssim_begin, "
                                       "sinssim_block, sinssim_end;")):  # fmt: skip
            (tmp_path / "x.c").write_text(code)
            file = tmp_path / f"x{number}.so"
            subprocess.run(["cc", "-shared", "-fPIC", "-o", str(file), str(tmp_path / "x.c")], check=True)
            match = ("has no function sinssim_version and no sinssim_begin", "has version 7 of the protocol, but")[
                number
            ]
            with pytest.raises(InputError, match=match):
                check_programs(scenario_of({"name": "mine", "library": str(file)}))


def test_a_text_program_and_what_it_states(tmp_path: Path) -> None:
    """σ, biases and status, at every tenth sample, in text; it is started once, also beside a filter.

    Of the errors of the start, 2, 1 and 4 m, those to the east are within the 1σ of 1, 2 and 3 m.
    """
    program, trace = tmp_path / "text.py", tmp_path / "started"
    program.write_text(
        "import sys\n"
        f"open({str(trace)!r}, 'a').write('x')\n"
        "print('sinssim 1')\n"
        "for line in sys.stdin:\n"
        "    word, *numbers = line.split()\n"
        "    if word == 'state': state = numbers\n"
        "    if word == 'imu' and round(float(numbers[0]) * 50) % 10 == 0:\n"
        "        print('solution', numbers[0], *state, *range(1, 10), *range(10, 16), 7)\n"
        "print('done', file=sys.stderr)\n"
    )
    scenario = scenario_of(
        {"name": "mine", "command": [sys.executable, "-I", str(program)], "form": "text", "inputs": ["imu", "gnss"]},
        aiding={"gnss": {"rate_hz": 5.0}}, filter={"diagnose": False},
        navigation={"initial_error": {"north_m": 2.0, "east_m": 1.0, "height_m": 4.0}},
    )  # fmt: skip
    run = sinssim.run(scenario, tmp_path / "run")
    assert isinstance(run, sinssim.Run)
    solution: Any = run.solutions["mine"]
    assert trace.read_text() == "x"
    assert solution.time == pytest.approx([0.2 * k for k in range(11)])
    assert list(solution.sigma[1]) == list(range(1, 10))
    assert list(solution.biases[3]) == list(range(10, 16))
    assert solution.status[-1] == 7
    assert np.isnan(solution.status[0])
    assert solution.messages == "done\n"
    assert run.errors["mine"].position_ned[:, 0] == pytest.approx(2.0, abs=1e-5)
    entry = run.summary["navigators"]["mine"]
    assert entry["solutions"] == 11
    assert entry["within_sigma"] == pytest.approx({"position": 1 / 3, "velocity": 1.0, "attitude": 1.0})
    assert entry["status"] == {"7": 10}
    assert (tmp_path / "run" / "navigators" / "mine.txt").read_text() == "done\n"
    stream = sinssim.load_streams(tmp_path / "run")["navigator_mine"]
    assert list(stream["sigma_velocity_n_mps"][1:3]) == [4.0, 4.0]
    assert "Navigators of others" in (tmp_path / "run" / "report.html").read_text()


def test_a_name_is_only_once() -> None:
    from pydantic import ValidationError

    with pytest.raises(ValidationError, match="stands 2 times"):
        scenario_of({"name": "a", "command": ["x"]}, {"name": "a", "command": ["y"]})
    assert NavigatorSection(name="a", command=("x",)).timeout_s == 60.0


COMPILERS = {"c": "cc", "c++": "c++", "python": "python3", "octave": "octave-cli", "rust": "rustc"}


@pytest.mark.parametrize("language", ["c", "c++", "python", "rust", *slow("octave")])
def test_a_new_navigator_runs(language: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the commands that are printed; nothing is allowed beyond the folder's own use. Its error is that of ours."""
    import subprocess

    if shutil.which(COMPILERS[language]) is None:
        pytest.skip(f"there is no {COMPILERS[language]}")
    monkeypatch.delenv(VARIABLE)
    monkeypatch.chdir(tmp_path)
    files, build = new_navigator(Path("mine"), language)
    assert all((tmp_path / "mine" / name).is_file() for name, _ in files)
    if build:
        subprocess.run(build.split(), cwd=tmp_path / "mine" / "navigators", check=True)
    run = sinssim.run("mine/scenario.toml", overrides=["imu.rate_hz=20", "filter.diagnose=false"])
    assert isinstance(run, sinssim.Run)
    assert run.summary["failures"] == {}
    ours, theirs = run.errors["quaternion"], run.errors["mine"]
    assert ours.horizontal[-1] > 0.5
    assert np.abs(theirs.position_ned - ours.position_ned).max() < 0.05 * ours.horizontal[-1]
    assert np.abs(theirs.attitude - ours.attitude).max() < 1e-4


def drifting(program: Path, **ensemble: Any) -> Scenario:
    """Return a run with a navigator that answers as it began, and fails if it was told to begin to the north."""
    program.write_text(
        "import sys\n"
        "print('sinssim 1')\n"
        "for line in sys.stdin:\n"
        "    word, *numbers = line.split()\n"
        "    if word == 'state': state = numbers\n"
        "    if word == 'imu': print('solution', numbers[0], *state)\n"
        "if float(state[3]) > 0.0: sys.exit(5)\n"
    )
    command = [sys.executable, "-I", "-S", str(program)]
    return scenario_of(
        {"name": "mine", "command": command, "form": "text"},
        navigation={"initial_error": {"velocity_sigma_mps": 1.0}},
        ensemble={"solution": "mine", "epoch_s": 0.5, **ensemble},
    )


def test_an_ensemble_of_its_runs(tmp_path: Path) -> None:
    """Its errors are those of single runs; a run in which it fails is a failed run; a directory is continued."""
    from sinssim.experiments.ensembles.ensemble_plan import run_seed

    scenario = drifting(tmp_path / "mine.py")
    first = sinssim.ensemble(scenario, 2, tmp_path / "many", threads=2)
    assert first.computed == 2
    result = sinssim.ensemble(scenario, 4, tmp_path / "many", resume=True, threads=2)
    assert result.computed == 2
    failed = result.failures
    for number in range(4):
        single = sinssim.run(scenario.model_copy(update={"seed": run_seed(scenario.seed, number)}))
        assert isinstance(single, sinssim.Run)
        why = single.summary["failures"].get("mine")
        assert (why is None) == (number not in failed)
        if why is None:
            error = single.errors["mine"]
            assert np.array_equal(result.errors.velocity_ned[number, -1], error.velocity_ned[-1])
        else:
            assert failed[number] == why["text"]
            assert "it ends with status 5" in why["text"]
    assert 0 < len(failed) < 4


def test_a_changed_program_is_another_ensemble(tmp_path: Path) -> None:
    scenario = drifting(tmp_path / "mine.py")
    sinssim.ensemble(scenario, 2, tmp_path / "many", threads=1)
    (tmp_path / "mine.py").write_text((tmp_path / "mine.py").read_text() + "# changed\n")
    with pytest.raises(InputError, match=r"many contains another ensemble|another ensemble|own_content"):
        sinssim.ensemble(scenario, 3, tmp_path / "many", resume=True, threads=1)


@pytest.mark.slow
def test_an_hour_of_s_turns_in_c(tmp_path: Path) -> None:
    """The error of one sample a step with corrections of second order, as that of pyins on the same motion: 13.5 m."""
    import subprocess

    from sinssim.earth.ellipsoids import WGS84
    from sinssim.simulation.foreign_navigator import navigated
    from tests.oracles.s_turn import STurn

    if shutil.which("cc") is None:
        pytest.skip("there is no cc")

    def gravity(latitude: Any, height: float) -> tuple[Any, Any]:
        """Normal gravity to the second order in the height, without a component to the north: that of the example."""
        s2, ratio = np.sin(latitude) ** 2, height / WGS84.a
        m = WGS84.omega**2 * WGS84.a**2 * WGS84.b / WGS84.gm
        surface = WGS84.gamma_e * (1.0 + WGS84.k * s2) / np.sqrt(1.0 - WGS84.e2 * s2)
        return 0.0 * s2, surface * (1.0 - 2.0 * ratio * (1.0 + WGS84.f + m - 2.0 * WGS84.f * s2) + 3.0 * ratio**2)

    flight = STurn(duration=3600.0, gravity=gravity).fly(100.0)
    place = (flight.latitude[0], flight.longitude[0], flight.height[0])
    numbers = {
        **begin(), "state": np.concatenate([place, flight.velocity_ned[0], flight.q_nb[0]]),
        "ellipsoid": (WGS84.a, WGS84.f, WGS84.gm, WGS84.omega), "gravity_equator": WGS84.gamma_e, "gravity_k": WGS84.k,
    }  # fmt: skip
    command = ["cc", "-O2", "-shared", "-fPIC", "-o", str(tmp_path / "c.so"), "my_navigator.c", "-lm"]
    subprocess.run(command, cwd=TEMPLATES / "c", check=True)
    feed = Feed(numbers, ImuData(flight.time, flight.dtheta, flight.dvel), ())
    solution = navigated(NavigatorSection(name="c", library=str(tmp_path / "c.so")), feed)
    assert flight.horizontal_error(solution.latitude, solution.longitude).max() == pytest.approx(13.5, abs=0.1)


HEAD = b"SINSSIM\0" + struct.pack("<II", 1, 0)
STATE = struct.pack("<HHI11d", 6, 0, 88, *([0.0] * 11))
FULL = struct.pack("<HHI27d", 6, 0, 216, *([0.0] * 27))


@pytest.mark.parametrize(
    ("data", "text", "words"),
    [
        (HEAD, False, "it answers no solution."),
        (HEAD[:4], False, "its answer begins with 'SINS' instead of the header of the protocol; form"),
        (b"\xff" * 16, False, "instead of the header of the protocol."),
        (b"ABCDEFG\0" + HEAD[8:], False, "instead of the header of the protocol."),
        (HEAD + STATE + FULL, False, "its solution number 2 has another size than those before."),
        (HEAD + STATE + STATE[:40], False, "its last message ends after 40 of 96 bytes."),
        (b"", True, 'its answer begins with nothing instead of the line "sinssim 1".'),
        (b"latitude 1\n", True, "its answer begins with 'latitude 1' instead of the line \"sinssim 1\"."),
        (b"sinssim 2\n", True, "it answers in version 2 of the protocol, but this is version 1."),
        (b"sinssim 1\n", True, "it answers no solution."),
        (b"sinssim 1\n\n", True,
         "line 2 of its answer, '', is not \"solution\" with 11 or 27 numbers, the same in all lines."),
        (b"sinssim 1\nsolution 1 2\n", True,
         "line 2 of its answer, 'solution 1 2', is not \"solution\" with 11 or 27 numbers, the same in all lines."),
        (b"sinssim 1\nsolution" + 10 * b" 1" + b" x\n", True,
         "line 2 of its answer, 'solution 1 1 1 1 1 1 1 1 1 1 x', has a word for a number."),
    ],
)  # fmt: skip
def test_answers_that_are_none(data: bytes, text: bool, words: str) -> None:
    with pytest.raises(RunError) as error:
        rows_of(data, text=text)
    assert words in str(error.value)
    assert str(error.value).endswith(words) or words.endswith("form")
    assert error.value.exit_code == (2 if "version" in words else 1)


def test_how_a_program_ends() -> None:
    words = [_end_words(code) for code in (0, 3, -9, -99)]
    assert words == ["status 0", "status 3", "the signal SIGKILL", "the signal 99"]


def test_a_file_that_cannot_be_executed(tmp_path: Path) -> None:
    (tmp_path / "nav").write_text("text")
    with pytest.raises(InputError, match=r"navigator\.1\.command: '.*nav' is not executable \(chmod \+x\)\."):
        check_programs(scenario_of({"name": "mine", "command": [str(tmp_path / "nav")]}))


def test_after_an_alignment_the_sensors_give_the_errors_of_the_start() -> None:
    """50 µg tilt by 50e-6 g; 0.01 deg/h turn the heading by their ratio to the Earth's rate to the north."""
    scenario = scenario_of(
        imu={"grade": "ideal", "rate_hz": 50.0, "gyro_bias_sigma_deg_h": 0.01, "accel_bias_sigma_ug": 50.0},
        navigation={"alignment": {"duration_s": 10.0}},
        parked={"latitude_deg": 45.0, "duration_s": 20.0},
    )
    imu = ImuData(0.02 * np.arange(3), np.zeros((2, 3)), np.zeros((2, 3)))
    start = NavState(0.8, 0.2, 100.0, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    sigma = first_message(scenario, WGS84, None, imu, start)["state_sigma"]
    assert sigma[6:8] == pytest.approx(50e-6, rel=1e-3, abs=0.0)
    assert sigma[8] == pytest.approx(0.01 * math.pi / 648_000.0 / (7.292115e-5 * math.cos(0.8)), rel=1e-9, abs=0.0)


def test_of_a_log_the_date_and_the_readings_of_its_sensors(monkeypatch: pytest.MonkeyPatch) -> None:
    """GPS time 1000.25 s is the run's time 0; the input "gnss" has position and velocity, in order of arrival."""
    sent: list[Feed] = []
    monkeypatch.setattr(foreign_navigator, "navigated", lambda navigator, feed: sent.append(feed))
    late = replace(readings(), time=np.array([2.0, 1.0]), arrival=np.array([3.0, 1.5]))
    of_log = [SimpleNamespace(measurements=replace(late, name=name))
              for name in ("gnss-position", "gnss-velocity", "baro", "gnss2-position")]  # fmt: skip
    monkeypatch.setattr("sinssim.simulation.recorded_filter_run.all_readings", lambda prepared: of_log)
    log = SimpleNamespace(zero=SimpleNamespace(seconds=1000, fraction=0.25))
    truth: Any = RecordedMotion(SimpleNamespace(log=log), None)  # type: ignore[arg-type]
    scenario = scenario_of({"name": "mine", "command": ["true"], "inputs": ["imu", "gnss"]}, aiding={"gnss": {}})
    imu = ImuData(0.02 * np.arange(4), np.zeros((3, 3)), np.zeros((3, 3)))
    start = NavState(0.8, 0.2, 100.0, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    foreign_solutions(scenario, truth, imu, imu, start)
    (feed,) = sent
    assert feed.begin["epoch_gps_s"] == 1000.25
    assert [m.name for m in feed.readings] == ["gnss-position", "gnss-velocity"]
    assert [m.arrival.tolist() for m in feed.readings] == [[1.5, 3.0]] * 2
    assert [m.value[:, 0].tolist() for m in feed.readings] == [[102.0, 101.0]] * 2


REFUSING = """
#include <stdint.h>
#include <stdlib.h>
uint32_t sinssim_version(void) { return 1; }
int sinssim_begin(const void *data, uint64_t size) { return getenv("REFUSES") ? 3 : 0; }
int64_t sinssim_block(const void *data, uint64_t size, void *out, uint64_t most) { return -5; }
void sinssim_end(void) {}
"""


@pytest.mark.skipif(not shutil.which("cc"), reason="needs a C compiler")
def test_a_library_that_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import subprocess

    (tmp_path / "x.c").write_text(REFUSING)
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(tmp_path / "x.so"), str(tmp_path / "x.c")], check=True)
    scenario = scenario_of({"name": "mine", "library": str(tmp_path / "x.so")})
    assert "the library fails: sinssim_block returns -5." in failure_of(scenario)
    monkeypatch.setenv("REFUSES", "1")
    assert "the library refuses to begin: sinssim_begin returns 3." in failure_of(scenario)


def test_a_solution_without_a_time_has_its_number() -> None:
    """The thirteenth: the third after ten others."""
    rows = np.tile([0.0, 0.8, 0.2, 100.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (4, 1))
    rows[:, 0] = [1.0, 2.0, np.nan, 4.0]
    with pytest.raises(RunError, match=r"^its solution number 13 is not finite\.$"):
        _check_rows(rows, np.arange(6.0), 0.5, 10)


def test_answers_that_begin_after_the_first_sample_follow_the_state_that_was_sent() -> None:
    """A run that begins at 100 s."""
    first = np.array([0.7, 0.1, 90.0, 1.0, 2.0, 3.0, 0.0, 1.0, 0.0, 0.0])
    rows = np.tile([0.0, 0.8, 0.2, 100.0, 4.0, 5.0, 6.0, 1.0, 0.0, 0.0, 0.0], (3, 1))
    rows[:, 0] = time = 100.0 + 0.02 * np.arange(1, 4)
    solution = solution_of(rows, np.append(100.0, time), first, "mine")
    np.testing.assert_array_equal(solution.time, [100.0, *time])
    np.testing.assert_array_equal(solution.latitude, [0.7, 0.8, 0.8, 0.8])
    np.testing.assert_array_equal(solution.height, [90.0, 100.0, 100.0, 100.0])
    np.testing.assert_array_equal(solution.velocity_ned[:2], [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    np.testing.assert_array_equal(solution.q_nb[:2], [[0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]])


def test_every_number_of_the_first_message() -> None:
    """Noises by their units, those of gyros unlike those of accelerometers; 1σ of errors that are drawn."""
    sensors = {
        "gyro_arw_deg_sqrt_h": 0.6, "gyro_rrw_deg_h_sqrt_h": 6.0, "gyro_instability_deg_h": 12.0,
        "gyro_correlation_time_s": 100.0, "gyro_bias_sigma_deg_h": 3.0, "gyro_scale_sigma_ppm": 20.0,
        "gyro_quantum_arcsec": 0.5, "accel_vrw_ug_sqrt_hz": 50.0, "accel_rrw_ug_sqrt_h": 9.0,
        "accel_instability_ug": 15.0, "accel_correlation_time_s": 200.0, "accel_bias_sigma_ug": 70.0,
        "accel_scale_sigma_ppm": 80.0, "accel_quantum_mm_s": 2.0,
    }  # fmt: skip
    scenario = scenario_of(imu={"grade": "ideal", "rate_hz": 50.0, **sensors})
    imu = ImuData(5.0 + 0.02 * np.arange(3), np.zeros((2, 3)), np.zeros((2, 3)))
    start = NavState(0.8, 0.2, 100.0, np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.5, -0.5, 0.5]))
    numbers = first_message(scenario, WGS84, 7.0, imu, start)
    per_hour, microg = math.pi / 648_000.0, 9.80665e-6
    expected = {
        "epoch_gps_s": 7.0, "time_s": 5.0, "state": [0.8, 0.2, 100.0, 1.0, 2.0, 3.0, 0.5, 0.5, -0.5, 0.5],
        "state_sigma": [0.0] * 9, "imu_rate_hz": 50.0, "correlation_s": [100.0, 200.0],
        "quantum": [0.5 * per_hour, 2e-3], "ellipsoid": [6378137.0, 1.0 / 298.257223563, 3.986004418e14, 7.292115e-5],
        "gravity_equator": 9.7803253359, "gravity_k": 0.00193185265241,
        "gyro_noise": [0.6 * math.pi / 10_800.0] * 3,
        "gyro_bias": [3.0 * per_hour] * 3, "gyro_walk": [6.0 * per_hour / 60.0] * 3,
        "gyro_instability": [12.0 * per_hour] * 3, "gyro_scale": [20e-6] * 3, "accel_noise": [50.0 * microg] * 3,
        "accel_bias": [70.0 * microg] * 3, "accel_walk": [9.0 * microg / 60.0] * 3,
        "accel_instability": [15.0 * microg] * 3, "accel_scale": [80e-6] * 3,
    }  # fmt: skip
    assert numbers.pop("gravity") == "normal"
    assert {name: np.ravel(value).tolist() for name, value in numbers.items()} == {
        name: pytest.approx(np.ravel(value).tolist(), rel=1e-9, abs=0.0) for name, value in expected.items()
    }


def test_what_is_said_of_a_sensor() -> None:
    """Three values with two 1σ, a lever arm, and names of at most 31 letters."""
    m = Measurements("gnss-position", np.zeros(1), np.zeros(1), np.zeros((1, 3)), np.ones((1, 2)),
                     np.array([1.5, -2.5, 3.5]), name="a" * 40)  # fmt: skip
    opening = Feed(begin(), ImuData(np.arange(2.0), np.zeros((1, 3)), np.zeros((1, 3))), (m,)).opening()
    about = opening[24 + 528 + 8 :]
    assert about[:32] == b"a" * 31 + b"\0"
    assert about[32:64].rstrip(b"\0") == b"gnss-position"
    assert struct.unpack_from("<3d", about, 64) == (1.5, -2.5, 3.5)
    assert struct.unpack_from("<II", about, 88) == (3, 2)


def test_samples_as_rates() -> None:
    """Intervals of 20 and 40 ms."""
    imu = ImuData(np.array([0.0, 0.02, 0.06]), np.full((2, 3), 0.1), np.full((2, 3), 0.4))
    feed = Feed(begin(), imu, (), rates=True)
    np.testing.assert_allclose(
        feed._samples(0, 2, np.empty((2, 8))),
        [[0.02, 0.02, *[5.0] * 3, *[20.0] * 3], [0.06, 0.04, *[2.5] * 3, *[10.0] * 3]],
    )


def test_what_a_navigator_states_beside_its_state() -> None:
    rows = np.zeros((2, 27))
    rows[:, 0], rows[:, 7], rows[:, 11:] = [0.02, 0.04], 1.0, np.arange(1.0, 17.0)
    stated = solution_of(rows, 0.02 * np.arange(3), np.eye(10)[6], "mine")
    assert stated.sigma is not None
    assert stated.biases is not None
    assert stated.status is not None
    np.testing.assert_array_equal(stated.sigma, [[np.nan] * 9, *[np.arange(1.0, 10.0)] * 2])
    np.testing.assert_array_equal(stated.biases, [[np.nan] * 6, *[np.arange(10.0, 16.0)] * 2])
    np.testing.assert_array_equal(stated.status, [np.nan, 16.0, 16.0])
    rows[:, 20:26] = np.nan
    silent = solution_of(rows, 0.02 * np.arange(3), np.eye(10)[6], "mine")
    assert (silent.biases, silent.sigma is None) == (None, False)


def test_measurements_go_out_as_they_arrive() -> None:
    """A fix that is valid first arrives last."""
    m = replace(readings(), time=np.array([1.0, 2.0]), arrival=np.array([5.0, 3.0]))
    found = foreign_navigator._in_order(m)
    assert (found.arrival.tolist(), found.time.tolist()) == ([3.0, 5.0], [2.0, 1.0])
    assert (found.value.ravel().tolist(), found.sigma.ravel().tolist()) == ([102.0, 101.0], [4.0, 3.0])


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ((0.9, 0.8, 1.0), "its solution of 0.9 s lies before the first sample."),
        ((3.5, 0.8, 1.0), "its solution of 3.5 s lies after the end of the run."),
        ((0.5, 0.8, 1.0), "its solution of 0.5 s comes twice."),
        ((0.4, 0.8, 1.0), "its solution of 0.4 s is out of order: it comes after that of 0.5 s."),
        ((1.5, -1.7, 1.0), "its solution of 1.5 s has a latitude of -1.70 rad."),
        ((1.5, 0.8, 2.0), "its solution of 1.5 s has a quaternion of the norm 2.00."),
        ((1.5, np.inf, 1.0), "its solution of 1.5 s is not finite."),
        ((1.0, -1.7, 1.0), "its solution of 1 s has a latitude of -1.70 rad."),
        ((3.0, 0.8, 2.0), "its solution of 3 s has a quaternion of the norm 2.00."),
    ],
)
def test_an_answer_that_is_no_state_of_the_run(row: tuple[float, float, float], words: str) -> None:
    """Samples from 1 s to 3 s, after an answer of 0.5 s."""
    time, latitude, norm = row
    rows = np.array([[time, latitude, 0.2, 100.0, 0.0, 0.0, 0.0, 0.0, norm, 0.0, 0.0]])
    with pytest.raises(RunError) as error:
        _check_rows(rows, np.array([1.0, 2.0, 3.0]), 0.5, 0)
    assert str(error.value) == words
    assert error.value.time == time


def test_lines_of_two_sensors_are_in_order_of_arrival() -> None:
    """Within one sample the second sensor's reading comes first, although its value and its instant are larger."""
    one, other = np.array([0.9]), np.array([0.5])
    given = (("a", 0.1 * one, one, one), ("b", other, other, 9.0 * one))
    readings = [
        Measurements("baro-height", time, arrival, value[:, None], value[:, None], name=name)
        for name, time, arrival, value in given
    ]
    imu = ImuData(np.arange(2.0), np.zeros((1, 3)), np.zeros((1, 3)))
    (block,) = Feed(begin(), imu, readings, text=True).blocks()
    assert [line.split()[:3] for line in bytes(block.data).decode().splitlines()[1:]] == [
        ["measurement", "1", "0.5"], ["measurement", "0", "0.9"],
    ]  # fmt: skip


def state_rows(*times: float) -> Any:
    """Return answers of these times, each with another latitude."""
    rows = np.tile([0.0, 0.8, 0.2, 100.0, 4.0, 5.0, 6.0, 1.0, 0.0, 0.0, 0.0], (len(times), 1))
    rows[:, 0], rows[:, 1] = times, 0.8 + 0.01 * np.arange(len(times))
    return rows


@pytest.mark.parametrize(
    ("edges", "at", "first"),
    [
        ([100.0, 100.5, 100.75, 101.0, 101.25], [101.0, 101.25], [101.0, 0.8]),
        ([100.0, 100.5, 100.75, 101.0, 101.25], [100.5, 100.75, 101.0, 101.25], [100.0, 0.7]),
        ([100.0, 100.01, 100.5, 101.0], [100.5, 101.0], [100.0, 0.7]),  # once in half a second
        ([100.0, 100.25, 100.5, 100.75, 101.0], [100.5, 100.75, 101.0], [100.5, 0.8]),
        ([100.0, 100.5, 101.0], [100.0, 100.5, 101.0], [100.0, 0.8]),
    ],
)
def test_whether_the_state_that_was_sent_is_the_first_row(
    edges: list[float], at: list[float], first: list[float]
) -> None:
    """It is if the first answer is at most one and a half of the usual or the first interval later."""
    sent = np.array([0.7, 0.1, 90.0, 1.0, 2.0, 3.0, 0.0, 1.0, 0.0, 0.0])
    found = solution_of(state_rows(*at), np.array(edges), sent, "mine")
    assert [found.time[0], found.latitude[0]] == first
    assert found.time[-len(at) :].tolist() == at


def test_a_fault_behind_good_answers() -> None:
    """The second answer lies after the end; the 2049th, the first of another block, comes twice."""
    with pytest.raises(RunError, match=r"^its solution of 3\.5 s lies after the end of the run\.$"):
        _check_rows(state_rows(1.5, 3.5), np.array([1.0, 2.0, 3.0]), 0.5, 0)
    times = np.arange(1.0, 2051.0)
    times[2048] = times[2047]
    with pytest.raises(RunError, match=r"^its solution of 2048 s comes twice\.$"):
        solution_of(state_rows(*times) * [1.0, 0.01, *[1.0] * 9], np.arange(2051.0), np.zeros(10), "mine")


@pytest.mark.parametrize(("second", "word"), [(2.5, "late"), (3.5, "early")])
def test_stepwise_the_second_answer_is_of_another_instant(second: float, word: str) -> None:
    with pytest.raises(RunError) as error:
        solution_of(state_rows(2.0, second, 4.0), np.arange(1.0, 5.0), np.zeros(10), "mine", stepwise=True)
    assert str(error.value) == f"it is {word}: it answers the sample of 3 s with the solution of {second} s."
    assert error.value.time == 3.0


def test_a_project_allows_what_is_in_its_folder_of_navigators_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file in that folder or below it, which nobody else may change, nor the folder."""
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setattr(foreign_navigator, "named_paths", lambda: [tmp_path / "another"])
    folder = tmp_path / "own" / "navigators"
    (folder / "below").mkdir(parents=True)
    scenario: Any = SimpleNamespace(use=(str(tmp_path / "own"),))
    said: list[str] = []

    def is_allowed(place: Path) -> bool:
        place.write_text("x")
        navigator: Any = SimpleNamespace(name="mine", file=place, library=None)
        try:
            foreign_navigator.check_permission(scenario, navigator)
        except InputError as error:
            said.append(str(error))
            return False
        return True

    places = (folder / "a", folder / "below" / "a", tmp_path / "own" / "a", tmp_path / "a")
    assert [is_allowed(place) for place in places] == [True, True, False, False]
    assert said[0].startswith(f"the navigator mine is the program {places[2]}, which is started only if you allow it")
    folder.chmod(0o777)
    assert not is_allowed(folder / "a")


def test_a_last_solution_may_be_two_intervals_before_the_end() -> None:
    """Of answers every half a second, the last one at 2 s, in a run until 3 s or 3.25 s."""
    edges, rows = np.arange(0.5, 3.26, 0.25), state_rows(1.0, 1.5, 2.0)
    assert solution_of(rows, edges[:-1], np.eye(10)[6], "mine").time[-1] == 2.0
    with pytest.raises(RunError, match=r"^its last solution is that of 2 s, and the run ends at 3\.25 s\.$") as error:
        solution_of(rows, edges, np.eye(10)[6], "mine")
    assert error.value.time == 2.0
