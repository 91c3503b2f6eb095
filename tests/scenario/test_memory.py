"""What a run with a filter takes of memory: counted in its result, and refused where the machine has less."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.experiments.run.run_execution import run
from sinssim.scenario import Scenario
from sinssim.scenario.run_memory import check_memory, needed_memory

STATES = tuple(f"{triad} {what}" for triad in ("gyro", "accelerometer") for what in ("bias", "scale", "misalignment"))


def standing(seconds: float, rate: float = 10.0, *, imu: float = 10.0, aiding: float = 1.0, **more: object) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "standing",
            "parked": {"latitude_deg": 50.0, "duration_s": seconds},
            "imu": {"grade": "tactical", "rate_hz": imu},
            "aiding": {"gnss": {"rate_hz": aiding}, "baro": {"rate_hz": aiding}},
            "filter": {"rate_hz": rate, "states": ("gyro bias", "accelerometer bias"), **more},
        }
    )


def arrays(value: object, seen: set[int]) -> Iterator[np.ndarray]:
    """Yield every array that a value holds, once, and the whole of which it is a part."""
    if id(value) in seen:
        return
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        if isinstance(value.base, np.ndarray):
            yield from arrays(value.base, seen)
        else:
            yield value
    elif dataclasses.is_dataclass(value):
        yield from arrays(vars(value), seen)
    elif isinstance(value, dict):
        yield from arrays(tuple(value.values()), seen)
    elif isinstance(value, tuple | list):
        for part in value:
            yield from arrays(part, seen)


@pytest.mark.parametrize("smooth", [False, True])
def test_a_run_keeps_what_was_estimated(smooth: bool) -> None:
    """What the result holds is no more than the estimate of the whole run, and not much less."""
    scenario = standing(300.0, smooth=smooth)
    aided = run(scenario).aided
    assert aided is not None
    kept = sum(array.nbytes for array in arrays((aided.sensed, aided.estimate, aided.error), set()))
    needed = needed_memory(scenario)
    least = 0.15 if smooth else 0.3  # smoothing itself works on more matrices than it leaves
    assert least * (needed.filter + needed.readings) < kept < needed.filter + needed.readings


def test_nothing_of_the_length_of_a_run_is_kept_twice() -> None:
    """At each epoch 1σ of every state, the parameters, the time, the solution, its error and the norms of that."""
    scenario = standing(600.0)
    aided = run(scenario).aided
    assert aided is not None
    found = aided.estimate
    count, n = len(found.time), found.model.size
    long = sum(a.nbytes for a in arrays((found, aided.error), set()) if a.ndim and len(a) == count)
    assert long <= 8.0 * count * (n + (n - 9) + 1 + 11 + 9 + 3)


def test_equal_times_are_one_array() -> None:
    """IMU, aiding sensors and filter of one rate: one array of times, one of numbers of epochs."""
    done = run(standing(60.0, aiding=10.0))
    aided = done.aided
    assert aided is not None
    times = [aided.estimate.time, *(i.time for i in aided.estimate.innovations)]
    times += [array for s in aided.sensed for array in (s.time, s.measurements.time, s.measurements.arrival)]
    assert len(times) == 1 + 3 + 9
    assert all(np.shares_memory(time, done.truth.time) for time in times)


@pytest.mark.parametrize(
    ("scenario", "message"),
    [
        (standing(86400.0, 100.0, imu=100.0, smooth=True), r"filter\.rate_hz = 100: .* Without filter\.smooth"),
        (
            standing(86400.0, 100.0, imu=100.0, aiding=50.0, smooth=True),
            r"aiding\.gnss\.rate_hz = 50: .*filter\.smooth",
        ),
        (standing(86400.0, 1.0, imu=2000.0), r"imu\.rate_hz = 2000: a run of about 86400 s with a filter of"),
        (
            standing(1e5, 100.0, imu=100.0),
            r"imu\.rate_hz = 100: a run of about 100000 s .* this machine has 4 GB\. ",
        ),
        (
            standing(1e5, 20.0, imu=20.0, states=STATES),
            r"filter\.rate_hz = 20: a run of about 100000 s .* this machine has 1 GB\. ",
        ),
    ],
)
def test_what_does_not_fit_is_refused_by_name(
    scenario: Scenario, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    has = float(message.split("machine has ")[1].split(" GB")[0]) if "machine has" in message else 4.0
    monkeypatch.setattr("sinssim.scenario.run_memory.machine_memory", lambda: 1e9 * has)
    with pytest.raises(InputError, match=message) as error:
        check_memory(scenario)
    fits = float(str(error.value).split("A run of ")[1].split(" s would fit")[0])
    assert scenario.parked is not None
    shorter = scenario.parked.model_copy(update={"duration_s": 0.97 * fits})
    check_memory(scenario.model_copy(update={"parked": shorter}))


def test_the_readings_of_all_sensors_count() -> None:
    """A fix has two, position and velocity: GNSS and a barometer at 2 Hz have three times those of a barometer."""
    both = standing(300.0, aiding=2.0)
    assert both.aiding is not None
    alone = both.model_copy(update={"aiding": both.aiding.model_copy(update={"gnss": None})})
    assert needed_memory(both).readings == 3.0 * needed_memory(alone).readings
