"""The reference solution of a finished run on recorded sensors, read from its directory."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.recorded_run import RecordedRun
from sinssim.logs.reference import Reference


def reference_of(run: RecordedRun) -> Reference:
    """Return what solutions are compared with.

    Returns:
        The reference, with its lever arm, its gaps, the delay of its velocities and its own σ.

    Raises:
        InputError: the run has no reference.
    """
    section = run.scenario.get("log", {}).get("reference")
    if section is None or not run.knows:
        raise InputError(
            f"{run.path} is a run on recorded sensors without a reference, so the error of a solution is unknown: "
            f"give the scenario a table [log.reference] and run it again."
        )
    rows = run.table("reference")
    time = rows["time_s"]

    def several(*names: str) -> Array | None:
        return np.stack([rows[name] for name in names], axis=1) if names[0] in rows else None

    knows = run.knows
    delay = float(section.get("velocity_delay_s", 0.0))
    gap = section.get("gap_s")
    north, east, down = section.get("lever_arm_m", (0.0, 0.0, 0.0))
    return Reference(
        str(run.summary["log"]["reference_file"]), time, rows["latitude_rad"], rows["longitude_rad"], rows["height_m"],
        several("velocity_n_mps", "velocity_e_mps", "velocity_d_mps") if "velocity" in knows else None,
        several("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z") if "attitude" in knows else None,
        several("sigma_north_m", "sigma_east_m", "sigma_down_m"),
        (float(north), float(east), float(down)),
        None if gap is None else float(gap),
        time - delay if delay else None,
    )  # fmt: skip
