"""A flight in another process is the same flight, and whatever happens there is known here."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError, RunError
from sinssim.truth.flight.flight_log import flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.flight_process import SectionedFlight, fly_apart
from sinssim.truth.flight.guidance import Guidance, SolutionErrors
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from tests.slow import slow
from tests.truth.flight.test_cache import same


def flight(*legs: dict[str, Any]) -> FlightPlan:
    return FlightPlan.model_validate(
        {
            "aircraft": "737",
            "start": {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 6000.0},
            "legs": legs or [{"type": "hold", "duration_s": 15.0}],
        }
    )


def test_bit_for_bit_the_flight_of_this_process() -> None:
    calls: list[str] = []
    seen: list[float] = []
    there = fly_apart(flight(), 3, seen.append, lambda: calls.append("meanwhile"))
    assert same(there, flight_log(fly_plan(flight(), 3)))
    assert seen == sorted(seen)
    assert (seen[0], seen[-1]) == (0.0, 1.0)
    assert calls == ["meanwhile"]


def test_an_error_arrives_with_its_cause() -> None:
    climb = {"type": "climb", "altitude_m": 12000.0, "timeout_s": 5.0}
    with pytest.raises(InputError, match=r"leg 1 \(climb\) failed at 5\.") as caught:
        fly_apart(flight(climb))
    assert "LegError" in str(caught.value.__cause__)


def test_a_process_that_breaks_down_is_an_error_of_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[subprocess.Popen[bytes]] = []

    class Watched(subprocess.Popen[bytes]):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            started.append(self)

    monkeypatch.setattr(subprocess, "Popen", Watched)
    with pytest.raises(RunError, match="flew the 737 ended with SIGSEGV"):
        fly_apart(flight(), 0, None, lambda: os.kill(started[0].pid, signal.SIGSEGV))


def errors_of(roll: float) -> SolutionErrors:
    """Return the errors of a navigator whose horizon is tilted, rad."""
    values = np.zeros((1, 12))
    values[0, 6] = roll
    return SolutionErrors(Guidance(source="quaternion"), values)


def test_a_section_is_flown_again_from_its_beginning() -> None:
    """Trials that are dropped leave no trace; the trials that are kept are the flight with the errors of each."""
    plan = flight({"type": "hold", "duration_s": 4.0}, {"type": "turn", "heading_deg": 30.0})
    whole = flight_log(fly_plan(plan, 0, None, errors_of(0.02)))
    with SectionedFlight(plan, 0, errors_of(0.02)) as flying:
        until, over, parts = 5.0, False, 0
        while not over:
            dropped, _ = flying.fly(until, errors_of(-0.1))
            flying.keep(kept=False)
            log, over = flying.fly(until, errors_of(0.02))
            flying.keep(kept=True)
            assert over or log.time[-1] == pytest.approx(until, abs=0.11)
            until, parts = until + 5.0, parts + 1
    assert parts > 2
    assert same(log, whole)
    assert not same(dropped, whole)


@pytest.mark.parametrize("parts", [0, 1])
def test_what_ends_a_section_is_known(parts: int) -> None:
    """A breakdown of the model in the first section, and in one that goes on from another."""
    with SectionedFlight(flight(), 0, errors_of(0.0)) as flying:
        for k in range(parts):
            flying.fly(5.0 + k, errors_of(0.0))
            flying.keep(kept=True)
        os.killpg(flying._other._process.pid, signal.SIGSEGV)
        with pytest.raises(RunError, match="flew the 737 ended with SIGSEGV"):
            flying.fly(10.0, errors_of(0.0))
    soon = flight({"type": "hold", "duration_s": 0.2})
    with (
        SectionedFlight(soon, 0, errors_of(0.0)) as flying,
        pytest.raises(InputError, match=r"over after 0\.2"),
    ):
        flying.fly(5.0, errors_of(0.0))


SCRIPT = """
import subprocess, sys
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.flight_process import SectionedFlight, fly_apart

class Told(subprocess.Popen):
    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        print(self.pid, flush=True)

subprocess.Popen = Told
flight = FlightPlan.model_validate_json(sys.argv[1])
fly_apart(flight, 0, lambda fraction: print("flies", flush=True))
"""
SECTIONS = (
    SCRIPT.replace("import fly_apart", "import SectionedFlight").partition("fly_apart(")[0]
    + """
from tests.truth.flight.test_subprocess_flight import errors_of
with SectionedFlight(flight, 0, errors_of(0.0)) as flying:
    for until in range(2, 90000, 2):
        flying.fly(until, errors_of(0.0))
        flying.keep(kept=True)
        print("flies", flush=True)
"""
)


def alive(group: int) -> list[str]:
    """Return the processes of a group that have not ended."""
    stats = [file.read_text().rpartition(")")[2].split() for file in Path("/proc").glob("[0-9]*/stat")]
    return [state for state, _, pgrp, *_ in stats if int(pgrp) == group and state != "Z"]


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs /proc")
@pytest.mark.parametrize(
    ("number", "when", "script"),
    [(signal.SIGINT, "as it starts", SCRIPT), (signal.SIGINT, "flying", SECTIONS),
     *slow((signal.SIGINT, "flying", SCRIPT), (signal.SIGKILL, "as it starts", SCRIPT),
           (signal.SIGKILL, "flying", SCRIPT), (signal.SIGKILL, "flying", SECTIONS))],
)  # fmt: skip
def test_nobody_goes_on_flying_after_the_program_has_ended(
    tmp_path: Path, number: signal.Signals, when: str, script: str
) -> None:
    """An interrupted program ends the other process; of a killed one it notices by itself, and says nothing."""
    long = flight({"type": "hold", "duration_s": 80000.0}).model_dump_json()
    program = subprocess.Popen(
        [sys.executable, "-c", script, long],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    assert program.stdout is not None
    pid = int(program.stdout.readline())
    other = Path(f"/proc/{pid}")
    if when == "flying":
        assert [program.stdout.readline() for _ in range(3)] == [b"flies\n"] * 3
    assert other.exists()
    program.send_signal(number)
    _, said = program.communicate(timeout=30.0)
    if number == signal.SIGKILL:
        assert said == b""
    else:
        assert said.count(b"Traceback") == 1
        assert said.endswith(b"KeyboardInterrupt\n")
    deadline = time.monotonic() + 30.0
    while other.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not other.exists()
    assert not alive(pid)
    assert list(tmp_path.iterdir()) == []
