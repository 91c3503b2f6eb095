"""Compiles the kernels of the shipped scenarios by using each once: `python -m sinssim.cli.precompile`.

All other kernels are compiled when first used, in a second or two each: those of the other attitude algorithms and
frames, and of studies. The progress bars show it.
"""

from __future__ import annotations

import multiprocessing

import numpy as np

from sinssim import earth
from sinssim.alignment.disturbed_base import inertial_curve
from sinssim.analyses.calibration.turntable_calibration import calibrate
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.content import package_content
from sinssim.experiments.run.execute import rehearse, run
from sinssim.scenario import Scenario, filter_model, load_scenario
from sinssim.sensors.sets.sensor_set import Redundant
from sinssim.system.outputs import Draft
from sinssim.truth.curve import Curve

_PARKED = Scenario.model_validate(
    {
        "name": "precompile",
        "parked": {"latitude_deg": 45.0, "duration_s": 2.0},
        "imu": {"grade": "mems-industrial", "rate_hz": 20.0},
        "navigation": {"algorithms": ("quaternion", "poisson", "euler"), "vertical": "baro-loop"},
    }
)


def first_half() -> None:
    """Navigate a parked vehicle by every algorithm: they share the larger part of their kernels; then calibrate."""
    with Draft() as folder:
        run(_PARKED, folder.path / "run")
    calibrate(load_scenario("calibration_systematic", ("turntable.dwell_s=10", "imu.rate_hz=10")))


def second_half() -> None:
    """Use every other kernel: of a curve, of a parked vehicle's budget, of a rehearsal of every shipped scenario.

    What shares no large kernel with the first half comes first, so that the halves, started together, compile few
    kernels twice. Rehearsals take hardly longer than the compilation.
    """
    knots = np.arange(16) / 30.0
    position = earth.geodetic_to_ecef(0.8 + 3e-5 * knots, 0.2 + 1e-6 * knots**2, 1000.0 + 10.0 * knots)
    attitude = np.tile((1.0, 0.0, 0.0, 0.0), (len(knots), 1))
    curve = Curve(knots, position, attitude)
    increments = curve.increments(100.0)
    curve.state(increments.time)
    curve.rates(increments.time)
    inertial_curve(increments)  # a filter's alignment in motion lasts longer than a rehearsal

    plans = [load_scenario(str(file)) for file in sorted(package_content("scenarios").glob("*.toml"))]
    for plan in (plan for plan in plans if plan.one_component is not None):
        run(plan)
    budget(_PARKED)
    in_space = [plan for plan in plans if plan.one_component is None]
    in_space.sort(
        key=lambda scenario: (scenario.navigation.frame == "level", "platform" not in scenario.navigation.algorithms)
    )
    for plan in in_space:
        rehearse(plan if plan.filter is None else filter_model.with_states(plan))
    redundant = Redundant(type="redundant", windows_s=(1.0,))  # faults lie outside the rehearsal of their scenario
    run(_PARKED.model_copy(update={"imu": _PARKED.imu.model_copy(update={"sensor_set": redundant})}))


def main() -> None:
    """Use every kernel of the shipped scenarios."""
    first_half()
    second_half()


def in_two_processes() -> None:
    """Use every kernel of the shipped scenarios, half of them in another process: a process compiles one at a time."""
    other = multiprocessing.get_context("spawn").Process(target=second_half)
    other.start()
    first_half()
    other.join()
    if other.exitcode:
        raise SystemExit(1)


if __name__ == "__main__":
    in_two_processes()
