"""Compiles the kernels of the shipped scenarios by using each once: `python -m sinssim.cli.precompile`.

With `--studies` it compiles those of ensembles and studies: of every attitude algorithm and frame. All other kernels
are compiled when first used, in a second or two each. The progress bars show it.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from sinssim import earth
from sinssim.alignment.disturbed_base import inertial_curve
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.analyses.turntable_calibration import calibrate
from sinssim.content import list_content, package_content
from sinssim.experiments.ensembles.batch_navigation import navigate_batch
from sinssim.experiments.run.run_execution import rehearse, run
from sinssim.experiments.studies.step_cost import DATA_HZ, timed_data
from sinssim.experiments.studies.study_schema import Study
from sinssim.experiments.study import load_study
from sinssim.scenario import Scenario, filter_model, load_scenario
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_readings import draw_true_errors
from sinssim.sensors.sensor_set_section import Redundant
from sinssim.strapdown.attitude import ALGORITHMS, MEASURED_ATTITUDE
from sinssim.strapdown.mechanization import CURVATURES, Mechanization
from sinssim.strapdown.navigate import navigate
from sinssim.system.files import Draft
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


def batch() -> None:
    """Navigate a batch of an ensemble with every error of a laser unit in its height loop: the largest kernel."""
    imu, start = timed_data()
    unit = Imu(
        grade="laser-standard", gyro_instability_deg_h=0.003, accel_instability_ug=5.0, gyro_quantum_arcsec=0.5,
        accel_quantum_mm_s=1.0,
    )  # fmt: skip
    errors = draw_true_errors(unit).imu
    height = np.full(len(imu.time), float(start.height))
    navigate_batch(imu, start, [errors], [0], [len(imu)], Mechanization(vertical="baro-loop"), height=height)


def engines(place: int) -> None:
    """Navigate on the data of a timing by every second of the engines, from a `place` in their list.

    They are every algorithm in a frame of each kind, quaternions with each kind of radii, and the schedules of the
    shipped studies.
    """
    studies = [study for name in list_content("studies") if isinstance(study := load_study(name), Study)]
    scheduled = [part for study in studies for part in study.parts if part.schedules_hz]
    used: list[dict[str, Any]] = [
        *({"algorithm": algorithm, "frame": frame}
          for algorithm in ALGORITHMS if algorithm not in ("platform", MEASURED_ATTITUDE)
          for frame in ("level", "wander", "inertial")),
        *({"frame": frame, "curvature": curvature} for curvature in CURVATURES for frame in ("level", "wander")),
        *({"algorithm": algorithm, "frame": frame, "rates_hz": (DATA_HZ, DATA_HZ / 2.0, DATA_HZ / 10.0)}
          for part in scheduled for algorithm, frame, *_ in part.engines),
    ]  # fmt: skip
    imu, start = timed_data()
    for options in used[place::2]:
        navigate(imu, start, Mechanization(**options))


def second_batch() -> None:
    """Use the kernels of a batch and of the second half of the engines."""
    batch()
    engines(1)


def in_two_processes(first: Callable[[], None], second: Callable[[], None]) -> None:
    """Call two functions, the second one in another process: a process compiles one kernel at a time."""
    other = multiprocessing.get_context("spawn").Process(target=second)
    other.start()
    first()
    other.join()
    if other.exitcode:
        raise SystemExit(1)


if __name__ == "__main__":
    if "--studies" in sys.argv[1:]:
        in_two_processes(partial(engines, 0), second_batch)
    else:
        in_two_processes(first_half, second_half)
