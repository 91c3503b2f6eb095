"""JSBSim alone: its angular rates lead its attitude by half a step, which docs/your-navigator.md states."""

from __future__ import annotations

from pathlib import Path

import jsbsim
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation


@pytest.mark.parametrize(
    ("aircraft", "height_ft", "speed_kt", "acceleration", "difference"),
    [("c172x", 5000.0, 100.0, 110.0, 0.46), ("f16", 15000.0, 400.0, 322.0, 1.34)],
)
def test_the_rates_lead_the_attitude_by_half_a_step(
    aircraft: str, height_ft: float, speed_kt: float, acceleration: float, difference: float, tmp_path: Path
) -> None:
    """The mean rate between two attitudes is that printed half a step before their middle, in a roll at 1 Hz."""
    step = 1.0 / 120.0
    flight = jsbsim.FGFDMExec(None)
    flight.set_debug_level(0)
    flight.set_output_path(str(tmp_path))  # some models write a table of their own
    flight.load_model(aircraft)
    flight.set_dt(step)
    for key, value in (("h-sl-ft", height_ft), ("vc-kts", speed_kt), ("lat-geod-deg", 45.0), ("psi-true-deg", 30.0)):
        flight[f"ic/{key}"] = value
    flight.run_ic()
    flight["propulsion/set-running"] = -1
    flight["fcs/throttle-cmd-norm"] = 0.7
    rows = []
    for _ in range(720):
        now = flight.get_sim_time()
        flight["fcs/aileron-cmd-norm"] = 0.3 * np.sin(2.0 * np.pi * now) if now > 0.5 else 0.0
        flight.run()
        rows.append([flight.get_sim_time(), flight["velocities/p-rad_sec"],
                     *(flight[f"attitude/{name}-rad"] for name in ("psi", "theta", "phi"))])  # fmt: skip
    time, rate, *angles = np.array(rows).T
    attitude = Rotation.from_euler("ZYX", np.column_stack(angles))
    of_attitude = (attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 0] / step
    middle, printed = 0.5 * (time[1:] + time[:-1]), CubicSpline(time, rate)
    later = middle > 1.0
    slope = printed(middle, 1)[later]
    apart = (printed(middle) - of_attitude)[later]
    assert apart @ slope / (slope @ slope) == pytest.approx(0.5 * step, rel=2e-3)
    assert np.degrees(np.abs(slope).max()) == pytest.approx(acceleration, rel=0.02)
    assert np.degrees(np.abs(apart).max()) == pytest.approx(difference, rel=0.02)
