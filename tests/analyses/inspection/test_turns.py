"""The turns of gyros about the vertical against those of the course: what tells the sign of the accelerometers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.analyses.inspection import unit_axes
from sinssim.analyses.inspection.unit_axes import judge_reading
from sinssim.analyses.inspection.velocity_match import Seen, turns_apart
from sinssim.data import Array

SPEED, SLALOM, PERIOD = 10.0, 0.3, 20.0
TIME = np.arange(0.0, 120.0, 0.02)


def slalom(amplitude: float = SLALOM) -> tuple[Array, Array, Seen]:
    """Rates and forces of a level vehicle, forward-right-down, with a sine as yaw rate, and its fixes once a second."""
    size = 2.0 * np.pi / PERIOD
    rate = np.column_stack([0.0 * TIME, 0.0 * TIME, amplitude * np.sin(size * TIME)])
    force = np.column_stack([0.0 * TIME, SPEED * rate[:, 2], np.full(len(TIME), -9.8)])
    at = np.arange(0.5, 119.0, 1.0)
    course = amplitude / size * (1.0 - np.cos(size * at))
    axes = np.tile(np.eye(3), (len(at), 1, 1))  # north, east and up of a place on the x axis
    north, up = axes[:, 2], axes[:, 0]
    velocity = SPEED * (np.cos(course)[:, None] * north + np.sin(course)[:, None] * np.cross(north, up))
    return rate, force, Seen(at, velocity, velocity, up, north, np.full(len(at), SPEED), 0.1)


def test_the_turns_agree_but_for_the_sign() -> None:
    """A turn between t and t + 5 s is a/ω (cos ωt − cos ω(t + 5 s)), rms √2 a/ω sin(ω 2.5 s); opposite ones are twice
    as far apart. The centripetal force inclines the specific force by up to 17°, which costs 2 % of the rate.
    """
    rate, force, fixes = slalom()
    size = 2.0 * np.pi / PERIOD
    turn = np.sqrt(2.0) * SLALOM / size * np.sin(2.5 * size)
    assert turns_apart(TIME, rate, force, fixes, 0.0) < 0.05 * turn
    assert turns_apart(TIME, rate, -force, fixes, 0.0) == pytest.approx(2.0 * turn, rel=0.04)
    assert turns_apart(TIME, -rate, -force, fixes, 0.0) < 0.05 * turn
    biased = rate + np.array([0.0, 0.0, np.radians(0.5)])
    assert turns_apart(TIME, biased, force, fixes, 0.0) < 0.05 * turn


def test_a_straight_course_tells_nothing() -> None:
    rate, force, fixes = slalom(0.01)
    assert np.isnan(turns_apart(TIME, rate, force, fixes, 0.0))
    slow = Seen(fixes.time, fixes.beta, 0.05 * fixes.relative, fixes.up, fixes.north, fixes.speed, fixes.sigma)
    assert np.isnan(turns_apart(TIME, *slalom()[:2], slow, 0.0))


def test_reversed_accelerometers_by_the_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """The velocities agree almost as well with either sign: 0.5 against 0.4 m/s. The course decides."""
    rate, force, fixes = slalom()
    monkeypatch.setattr(unit_axes, "pushed", lambda _, rate, force, *__: (rate, force))

    def matched(curve: tuple[Array, Array], *_: object, **__: object) -> SimpleNamespace:
        same = np.allclose(np.abs(curve[0]), np.abs(rate)) and np.allclose(np.abs(curve[1]), np.abs(force))
        size = 0.5 if same and np.median(curve[1][:, 2]) > 0.0 else 0.4 if same else 5.0
        return SimpleNamespace(residual=size, each=np.array([size]), moved=3.0)

    monkeypatch.setattr(unit_axes, "match", matched)
    found = judge_reading(TIME, rate, -force, fixes, 0.0, 0.0, 10.0, np.eye(3), "rates")
    assert found.accel is not None
    assert found.accel.tolist() == (-np.eye(3)).tolist()
    assert found.findings[0].numbers["best_other"].startswith("the accelerometers give gravity's direction")
    right = judge_reading(TIME, rate, force, fixes, 0.0, 0.0, 10.0, np.eye(3), "rates")
    assert right.gyro is right.accel is None
    assert right.findings[0].numbers["turns_agree"]
    assert "and in their turns with the course" in right.findings[0].text


def test_what_explains_nothing_is_said_plainly(monkeypatch: pytest.MonkeyPatch) -> None:
    rate, force, fixes = slalom()
    monkeypatch.setattr(unit_axes, "pushed", lambda *_: None)
    none = SimpleNamespace(residual=2.0, each=np.array([2.0]), moved=3.0)
    monkeypatch.setattr(unit_axes, "match", lambda *_, **__: none)
    (found,) = judge_reading(TIME, rate, force, fixes, 0.0, 0.0, 10.0, np.eye(3), "rates").findings
    assert found.numbers["worse_than_fixes"]
    assert "is probably worse than the fixes alone. Likely causes: " in found.sentence
