"""Calibration of a sensor block on a turntable: of a simulated sequence, or of recorded sensors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sinssim.analyses.calibration_problem import Estimate, Parameter, Task, make_task, values_of
from sinssim.analyses.calibration_result import CalibrationResult
from sinssim.analyses.systematic_calibration import in_accelerometer_frame
from sinssim.analyses.turntable_dwells import Dwells, between, detected, planned
from sinssim.data import Array, ImuData
from sinssim.errors import InputError, unknown_name
from sinssim.progress import Progress, shown
from sinssim.scenario.load import Overrides, as_scenario
from sinssim.scenario.schema import Scenario
from sinssim.scenario.tables import CalibrationSection
from sinssim.scenario.true_motion import fly
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.imu_section import draw
from sinssim.system.files import check_directory

METHODS = {
    "separate": "means in known positions and integrals over known turns, by least squares",
    "systematic": "errors of navigation during the sequence, by a Kalman filter and least squares",
}
_ESTIMATED = ("bias", "scale", "misalignment")


def calibrate(
    scenario: Scenario | str | Path,
    directory: Path | str | None = None,
    *,
    method: str | None = None,
    overrides: Overrides = (),
    overwrite: bool = False,
    progress: Progress | bool | None = None,
) -> CalibrationResult:
    """Estimate the errors of a scenario's IMU from the sequence of [turntable].

    Args:
        scenario: the scenario, or its file or name.
        directory: directory to write; nothing is written if not given.
        method: one of `METHODS`; default: that of [calibration].
        overrides: settings "key=value", as for `load_scenario`.
        overwrite: whether an existing calibration in the directory may be replaced.
        progress: called with "Calibrating" and the fraction done, 0…1; True shows a bar.

    Returns:
        Values, covariance, observability, residuals, and in a simulation the true values.

    Raises:
        InputError: the scenario has no sequence, the data do not contain its dwells, or a file or the directory cannot
            be used.
        RunError: the data do not fit the sequence.
    """
    scenario = as_scenario(scenario, overrides)
    if scenario.turntable is None:
        raise InputError(
            f"the scenario {scenario.name} has no sequence to calibrate with: add [turntable], for example with "
            'sequence = "19-positions", or give the scenario calibration_table or calibration_systematic.'
        )
    section = scenario.calibration or CalibrationSection()
    if method is not None:
        if method not in METHODS:
            raise unknown_name("method of calibration", method, METHODS)
        section = section.model_copy(update={"method": method})
    check_directory(directory, overwrite)
    with shown(progress) as report:
        report("Calibrating", 0.0)
        imu, dwells, notes = _readings(scenario, section)
        report("Calibrating", 0.5)
        task = make_task(scenario, section, imu, dwells)
        estimate = _estimate(task)
        report("Calibrating", 1.0)
    truth = _truth(scenario, section.method, task.known) if scenario.log is None else None
    result = CalibrationResult(
        scenario, section.method, task.known, estimate, dwells.seconds(imu.time), truth, tuple(notes)
    )
    result = replace(result, notes=(*notes, *_remarks(scenario, task, result)))
    return result if directory is None else replace(result, directory=result.save(directory, overwrite=overwrite))


def _estimate(task: Task) -> Estimate:
    """Estimate by the method of the section, whose module is loaded only here, with its compiled kernels."""
    if task.section.method == "separate":
        from sinssim.analyses.separate_calibration import separate as method
    else:
        from sinssim.analyses.systematic_calibration import systematic as method
    return method(task)


def _readings(scenario: Scenario, section: CalibrationSection) -> tuple[ImuData, Dwells, list[str]]:
    """Return the readings of the sequence, its dwells, and sentences about them."""
    table = scenario.turntable
    assert table is not None  # checked by the caller
    if scenario.log is not None:
        from sinssim.logs.recorded_log import recorded_log

        log = recorded_log(scenario.log, scenario.imu.mounting_deg)
        if section.dwells_s:
            if len(section.dwells_s) != len(table.dwells):
                raise InputError(
                    f"calibration.dwells_s has {len(section.dwells_s)} dwells, but the sequence of [turntable] has "
                    f"{len(table.dwells)}: give one for each position."
                )
            return log.imu, between(section.dwells_s, log.imu.time, "calibration.dwells_s"), list(log.notes)
        return (
            log.imu,
            detected(log.imu, table),
            [*log.notes, "The dwells are the intervals in which the gyros are at rest."],
        )
    if section.dwells_s:
        raise InputError(
            "calibration.dwells_s is for recorded sensors ([log]); in a simulation the dwells are known: remove it."
        )
    from sinssim.sensors.imu.emulation import emulate

    shortest = min(end - begin for begin, end in table.dwells)
    if shortest * scenario.imu.rate_hz < 3.0:
        raise InputError(
            f"turntable.dwell_s = {shortest:g} is shorter than three samples at imu.rate_hz = "
            f"{scenario.imu.rate_hz:g}; give at least {3.0 / scenario.imu.rate_hz:g} s."
        )
    ideal = fly(scenario).increments(scenario.imu.rate_hz)
    measured = emulate(ideal, scenario.imu, scenario.seed)
    return measured, planned(table, measured.time), []


def _truth(scenario: Scenario, method: str, known: tuple[Parameter, ...]) -> Array:
    errors = draw(scenario.imu, scenario.seed)
    return values_of(known, errors if method == "separate" else in_accelerometer_frame(errors)[0])


def _remarks(scenario: Scenario, task: Task, result: CalibrationResult) -> list[str]:
    """Return sentences on what is not modelled and on residuals that do not fit."""
    sentences = []
    left = []
    for term in TERMS:
        if term.drawn and term.field not in _ESTIMATED and any(np.any(part) for part in scenario.imu.stated(term)):
            left.append(f"{term.triad} {term.label}".replace("accel ", "accelerometer "))
    left += [f"gyro {name}" for name in task.gyro.untold] + [f"accelerometer {name}" for name in task.accel.untold]
    if scenario.imu.accel_delay_ms:
        left.append("accelerometer delay")
    if np.any(scenario.imu.accel_arms_mm) and not any(parameter.field == "arm" for parameter in task.known):
        left.append("places of the accelerometers")
    if left:
        sentences.append(f"Not modelled by the calibration, and therefore in its residuals: {', '.join(left)}.")
    solution = result.estimate.solution
    if solution.fit == "large":
        sentences.append(
            f"The residuals are larger than the stated noise explains: χ² = {solution.chi_square:.4g} with "
            f"{solution.degrees} degrees of freedom. The errors of the estimates are then larger than their 1σ: the "
            "noise of imu.grade, the accuracy of the table or the sequence differ from those of the readings."
        )
    elif solution.fit == "small" and scenario.log is not None:
        sentences.append(
            f"The residuals are smaller than the stated noise: χ² = {solution.chi_square:.4g} with {solution.degrees} "
            "degrees of freedom. The 1σ of the estimates are too large."
        )
    return sentences
