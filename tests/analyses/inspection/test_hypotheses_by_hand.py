"""What else readings may mean, and which verdict follows from the residuals of matches that are given."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.inspection import unit_axes
from sinssim.analyses.inspection.stream_findings import doubt, fact, wrong
from sinssim.analyses.inspection.unit_axes import Reading, _others, judge_reading
from sinssim.data import Array

DEG = 0.017453292519943295
RATE = np.array([3.0, 5.0, 7.0])
FORCE = np.array([1.0, 2.0, -9.0])


def right(kind: Any) -> dict[str, tuple[str, list[float], list[float]]]:
    """Return what would be right, and what rate and force then are, by what the readings are."""
    return {
        meaning: (said, (gyro @ RATE).tolist(), (accel @ FORCE).tolist())
        for meaning, said, gyro, accel in _others(0.02, kind)
    }


def test_all_other_meanings() -> None:
    """A rate of 3, 5 and 7 and a force of 1, 2 and −9 as they were stated, and as they are."""
    found = right("rates")
    same = FORCE.tolist()

    def gyros(said: str, *values: float) -> Any:
        return said, pytest.approx(list(values), rel=1e-14), same

    units: dict[tuple[str, str], tuple[float, str]] = {
        ("°/s", "rad/s"): (DEG, "deg/s"), ("rad/s", "°/s"): (1.0 / DEG, "rad/s"),
        ("mrad/s", "rad/s"): (1e-3, "mrad/s"), ("rad/s", "mrad/s"): (1e3, "rad/s"),
        ("°/h", "°/s"): (1.0 / 3600.0, "deg/h"), ("°/s", "°/h"): (3600.0, "deg/s"),
        ("°/h", "rad/s"): (DEG / 3600.0, "deg/h"), ("rad/s", "°/h"): (3600.0 / DEG, "rad/s"),
        ("mrad/s", "°/s"): (1e-3 / DEG, "mrad/s"), ("°/s", "mrad/s"): (1e3 * DEG, "deg/s"),
    }  # fmt: skip
    expected: dict[str, Any] = {}
    for (true, stated), (factor, key) in units.items():
        name = f"the rates are in {true} and were taken for {stated}"
        expected[name] = gyros(f'the unit "{key}"', *(factor * RATE))
    expected |= {
        "the gyros give increments, not rates": gyros('kind = "increments"', 150.0, 250.0, 350.0),
        "the gyros' signs are opposite to those of right-handed axes":
            gyros("all gyros with the other sign", -3.0, -5.0, -7.0),
        "the accelerometers give gravity's direction (down at rest)":
            ("them with the other sign", RATE.tolist(), [-1.0, -2.0, 9.0]),
        "gyros and accelerometers have left-handed axes":
            ("one axis of both with the other sign", [3.0, -5.0, 7.0], [1.0, -2.0, -9.0]),
        "the x gyro has the opposite sign": gyros("the x gyro with the other sign", -3.0, 5.0, 7.0),
        "the y gyro has the opposite sign": gyros("the y gyro with the other sign", 3.0, -5.0, 7.0),
        "the z gyro has the opposite sign": gyros("the z gyro with the other sign", 3.0, 5.0, -7.0),
        "the y and z gyros have the opposite sign": gyros("these gyros with the other sign", 3.0, -5.0, -7.0),
        "the x and z gyros have the opposite sign": gyros("these gyros with the other sign", -3.0, 5.0, -7.0),
        "the x and y gyros have the opposite sign": gyros("these gyros with the other sign", -3.0, -5.0, 7.0),
    }  # fmt: skip
    for names, values in (("x, z, y", (3.0, 7.0, 5.0)), ("y, x, z", (5.0, 3.0, 7.0)), ("y, z, x", (5.0, 7.0, 3.0)),
                          ("z, x, y", (7.0, 3.0, 5.0)), ("z, y, x", (7.0, 5.0, 3.0))):  # fmt: skip
        said = f"the gyros' columns are in another order: {names}"
        expected[said] = gyros("the columns in that order", *values)
    assert found == expected
    increments = right("increments")
    assert increments.pop("the gyros give rates, not increments") == gyros('kind = "rates"', 0.06, 0.1, 0.14)
    assert list(increments) == [name for name in found if name != "the gyros give increments, not rates"]


TIME = 5.0 + 0.02 * np.arange(50)
RATES, FORCES = np.tile(0.01 * RATE, (50, 1)), np.tile(FORCE, (50, 1))
FIXES: Any = SimpleNamespace(relative=np.array([[0.0, 4.0, 1.0], [3.0, -4.0, 1.0], [2.0, 1.0, 0.0]]), sigma=0.2)


def judged(
    monkeypatch: pytest.MonkeyPatch,
    own: float,
    others: dict[str, float],
    moved: float = 6.0,
    axes: Array | None = None,
    offset: float = 7.0,
) -> Reading:
    """Judge a reading whose residual is given, and those of others, by the rate and force that they mean."""
    columns = np.eye(3) if axes is None else axes
    meant: dict[tuple[float, ...], float] = {(*RATES[0], *FORCE): own, (0.0, 0.0, 0.0, *FORCE): 50.0}
    for meaning, _, gyro, accel in _others(0.02, "rates"):
        key = (*(columns @ gyro @ columns.T @ RATES[0]), *(columns @ accel @ columns.T @ FORCE))
        meant[key] = others.get(meaning, 40.0)

    def matched(curve: Any, fixes: Any, at: float, most: int, window: float) -> Any:
        assert (fixes is FIXES, most, window) == (True, 12, 8.0)
        assert at == 7.0 or own >= 1.0
        (residual,) = (value for key, value in meant.items() if np.allclose(curve, key, rtol=1e-9))
        spoilt = 0.0 if abs(at - 7.3) < 1e-9 or own < 1.0 else 10.0  # a wrong reading spoils the offset by 0.3 s
        return SimpleNamespace(residual=residual + (0.0 if residual == own else spoilt), each=[1.0], moved=moved)

    def push(time: Array, rate: Array, force: Array, rate_hz: float) -> Any:
        assert rate_hz == 25.0
        return (*rate[0], *force[0])

    monkeypatch.setattr(unit_axes, "match", matched)
    monkeypatch.setattr(unit_axes, "pushed", push)
    monkeypatch.setattr(unit_axes, "turns_apart", lambda *_: np.nan)
    return judge_reading(TIME, RATES, FORCES, FIXES, offset, 7.6, 8.0, columns, "rates")


X_GYRO, Z_GYRO = (f"the {name} gyro has the opposite sign" for name in "xz")


def test_the_stated_reading_fits_best(monkeypatch: pytest.MonkeyPatch) -> None:
    """At least twice as well as every other."""
    found = judged(monkeypatch, 0.3, {X_GYRO: 0.61, Z_GYRO: 0.7})
    text = ("In windows of 8 s the data agree with the velocities of the fixes to 0.3 m/s rms; the best alternative "
            f"interpretation, that {X_GYRO}, agrees to 0.61 m/s.")  # fmt: skip
    numbers = {"residual_mps": 0.3, "residual_of_best_other_mps": 0.61, "best_other": X_GYRO}
    assert found == Reading(
        [fact("units and axes", f"{text} Units, signs and handedness are correct.", **numbers)], None, None
    )
    (unsure,) = judged(monkeypatch, 0.3, {X_GYRO: 0.59}).findings
    assert unsure == doubt("units and axes", text.replace("0.61", "0.59"),
                           "The motion does not distinguish the two: verify the description.",
                           **{**numbers, "residual_of_best_other_mps": 0.59})  # fmt: skip


def test_another_reading_fits_clearly_better(monkeypatch: pytest.MonkeyPatch) -> None:
    """With columns in other axes, and at an offset 0.3 s beside the one by the stated reading."""
    axes = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    found = judged(monkeypatch, 3.0, {Z_GYRO: 0.25, X_GYRO: 0.3}, axes=axes)
    text = ("In windows of 8 s the data agree with the velocities of the fixes to 3 m/s rms; the best alternative "
            f"interpretation, that {Z_GYRO}, agrees to 0.25 m/s.")  # fmt: skip
    (said,) = found.findings
    assert said == wrong("units and axes", text, "Describe the log with the z gyro with the other sign.",
                         residual_mps=3.0, residual_of_best_other_mps=said.numbers["residual_of_best_other_mps"],
                         best_other=Z_GYRO)  # fmt: skip
    assert said.numbers["residual_of_best_other_mps"] == pytest.approx(0.25, rel=1e-12)
    np.testing.assert_array_equal(found.gyro, np.diag([1.0, -1.0, 1.0]))  # the file's z is the second axis
    np.testing.assert_array_equal(found.accel, np.eye(3))


def test_what_no_motion_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    """A unit with tiny rates has to fit twice as well as no turns at all; nothing fits the change of velocity."""
    tiny = "the rates are in mrad/s and were taken for rad/s"
    (said,) = judged(monkeypatch, 32.0, {tiny: 26.0, X_GYRO: 31.0}, moved=63.0).findings
    assert said.grade == "doubt"
    assert said.numbers["best_other"] == X_GYRO
    assert said.text == (
        "In windows of 8 s the velocity of the fixes changes by 63 m/s rms, and the data explain it to 32 m/s only; so "
        "does every other interpretation of the columns."
    )
    assert said.fix.startswith(
        "Navigation with these inertial data is probably worse than the fixes alone. Likely causes: "
    )
    (said,) = judged(monkeypatch, 32.0, {tiny: 24.0, X_GYRO: 31.0}, moved=65.0).findings
    assert (said.numbers["best_other"], said.fix[:10]) == (tiny, "The motion")
    # 8 m/s are 39 times the velocities' 1σ of 0.205 m/s, and 0.8 m/s are not ten
    monkeypatch.setattr(FIXES, "sigma", 0.81)
    (said,) = judged(monkeypatch, 0.3, {}).findings
    assert said == doubt(
        "units and axes", "The velocity of the fixes changes by 8 m/s at most: too little to verify units and axes.",
        "Inspect a part of the log with manoeuvres.",
    )  # fmt: skip
    monkeypatch.setattr(FIXES, "sigma", 0.79)
    assert judged(monkeypatch, 0.3, {}).findings[0].grade == "fact"
