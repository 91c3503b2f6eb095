"""Compiles the kernels of the shipped scenarios by using each once: `python -m sinssim.cli.precompile`.

All other kernels are compiled when first used, in a second or two each: those of the other attitude algorithms and
frames, and of studies. The progress bars show it.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from sinssim import earth
from sinssim.alignment.disturbed import inertial_curve
from sinssim.error_budget.analyse import budget
from sinssim.estimation.from_scenario import filter_states
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.content import package_content
from sinssim.scenario.sections.within_imu.sensor_set import Redundant
from sinssim.simulation.execute import rehearse, run
from sinssim.truth.curve import Curve


def main() -> None:
    """Use every kernel of the shipped scenarios.

    Navigate a parked vehicle by every algorithm, compute its budget, fly half a second of a curve, and rehearse every
    shipped scenario.

    Rehearsals take hardly longer than the compilation.
    """
    scenario = Scenario.model_validate(
        {
            "name": "precompile",
            "parked": {"latitude_deg": 45.0, "duration_s": 2.0},
            "imu": {"grade": "mems-industrial", "rate_hz": 20.0},
            "navigation": {"algorithms": ("quaternion", "poisson", "euler"), "vertical": "baro-loop"},
        }
    )
    with tempfile.TemporaryDirectory(prefix="sinssim-") as folder:
        run(scenario, Path(folder) / "run")
    budget(scenario)
    redundant = Redundant(type="redundant", windows_s=(1.0,))  # faults lie outside the rehearsal of their scenario
    run(scenario.model_copy(update={"imu": scenario.imu.model_copy(update={"sensor_set": redundant})}))

    knots = np.arange(16) / 30.0
    position = earth.geodetic_to_ecef(0.8 + 3e-5 * knots, 0.2 + 1e-6 * knots**2, 1000.0 + 10.0 * knots)
    attitude = np.tile((1.0, 0.0, 0.0, 0.0), (len(knots), 1))
    curve = Curve(knots, position, attitude)
    increments = curve.increments(100.0)
    curve.state(increments.time)
    curve.rates(increments.time)
    inertial_curve(increments)  # a filter's alignment in motion lasts longer than a rehearsal

    for file in sorted(package_content("scenarios").glob("*.toml")):
        plan = load_scenario(str(file))
        if plan.one_component is not None:
            run(plan)
        else:
            rehearse(plan if plan.filter is None else filter_states.with_states(plan), recorded=False)


if __name__ == "__main__":
    main()
