"""Emulation of the sensor block: adds all of its errors to ideal increments in one pass; output of rates.

The stages are applied in this order. T is the length of the interval, t the time of its middle since the start, u =
Δβ/T the mean rate or specific force of the interval in the block's axes, f that of the accelerometers; i is the
sensitive axis, j ≠ i are the others. Every error is 0 unless given. The names in brackets are the fields of
`TriadErrors` (SI). `sinssim.sensors.imu.error_term_table` has the key of each in a scenario's [imu], the key of its 1σ
if it is random, and the permitted units. Errors of the whole block are named by their keys.

  1. place and time: accelerometer i sits at its own place r_i, and the accelerometers' readings lag the gyros' by δ
     (accel_arms_mm, accel_delay_ms); gas flow in laser gyros, equal in all three, simulates a rotation that changes
     with the temperature ([imu.laser_gyro]). The same in every run: `sinssim.sensors.imu.size_effect`
         f_i ← f_i + [ω̇ × r_i + ω × (ω × r_i)]_i,     f(t) ← f(t − δ),     ω_i ← ω_i + Ω₀(Θ) − Ω₀(0)
  2. sensitive axis (misalignment)
         x_i = u_i + Σ_j M_ij u_j
  3. response (asymmetry, quadratic, cubic, cross_axis)
         n_i = x_i + ½κ|x_i| + K₂x_i² + K₃x_i³ + Σ_j C_ij x_i u_j
     κ is the relative difference of the scale factors for positive and negative inputs; C the cross-coupling of
     pendulous accelerometers (K_ip, K_io of IEEE Std 1293), which rectifies vibration (vibro-pendulous error)
  4. equation (2), with drifts (scale, scale_temperature, bias, g_sensitivity, bias_temperature, ramp)
         y_i = (1 + k_i + k′_i Θ) n_i + ω₀_i + Σ_m G_im f_m + β_i Θ + R_i t + b_i + w_i + c_i
     Θ(t) = Θ_∞ + (Θ₀ − Θ_∞) exp(−t/τ_Θ) is the temperature above that of the calibration (temperature_start_c,
     temperature_steady_c, warm_up_time_s)
       b: bias instability, stationary first-order Gauss-Markov of 1σ σ_b and correlation time τ_b (instability,
          correlation_time)
       w: rate random walk K, 0 at the start (rate_walk)
       c: flicker, the bias instability B of IEEE Std 952 (flicker)
  5. noise and faults (random_walk: N)
         Δβ̃_i = y_i T + N√T ν_i + bias steps and spikes of [[imu.faults]]
  6. saturation (limit): Δβ̃_i is limited to ±limit·T and flagged
  7. quantisation of the accumulated sum (quantum: Q; in a run at least 2⁻⁵² rad and 2⁻⁴⁶ m/s)
         Δβ̃_i ← differences of round(Σ Δβ̃_i / Q) Q
  8. data link: dropouts (reads 0, the increments are lost) and frozen outputs, flagged; jitter of time stamps

Stage 3 acts on the mean over an interval, and the arms of stage 1 on the rotation interpolated between the samples.
`sinssim.sensors.imu.size_effect` adds the effects of faster motion on both to the ideal increments. The delay needs
no such addition, because it does not change means.

Allan deviations over τ, sampled with T, of each noise alone:
    Q  quantisation: √3 Q_z/τ with Q_z = Q/√12                        N  N/√τ
    K  K√(τ/3), exactly at every τ = T, 2T, …                         R  Rτ/√2
    B  √(2 ln 2/π) B = 0.664 B, flat to 0.2 % from τ = T to 3·10⁶ T: a sum of ten first-order processes with time
       constants from T to 4·10⁶ T, driven by one white noise
    b  Gauss-Markov, exactly at every τ = T, 2T, …: σ²(τ) = σ_b² (2τ_b/τ) [1 − (τ_b/2τ)(3 − 4e^(−τ/τ_b) + e^(−2τ/τ_b))]
       (IEEE Std 952): K = σ_b√(2/τ_b) far below τ_b, 0.617 σ_b at its top τ = 1.89 τ_b

Every term has its own random numbers (`sinssim.statistics.random_numbers`), so that switching a term off does not
change the draws of the others.

A block may give rates instead of increments, of which navigation makes increments. Mean rates are increments divided by
the interval, so that navigation obtains the same increments again. Instantaneous rates r_k at the time stamps t_k are
integrated by the trapezoidal rule,

    (3) Δβ_k = ½ (r_{k−1} + r_k) T,

like those of recorded sensors (`sinssim.logs.recorded_streams`). An oscillation of the angular frequency Ω is
integrated with the factor κ = x/tan x of its amplitude, x = ΩT/2; the products that coning and sculling consist of have
the factor κ². A coning motion of the half-angle a, whose rate is ½ a²Ω, therefore causes the drift

    (4) d' = κ² (½ a²Ω + d) − ½ a²Ω

where d is the drift of the algorithm on exact increments; to second order in T it is d − ½ a²Ω (ΩT)²/6.

Every reading is rounded by itself to a multiple of Q/T, where Q is the quantum, because nothing is accumulated. The
error of one rounding is white noise of the density Q/√(12 T).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim.arguments import checked_imu
from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.sensors.imu import emulation_kernel as kernel
from sinssim.sensors.imu.compensation import compensate
from sinssim.sensors.imu.error_term_table import DTHETA_STEP, DVEL_STEP
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu, draw
from sinssim.sensors.imu.size_effect import rectified, what_is_felt
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCSEC

if TYPE_CHECKING:
    from sinssim.sensors.imu.emulation_kernel import Packed


_MOST_JITTER = 0.1  # of the interval


def emulate(ideal: ImuData, spec: Imu | ImuErrors, seed: int = 0, *, rounded: bool = False) -> ImuData:
    """Return the measured increments of an IMU with sensor errors.

    Args:
        ideal: error-free increments.
        spec: the sensor block, from which this run's errors are drawn, or the errors themselves.
        seed: the run's seed. Every axis of every term has its own random numbers, so that the draws of a term do not
            depend on the other terms.
        rounded: whether sensors without pulses, too, have steps, as fine as those of `digital`; a run has them.

    Returns:
        Measured increments at the same times, except for jitter of the time stamps; without any error, the ideal arrays
        themselves.

    Raises:
        InputError: an array has the wrong shape, a sample is not finite, the times are not in order, the sensor set
            has no gyros, an error is invalid, a pulse exceeds the whole signal, or a fault lies outside the
            run.
    """
    from sinssim.sensors.imu.emulation_kernel import pack

    ideal = checked_imu(ideal)
    if isinstance(spec, Imu):
        spec.require_gyros()
    errors = draw(spec, seed) if isinstance(spec, Imu) else spec
    packed = pack([errors], float(ideal.time[0]), rounded=rounded)
    felt = at_the_sensors(ideal, errors)
    stamps = _jittered(ideal.time, errors, seed)
    measured = felt if packed.nothing else _measured(felt, packed, seed)
    return measured if stamps is ideal.time else replace(measured, time=stamps)


def digital(ideal: ImuData) -> ImuData:
    """Return the increments that a block without errors puts out: rounded as in stage 7, to multiples of 2⁻⁵² rad and
    2⁻⁴⁶ m/s, that lose nothing. Sums of any length differ from those of the given increments by at most half a step:
    1.1·10⁻¹⁶ rad and 7·10⁻¹⁵ m/s."""
    from sinssim.sensors.imu.emulation_kernel import pack

    triads = TriadErrors(quantum=DTHETA_STEP), TriadErrors(quantum=DVEL_STEP)
    return _measured(ideal, pack([ImuErrors(*triads)], float(ideal.time[0])), 0)


def _measured(felt: ImuData, packed: Packed, seed: int) -> ImuData:
    """Return the output for increments at the sensors, stages 2 to 8 without jitter."""
    from sinssim.statistics.random_numbers import key

    key_0, key_1 = key(seed)
    dtheta, dvel = (np.ascontiguousarray(rows, dtype=np.float64) for rows in (felt.dtheta, felt.dvel))
    gyro, accel = np.empty_like(dtheta), np.empty_like(dvel)
    flagged = bool(packed.active & (kernel.LIMITED | kernel.FAULTY))
    flags = np.zeros((len(dtheta) if flagged else 0, 6), dtype=np.uint8)
    kernel.measure_all(packed, key_0, key_1, felt.time, dtheta, dvel, gyro, accel, flags)
    return ImuData(felt.time, gyro, accel, flags if flagged else None)


def at_the_sensors(ideal: ImuData, errors: ImuErrors) -> ImuData:
    """Return the ideal increments at the places of the sensors, stage 1, which is the same in every run."""
    _check_faults(errors, ideal.time)
    felt = what_is_felt(ideal, errors)
    _check_pulse("gyro_quantum_arcsec", errors.gyro.quantum, ARCSEC, felt.dtheta)
    _check_pulse("accel_quantum_mm_s", errors.accel.quantum, 1e-3, felt.dvel)
    return felt


def _check_pulse(name: str, quantum: float, unit: float, true: Array) -> None:
    """Refuse a pulse that exceeds the whole signal."""
    signal = float(np.abs(np.cumsum(true, axis=0)).max()) if quantum else 0.0
    if 0.0 < signal < quantum:
        raise InputError(
            f"imu.{name} = {quantum / unit:g} exceeds the signal, which never accumulates beyond "
            f"{signal / unit:.3g} in this run: there would be no pulse. Allowed: 0 to {signal / unit:.3g}."
        )


def _check_faults(errors: ImuErrors, time: Array) -> None:
    for number, fault in enumerate(errors.faults, start=1):
        begins_before_the_end = fault.start <= time[-1] if fault.kind == "spike" else fault.start < time[-1]
        if not (begins_before_the_end and fault.end > time[0]):
            when = f"at {fault.start:g} s" if fault.kind == "spike" else f"from {fault.start:g} s to {fault.end:g} s"
            raise InputError(
                f"imu.faults.{number}: a {fault.kind} {when} lies outside the run, which lasts from {time[0]:g} s to "
                f"{time[-1]:g} s."
            )
        if fault.kind == "jitter" and not fault.amount[0] <= _MOST_JITTER * np.diff(time).min():
            raise InputError(
                f"imu.faults.{number}: time stamps with a 1σ of {fault.amount[0]:g} s would be out of order; at most "
                f"{_MOST_JITTER * np.diff(time).min():g} s, a tenth of the interval, is allowed."
            )


def _jittered(time: Array, errors: ImuErrors, seed: int) -> Array:
    """Return time stamps with jitter, except for the first and the last; the given time stamps if there is no
    jitter."""
    from sinssim.statistics.random_numbers import normals

    if not any(fault.kind == "jitter" for fault in errors.faults):
        return time
    off = np.zeros_like(time)
    for number, fault in enumerate(errors.faults):
        if fault.kind == "jitter":
            inside = (time >= fault.start) & (time <= fault.end)
            off += np.where(inside, fault.amount[0] * normals(seed, "time stamp jitter", number, len(time)), 0.0)
    off[[0, -1]] = 0.0
    half = 0.49 * np.diff(time).min()  # a time stamp never passes its neighbour
    return np.asarray(time + np.clip(off, -half, half))


def perfect_increments(trajectory: Trajectory, ideal: ImuData, imu: Imu) -> ImuData:
    """Return the increments that navigation makes of the output of a block without errors: the ideal ones unless the
    block gives instantaneous rates."""
    if imu.output != "instantaneous-rates":
        return ideal
    return _by_trapezoids(_at_the_stamps(trajectory, ideal))


def measured_increments(
    trajectory: Trajectory,
    ideal: ImuData,
    imu: Imu,
    errors: ImuErrors,
    seed: int,
    calibration: ImuErrors | None,
) -> tuple[ImuData, ImuData | None]:
    """Return the increments that navigation makes of the output of a block with errors, and those after the
    compensation, which acts on the readings; None without calibration values."""
    instantaneous = imu.output == "instantaneous-rates"
    if instantaneous:  # the response of a sensor acts on the values at the stamps
        true = _at_the_stamps(trajectory, ideal)
    else:
        true = rectified(trajectory, ideal, errors)
    if imu.output == "increments":
        read = emulate(true, errors, seed, rounded=True)
    else:
        read = _rounded(emulate(true, _without_pulses(errors), seed, rounded=True), errors)
        if read.time is not true.time:  # jitter: navigation multiplies the rates by the intervals of the stamps
            longer = (np.diff(read.time) / np.diff(true.time))[:, None]
            read = replace(read, dtheta=read.dtheta * longer, dvel=read.dvel * longer)
    left = None if calibration is None else compensate(read, calibration)
    if not instantaneous:
        return read, left
    return _by_trapezoids(read), None if left is None else _by_trapezoids(left)


def of_output(sigma: ImuErrors, imu: Imu) -> ImuErrors:
    """Return the standard deviations of a block's errors with the noise of its output: the same for increments; for
    rates, the rounding is white noise and part of the random walk."""
    if imu.output == "increments":
        return sigma
    root = math.sqrt(imu.rate_hz / 12.0)
    gyro, accel = (
        replace(triad, quantum=0.0, random_walk=math.hypot(triad.random_walk, root * triad.quantum))
        for triad in (sigma.gyro, sigma.accel)
    )
    return replace(sigma, gyro=gyro, accel=accel)


def _at_the_stamps(trajectory: Trajectory, ideal: ImuData) -> ImuData:
    """Return the rates at the edges of the samples, times the interval, as N + 1 samples that end there."""
    time = ideal.time
    interval = float(time[-1] - time[0]) / len(ideal)
    rate, force = trajectory.rates(time)
    return ImuData(np.concatenate([time[:1] - interval, time]), rate * interval, force * interval)


def _by_trapezoids(read: ImuData) -> ImuData:
    """Return the increments of N + 1 readings at the edges of N samples, (3)."""

    def between(rows: Array) -> Array:
        return np.asarray(0.5 * (rows[1:] + rows[:-1]))

    flags = None if read.flags is None else read.flags[1:] | read.flags[:-1]
    return ImuData(read.time[1:], between(read.dtheta), between(read.dvel), flags)


def _without_pulses(errors: ImuErrors) -> ImuErrors:
    gyro, accel = (replace(triad, quantum=0.0) for triad in (errors.gyro, errors.accel))
    return replace(errors, gyro=gyro, accel=accel)


def _rounded(read: ImuData, errors: ImuErrors) -> ImuData:
    """Round each reading by itself."""

    def steps(rows: Array, triad: TriadErrors) -> Array:
        return np.asarray(np.rint(rows / triad.quantum) * triad.quantum) if triad.quantum else rows

    return replace(read, dtheta=steps(read.dtheta, errors.gyro), dvel=steps(read.dvel, errors.accel))
