"""A frame of a project at three rates: the schedule (8.20)-(8.28) in the frame's own file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sinssim
from sinssim.cli.app import main
from sinssim.errors import InputError, RunError
from sinssim.scenario import load_scenario
from sinssim.strapdown.frames import FRAME_REGISTRY
from sinssim.truth.motions.parked_and_great_circle import GreatCircle

FRAME = '''\
"""The Earth-fixed frame, in Python without compilation."""

import numpy as np
from sinssim import earth, rotation

HAS_RADII = False
OMEGA = np.array((0.0, 0.0, 7.292115e-5))


def acceleration(r, v):
    """Gravitation, Coriolis and centrifugal acceleration."""
    return earth.gravitation_ecef(r) - np.cross(OMEGA, np.cross(OMEGA, r) + 2.0 * v)


def navigate(problem, fast, medium, extrapolate):
    p = problem
    r = np.array(earth.geodetic_to_ecef(p.latitude[0], p.longitude[0], p.height[0]))
    q_en = earth.q_en(p.latitude[0], p.longitude[0])
    q, v = rotation.multiply(q_en, p.q_nb[0]), rotation.rotate(q_en, p.velocity[0])
    before = now = acceleration(r, v)
    k = p.first
    for row in range(len(p.time) - 1):
        dt = (p.time[row + 1] - p.time[row]) / (fast * medium)
        for part in range(medium):
            force = np.zeros(3)
            for _ in range(fast):
                half = rotation.quaternion_from_rotation_vector(0.5 * p.dtheta[k])
                force = force + rotation.rotate(rotation.multiply(q, half), p.dvel[k])
                step = rotation.quaternion_from_rotation_vector(p.dtheta[k])
                earth_turn = rotation.quaternion_from_rotation_vector(-OMEGA * dt)
                q, k = rotation.multiply(earth_turn, rotation.multiply(q, step)), k + 1
            ahead = (part + 0.5) / medium if extrapolate else 0.0
            new = v + force + fast * dt * (now + ahead * (now - before))
            r, v = r + 0.5 * fast * dt * (v + new), new
        lat, lon, h = earth.ecef_to_geodetic(r)
        before, now = now, acceleration(r, v)
        q_ne = rotation.conjugate(earth.q_en(lat, lon))
        p.latitude[row + 1], p.longitude[row + 1], p.height[row + 1] = lat, lon, h
        p.velocity[row + 1], p.q_nb[row + 1] = rotation.rotate(q_ne, v), rotation.multiply(q_ne, q)


def solve(problem, frame):
    navigate(problem, 1, 1, False)


def solve_three_rates(problem, frame, fast_per_medium, medium_per_slow, extrapolate):
    navigate(problem, fast_per_medium, medium_per_slow, extrapolate)


def check(problem, frame):
    """Accept every solution."""
'''


def frame_at(folder: Path, text: str = FRAME) -> str:
    """Write the frame, register it, and return its name."""
    file = folder / "frames" / "fixed_axes.py"
    file.parent.mkdir(exist_ok=True)
    file.write_text(text, encoding="utf-8")
    (name,) = sinssim.use(folder)
    return name


def test_it_navigates_at_three_rates(tmp_path: Path) -> None:
    """Against the true motion.

    In axes of the Earth gravity turns with the vehicle by v/R. Held over a slow interval T it lags by T/2, so that the
    position is wrong by ½ g (v/R) (T/2) t². If it is extrapolated, only the first interval is held, 1/8 of this.
    """
    name = frame_at(tmp_path)
    assert FRAME_REGISTRY[name].has_three_rates
    motion = GreatCircle(latitude=0.9, longitude=0.2, height=1000.0, course=0.7, speed=200.0, duration=8.0)
    imu, initial = motion.increments(40.0), motion.state(0.0)
    apart = {}
    for slow in ("hold", "extrapolate"):
        found = sinssim.navigate(imu, initial, frame=name, rates_hz=(40.0, 20.0, 2.0), slow_quantities=slow)
        assert len(found.time) == 17
        true = motion.state(found.time)
        north = 6.37e6 * (found.latitude - true.latitude)
        east = 6.37e6 * np.cos(true.latitude) * (found.longitude - true.longitude)
        apart[slow] = np.sqrt(north**2 + east**2 + (found.height - true.height) ** 2)[-1]
    assert apart["hold"] == pytest.approx(0.5 * 9.8 * (200.0 / 6.37e6) * 0.25 * 8.0**2, rel=0.05)
    assert apart["extrapolate"] < 0.2 * apart["hold"]


def test_a_scenario_runs_at_three_rates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frame_at(tmp_path)
    file = tmp_path / "plan.toml"
    file.write_text(
        'name = "own"\nuse = ["."]\n'
        "great_circle = { latitude_deg = 50.0, course_deg = 40.0, speed_mps = 200.0, duration_s = 4.0 }\n"
        'imu = { grade = "ideal", rate_hz = 40.0 }\n'
        '[navigation]\nframe = "fixed_axes"\nvertical = "free"\nrates_hz = [40.0, 20.0, 4.0]\n'
    )
    with pytest.raises(SystemExit) as end:
        main(["check", str(file)])
    assert not end.value.code
    assert "fixed_axes" in capsys.readouterr().out
    found = sinssim.run(load_scenario(file))
    assert found.summary["algorithms"]["quaternion"]["max_horizontal_error_m"] < 0.01


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("def solve_three_rates(problem, frame, fast_per_medium, medium_per_slow, extrapolate)",
         "def solve_three_rates(problem, fast_per_medium, medium_per_slow, extrapolate)",
         r"three-rate schedule of the frame fixed_axes .*takes \(problem, fast_per_medium.* must take \(problem, f"),
        ("navigate(problem, fast_per_medium, medium_per_slow, extrapolate)", "1 / 0", "line .*ZeroDivisionError"),
        ("solve_three_rates", "three_rates", "rates_hz: the three-rate schedule works in the frames .*, not in fixed"),
    ],
)  # fmt: skip
def test_mistakes_are_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    name = frame_at(tmp_path, FRAME.replace(old, new))
    motion = GreatCircle(latitude=0.9, longitude=0.2, height=1000.0, course=0.7, speed=200.0, duration=1.0)
    with pytest.raises((InputError, RunError), match=said):
        sinssim.navigate(motion.increments(40.0), motion.state(0.0), frame=name, rates_hz=(40.0, 20.0, 2.0))
