"""What is compiled ahead, and that whatever else a scenario may choose says that it is compiled."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

CHOICES = """
import json, os
from pathlib import Path
from sinssim.strapdown.attitude import SCENARIO_ALGORITHMS
from sinssim.cli import precompile
from sinssim.earth.ellipsoids import GRAVITY_MODELS
from sinssim.strapdown.frames import FRAMES
from sinssim.jit import compilation
from sinssim.scenario import Scenario
from sinssim.sensors.imu.grades import GRADES
from sinssim.experiments.run.run_execution import run

def kept():
    return sum(1 for _ in Path(os.environ["SINSSIM_CACHE"]).rglob("*.nbc"))

def short(grade="laser-navigation", vertical="free", gravity="normal", **navigation):
    return Scenario.model_validate({
        "name": "short",
        "parked": {"latitude_deg": 45.0, "longitude_deg": 10.0, "duration_s": 2.0},
        "imu": {"grade": grade, "rate_hz": 50.0},
        "navigation": {"algorithms": ("quaternion",), "vertical": vertical, "gravity": gravity, **navigation},
    })

def done(name, work):
    told, before = [], kept()
    with compilation(told.append):
        work()
    print(json.dumps([name, told.count(True), kept() - before]), flush=True)

done("precompile", lambda: (precompile.first_half(), precompile.second_half()))
done("again", lambda: (precompile.first_half(), precompile.second_half()))
for grade in GRADES:
    done(f"grade {grade}", lambda: run(short(grade=grade)))
for gravity in GRAVITY_MODELS:
    done(f"gravity {gravity}", lambda: run(short(gravity=gravity)))
for algorithm in SCENARIO_ALGORITHMS:
    if algorithm not in ("measured-attitude", "platform"):  # of sets of their own, whose scenarios are compiled ahead
        done(f"algorithm {algorithm}", lambda: run(short(algorithms=(algorithm,))))
for frame in FRAMES:
    done(f"frame {frame}", lambda: run(short(frame=frame)))
"""


@pytest.mark.slow
def test_every_choice_is_compiled_ahead_or_says_that_it_is_compiled(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", CHOICES],
        env={**os.environ, "SINSSIM_CACHE": str(tmp_path)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = {name: (told, kept) for name, told, kept in map(json.loads, done.stdout.splitlines())}
    assert found["precompile"][0] > 0
    assert found["again"] == (0, 0)
    assert len(found) > 30
    for name, (told, kept) in found.items():
        assert (told > 0) == (kept > 0), name
    for name in ("algorithm quaternion", "algorithm poisson", "algorithm euler", "frame level"):
        assert found[name] == (0, 0), name
    assert found["algorithm poisson-4-ortho"][0] > 0
    assert found["algorithm quaternion-3"][0] > 0
