"""Runs a scenario's filter: emulated readings of the aiding sensors, initial alignment, estimate.

A filter whose innovations speak against it is run again under other hypotheses, over the beginning of the run."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.alignment.initial_conditions import alignment_samples
from sinssim.data import Array, ImuData, Measurements, NavSolution, NavState, measurements_at
from sinssim.errors import InputError, SinssimError
from sinssim.estimation.consistency import consistency
from sinssim.estimation.estimate import estimate, vibration_untold
from sinssim.estimation.filter_diagnosis import diagnose, widened
from sinssim.estimation.filter_loop import Witness, followed
from sinssim.estimation.filter_result import Diagnosis, Estimate, Innovations
from sinssim.estimation.filter_start import Start, at_rest, by_course, in_motion
from sinssim.estimation.state_model import ErrorModel
from sinssim.progress import Progress, silent
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import filter_model, inertial_sigma, noise_of_combination, with_declination
from sinssim.scenario.run_memory import ROWS
from sinssim.scenario.true_motion import block_of, known_field, mounting, unknown_disturbance
from sinssim.sensors.aiding.land_vehicle import LandVehicle
from sinssim.sensors.aiding_sensor import AidingReadings, Vehicle
from sinssim.sensors.fault_detection import Monitored
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.rotation_encoder import Encoders, encoders_of, turned_in
from sinssim.sensors.sensor_set_readings import TrueErrors
from sinssim.sensors.vibration_noise import AddedNoise, vibration, vibration_noise
from sinssim.simulation.truth_comparison import Aided, InertialParameters, compare_with_truth
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import axes_along
from sinssim.system.process import give_back_memory, shared
from sinssim.toml_section import LeverArm
from sinssim.truth.trajectory import Trajectory

_FIRST_S = 300.0
"""Shortest time that is looked at. It is doubled until the innovations within it speak against the filter, so that a
fault that shows early costs little however long the run is."""


def diagnosed(
    filter_estimate: Estimate,
    start: Start,
    readings: Sequence[Measurements],
    options: Mapping[str, Any],
    progress: Progress = silent,
) -> Estimate:
    """Return an estimate with its diagnosis, if its innovations speak against the filter, which started with
    increments, state and covariance, and had the `options` of `estimate`."""
    if consistency(filter_estimate).consistent:
        return filter_estimate
    begin, end = float(start.imu.time[0]), float(start.imu.time[-1])
    lasts = _FIRST_S
    while begin + lasts < end and (
        options["encoders"] is not None or _consistent_until(filter_estimate, begin + lasts)
    ):
        lasts *= 2.0
    seen = _diagnosis(filter_estimate, start, readings, options, min(begin + lasts, end), progress)
    if seen is not None and seen.cause is not None and seen.cause.kind != "inertial noise":
        # a better explanation was found than the vibration that the estimate's remark suspects
        suspected = vibration_untold(
            filter_estimate.innovations, start.imu, filter_estimate.model, options["added_noise"]
        )
        filter_estimate = replace(
            filter_estimate, remarks=tuple(remark for remark in filter_estimate.remarks if remark not in suspected)
        )
    return replace(filter_estimate, diagnosis=seen)


def _consistent_until(filter_estimate: Estimate, until: float) -> bool:
    """Return whether the innovations up to an instant are consistent."""
    part = tuple(_part(series, until) for series in filter_estimate.innovations)
    ends = filter_estimate.divergence is not None and filter_estimate.divergence.time <= until
    return not ends and consistency(replace(filter_estimate, innovations=part, divergence=None)).consistent


def _part(innovations: Innovations, until: float) -> Innovations:
    """Return the innovations up to an instant."""
    k = int(np.searchsorted(innovations.time, until, "right"))
    i = innovations
    return replace(
        i, time=i.time[:k], value=i.value[:k], lower=i.lower[:k], nis=i.nis[:k], accepted=i.accepted[:k],
        reason=i.reason[:k],
    )  # fmt: skip


def _diagnosis(
    filter_estimate: Estimate,
    start: Start,
    readings: Sequence[Measurements],
    options: Mapping[str, Any],
    until: float,
    progress: Progress,
) -> Diagnosis | None:
    edges = start.imu.time
    stop = int(np.searchsorted(edges, until - 1e-9))
    imu = ImuData(edges[: stop + 1], start.imu.dtheta[:stop], start.imu.dvel[:stop])
    within = [measurements_at(m, m.time <= edges[stop] + 1e-9) for m in readings]

    runs, begin = 0, time.perf_counter()

    def run(
        model: ErrorModel, factors: Mapping[str, float], *, smooth: bool = False, witness: Witness | None = None
    ) -> Estimate:
        nonlocal runs
        runs += 1
        measurements = [replace(m, sigma=factors.get(m.label, 1.0) * m.sigma) for m in within]
        run_options = {**options, "axes": model.axes}
        if witness is not None:
            run_options |= {"kind": "error-state", "gate": None, "monitor_s": 0.0}
        known = widened(start.covariance, filter_estimate.model, model)
        with nullcontext() if witness is None else followed(witness):
            return estimate(
                imu, start.state, measurements, model, covariance=known, smooth=smooth, history=False, **run_options
            )

    interval = float(np.median(np.diff(imu.time)))
    seen = diagnose(run, filter_estimate.model, interval, float(edges[stop]), progress)
    progress("done", 1.0)
    return None if seen is None else replace(seen, runs=runs, seconds=time.perf_counter() - begin)


_APART = 1 << 41
"""Offset of the seed, far from the seeds of scenarios and of calibrations."""


def readings_along(scenario: Scenario, trajectory: Trajectory, imu: ImuData) -> tuple[AidingReadings, ...]:
    """Return what the aiding sensors of a scenario read along a motion, beside the increments of its block."""
    assert scenario.aiding is not None
    beside = partial(navigate_beside, scenario, trajectory)
    vehicle = Vehicle(trajectory, scenario.seed, beside, mounting(scenario).q_bs, imu)
    return tuple(readings for sensor in scenario.aiding.sensors().values() for readings in sensor.read(vehicle))


# Long: the stages of an aided run in order.
def aid_run(
    scenario: Scenario,
    trajectory: Trajectory,
    imu: ImuData,
    initial: NavState,
    errors: TrueErrors,
    *,
    aiding: tuple[AidingReadings, ...] | None = None,
    monitored: Sequence[Monitored] = (),
    history: bool = True,
    row_s: float | None = None,
    progress: Progress = silent,
) -> Aided:
    """Emulate a scenario's aiding sensors, unless their readings are given, run its filter, and compare the estimate
    with the truth, the motion of the vehicle at the block's place and the errors of its inertial sensors in this run.
    The engine navigates on the increments from the initial state of the vehicle; what the monitoring of a redundant set
    reported is used. Without the history nothing is smoothed, and the aided solution is the same. Rows of the
    covariance are stored at least `row_s` s apart; by default about 2000 rows are kept, all of them if the scenario
    smooths. If the filter diverged, the aided solution ends there. The progress is what a diagnosis tries and the
    fraction done."""
    section, navigation = scenario.filter, scenario.navigation
    assert section is not None
    sensed = _with_shared_times(readings_along(scenario, trajectory, imu) if aiding is None else aiding, imu.time)
    give_back_memory()
    model, edges = filter_model(scenario, float(imu.time[-1] - imu.time[0])), imu.time
    model = with_declination(model, scenario, trajectory)
    measurements = [with_noise_factor(s.measurements, section.measurement_noise_factor) for s in sensed]
    block = block_of(trajectory, scenario.imu)
    encoders = encoders_of(block, errors.encoders, edges)
    start = Start(imu, turned_in(initial, block, float(edges[0])), None)
    if section.alignment_s is not None:
        start = coarse_alignment(scenario, trajectory.ellipsoid.name, start, measurements, model)
    smooth = section.smooth and history
    if row_s is None:
        row_s = 0.0 if smooth else float(imu.time[-1] - imu.time[0]) / ROWS
    axes = axes_along(navigation.frame, trajectory.state, trajectory.start, trajectory.end)
    added = noise_of_combination(model, scenario, monitored, edges)
    solution = filtered(
        scenario,
        start,
        measurements,
        model,
        trajectory.ellipsoid.name,
        axes,
        history,
        row_s,
        encoders,
        added,
        progress=progress,
    )
    give_back_memory()
    used = (monitored[0].used, monitored[1].used) if monitored else None
    inertial = InertialParameters(errors, edges, scenario.seed, scenario.imu.sensor_set, used)
    gravity = partial(unknown_disturbance, scenario, trajectory)
    return compare_with_truth(trajectory, inertial, edges, sensed, solution, block, gravity)


def filtered(
    scenario: Scenario,
    start: Start,
    measurements: Sequence[Measurements],
    model: ErrorModel,
    ellipsoid: str,
    axes: str | None,
    history: bool,
    row_s: float,
    encoders: Encoders | None = None,
    added: AddedNoise | None = None,
    bridged: AddedNoise | None = None,
    progress: Progress = silent,
) -> Estimate:
    """Run a scenario's filter from increments, state and covariance on measurements from anywhere, one entry for each
    sensor and kind; those before the start are left out. Axes and `row_s` are as for `estimate`; the history is for
    smoothing and observability. Noise of the inertial sensors is `added` to the model's, by default that of vibration,
    if the section has any, and that of gaps in the readings that are `bridged`. The solution of the estimate is that of
    the vehicle, its history that of the block."""
    section, navigation = scenario.filter, scenario.navigation
    assert section is not None
    options: dict[str, Any] = {
        "loop": section.loop,
        "rate_hz": section.rate_hz,
        "gate": section.gate or None,
        "kind": section.kind,
        "seed": scenario.seed,
        "monitor_s": section.monitor_s,
        "row_s": row_s,
        "mechanization": navigation.in_segments(ellipsoid),
        "field": known_field(scenario),
    }
    readings = [_after(m, float(start.imu.time[0])) for m in measurements]
    kappa = section.vibration_noise
    added = added or (vibration_noise(vibration(start.imu), kappa, kappa).plus(bridged) if kappa else bridged)
    options |= {"axes": axes, "added_noise": added, "encoders": encoders}
    smooth = section.smooth and history
    filter_estimate = estimate(
        start.imu, start.state, readings, model, covariance=start.covariance, smooth=smooth, history=history, **options
    )
    if history and section.diagnose:
        filter_estimate = diagnosed(filter_estimate, start, readings, options, progress)
    for key in ("axes", "added_noise", "encoders"):
        del options[key]
    if section.backward and history:
        options["row_s"] = max(row_s, float(start.imu.time[-1] - start.imu.time[0]) / ROWS)  # nothing smooths it
        filter_estimate = _with_backward(
            filter_estimate, start.imu, readings, section.vibration_noise, options, bridged
        )
    if encoders is None:
        return filter_estimate
    smoothed, unaided = filter_estimate.smoothed, filter_estimate.unaided
    if smoothed is not None:
        smoothed = replace(smoothed, solution=encoders.turned_out(smoothed.solution))
    return replace(
        filter_estimate,
        solution=encoders.turned_out(filter_estimate.solution),
        smoothed=smoothed,
        unaided=lambda: encoders.turned_out(unaided()),
    )


def _with_backward(
    forward: Estimate,
    imu: ImuData,
    readings: Sequence[Measurements],
    vibration: float,
    options: dict[str, Any],
    bridged: AddedNoise | None,
) -> Estimate:
    """Return an estimate with the backward solution, or with a remark on why there is none."""
    from sinssim.simulation.backward_filter import run_backward

    if forward.divergence is not None:
        remark = "There is no backward solution, because the filter diverged: the state to start from is not known."
        return replace(forward, remarks=(*forward.remarks, remark))
    backward = run_backward(forward, imu, readings, vibration, options, bridged)
    if (end := backward.divergence) is not None:
        at = f"The backward solution diverged at {end.time:.1f} s: {end.reason}."
        return replace(forward, remarks=(*forward.remarks, at))
    return replace(forward, backward=backward)


def navigate_beside(scenario: Scenario, trajectory: Trajectory, grade: str, lever_arm: LeverArm) -> NavSolution:
    """Return the solution of another inertial system of the vehicle, started from the true state at its own place."""
    from sinssim.truth.motions.mounted_block import Vibrating

    place = Vibrating(trajectory, (), lever_arm)
    ideal = place.increments(scenario.imu.rate_hz)
    imu = emulate(ideal, Imu(grade=grade, rate_hz=scenario.imu.rate_hz), scenario.seed + _APART)
    return navigate(
        imu,
        place.state(place.start),
        algorithm="quaternion",
        frame=scenario.navigation.frame,
        gravity=scenario.navigation.gravity,
        ellipsoid=trajectory.ellipsoid.name,
        vertical="baro-loop",
        height=place.state(ideal.time).height,
    )


def coarse_alignment(
    scenario: Scenario, ellipsoid_of_truth: str, start: Start, measurements: Sequence[Measurements], model: ErrorModel
) -> Start:
    """Return the start of the filter after the scenario's coarse alignment. `ellipsoid_of_truth`: name of the reference
    ellipsoid of the measurements."""
    section, imu, sigma = scenario.filter, start.imu, inertial_sigma(scenario)
    assert section is not None
    assert section.alignment_s is not None
    count = alignment_samples(imu.time, section.alignment_s, "filter.alignment_s", "the filter")
    gravity = scenario.navigation.gravity
    ellipsoid = scenario.navigation.ellipsoid_over(ellipsoid_of_truth)
    if section.alignment == "at-rest":
        try:
            # the vehicle stands still or not, whatever noise the filter is told
            return at_rest(imu, start.state, model, sigma, count, inertial_sigma(scenario, 1.0), gravity, ellipsoid)
        except SinssimError as error:
            raise InputError(
                f"filter.alignment_s = {section.alignment_s:g}: the vehicle must be stationary for this time, with "
                f"gyros that sense the Earth's rate: {error}"
            ) from error
    fixes = {m.kind: m for m in measurements if m.label in ("gnss-position", "gnss-velocity")}
    try:
        if section.alignment == "by-course":
            angles, angles_sigma = _assumed_mounting(scenario, measurements)
            return by_course(imu, fixes["gnss-position"], fixes["gnss-velocity"], sigma, count, angles, angles_sigma)
        return in_motion(imu, fixes["gnss-position"], fixes["gnss-velocity"], sigma, count, gravity, ellipsoid)
    except SinssimError as error:
        raise type(error)(f"filter.alignment_s = {section.alignment_s:g}: {error}") from error


def _assumed_mounting(scenario: Scenario, measurements: Sequence[Measurements]) -> tuple[tuple[float, float], float]:
    """Return pitch and yaw of the vehicle's axes in the block's, as they are assumed, and their 1σ, rad."""
    assert scenario.aiding is not None
    for m in measurements:
        if m.kind == "land-velocity" and len(m):
            section = scenario.aiding.sensor(LandVehicle)
            spread = 0.0 if section is None else math.radians(section.mounting_sigma_deg)
            return (float(m.value[0, 2]), float(m.value[0, 3])), spread
    ahead = rotation.dcm_from_quaternion(mounting(scenario).q_bs)[0]
    return (math.atan2(-ahead[2], math.hypot(ahead[0], ahead[1])), math.atan2(ahead[1], ahead[0])), 0.0


def _with_shared_times(sensed: Sequence[AidingReadings], edges: Array) -> tuple[AidingReadings, ...]:
    """Return readings whose times are the same arrays wherever they are equal: those of the IMU, or of each other."""
    known, shared_readings = [edges, edges[1:]], []
    for readings in sensed:
        m = readings.measurements
        m = replace(m, time=shared(m.time, known), arrival=shared(m.arrival, known))
        shared_readings.append(replace(readings, measurements=m, time=shared(readings.time, known)))
    return tuple(shared_readings)


def with_noise_factor(measurements: Measurements, factor: float) -> Measurements:
    """Return readings with the assumed noise: the true noise times a factor."""
    return measurements if factor == 1.0 else replace(measurements, sigma=factor * measurements.sigma)


def _after(measurements: Measurements, start: float) -> Measurements:
    """Return the readings after the filter's start."""
    return measurements_at(measurements, measurements.time > start + 1e-9)
