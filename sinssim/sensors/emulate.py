"""From ideal increments to measured ones: every error of the sensor block, in one pass.

Stages, in this order. T is the interval's length, t its middle since the start, u = Δβ/T the mean rate or specific
force of the interval in the block's axes, f that of the accelerometers; i the sensitive axis, j ≠ i the others. Every
error is 0 unless given; the names in brackets are the fields of `TriadErrors` (SI) and the keys of a scenario's [imu],
"gyro_" or "accel_" before them and their unit behind. What varies from run to run has a second key with "_sigma" before
the unit, from which it is drawn.

  1. where and when: accelerometer i sits at its own place r_i, and the accelerometers sample later than the gyros by δ
     (arms: accel_arms_mm; delay: accel_delay_ms). The same in every run: `sinssim.sensors.elements`
         f_i ← f_i + [ω̇ × r_i + ω × (ω × r_i)]_i,     f(t) ← f(t − δ)
  2. sensitive axis (misalignment: _misalignment_arcsec)
         x_i = u_i + Σ_j M_ij u_j
  3. response (asymmetry: _asymmetry_ppm; quadratic: gyro_quadratic_ppm_per_deg_s, accel_quadratic_ug_per_g2; cubic:
     gyro_cubic_ppm_per_deg2_s2, accel_cubic_ug_per_g3; cross_axis: accel_cross_axis_ug_per_g2)
         n_i = x_i + ½κ|x_i| + K₂x_i² + K₃x_i³ + Σ_j C_ij x_i u_j
     κ is the scale factor of positive inputs less that of negative ones, relative; C the cross-coupling of pendulous
     accelerometers (K_ip, K_io of IEEE Std 1293), which rectifies vibration (vibro-pendulous error)
  4. equation (2), with what drifts (scale: _scale_ppm; scale_temperature: _scale_temperature_ppm_per_c; bias:
     gyro_bias_deg_h, accel_bias_ug; g_sensitivity: gyro_g_sensitivity_deg_h_per_g; bias_temperature:
     gyro_bias_temperature_deg_h_per_c, accel_bias_temperature_ug_per_c; ramp: gyro_ramp_deg_h_per_h,
     accel_ramp_ug_per_h)
         y_i = (1 + k_i + k′_i Θ) n_i + ω₀_i + Σ_m G_im f_m + β_i Θ + R_i t + b_i + w_i + c_i
     Θ(t) = Θ_∞ + (Θ₀ − Θ_∞) exp(−t/τ_Θ) is the temperature over that of the calibration (temperature_start_c,
     temperature_steady_c, warm_up_time_s)
       b: bias instability, stationary first-order Gauss-Markov of 1σ σ_b and correlation time τ_b (instability,
          correlation_time: gyro_instability_deg_h, accel_instability_ug, _correlation_time_s)
       w: rate random walk K, 0 at the start (rate_walk: gyro_rrw_deg_h_sqrt_h, accel_rrw_ug_sqrt_h)
       c: flicker, the bias instability B of IEEE Std 952 (flicker: gyro_flicker_deg_h, accel_flicker_ug)
  5. noise and faults (random_walk N: gyro_arw_deg_sqrt_h, accel_vrw_ug_sqrt_hz)
         Δβ̃_i = y_i T + N√T ν_i + bias steps and spikes of [[imu.faults]]
  6. saturation (limit: gyro_range_deg_s, accel_range_g): Δβ̃_i is cut to ±limit·T, and flagged
  7. quantisation of the accumulated sum (quantum Q: gyro_quantum_arcsec, accel_quantum_mm_s)
         Δβ̃_i ← differences of round(Σ Δβ̃_i / Q) Q
  8. what the link does: dropouts (reads 0, the increments are lost) and frozen outputs, flagged; jitter of time stamps

Other units of the same quantity may stand in a key (gyro_misalignment_mrad, accel_vrw_mps_sqrt_h, gyro_bias_deg_s):
`sinssim.scenario.datasheet` has the table. Stages 2 to 4 act on the mean of an interval: what they rectify of motion
faster than the samples is not in it.

Allan deviations over τ, sampled with T, of each noise alone:
    Q  quantisation: √3 Q_z/τ with Q_z = Q/√12                        N  N/√τ
    K  K√(τ/3), exactly at every τ = T, 2T, …                         R  Rτ/√2
    B  √(2 ln 2/π) B = 0.664 B, flat to 0.2 % from τ = T to 3·10⁶ T: a sum of ten first-order processes with time
       constants from T to 4·10⁶ T, driven by one white noise
    b  Gauss-Markov, exactly at every τ = T, 2T, …: σ²(τ) = σ_b² (2τ_b/τ) [1 − (τ_b/2τ)(3 − 4e^(−τ/τ_b) + e^(−2τ/τ_b))]
       (IEEE Std 952): K = σ_b√(2/τ_b) far below τ_b, 0.617 σ_b at its top τ = 1.89 τ_b

Every term has its own random numbers (`sinssim.sensors.random_numbers`), so that switching one off leaves the draws of
all the others as they were.
"""

from __future__ import annotations

import numpy as np

from sinssim.checks import checked_increments
from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.scenario.imu import ImuSection
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors, draw, term_generator


def emulate(ideal: ImuData, spec: ImuSection | ImuErrors, seed: int = 0) -> ImuData:
    """Return what a sensor block with errors gives in place of the ideal increments.

    Args:
        ideal: error-free increments.
        spec: the [imu] section of a scenario, from which this run's errors are drawn, or the errors themselves.
        seed: the run's seed. Every axis of every term has a generator of its own, so that the draws of one term
            do not depend on which others are switched on.

    Returns:
        Measured increments on the same times; where nothing is wrong, the ideal arrays themselves.

    Raises:
        InputError: an array has the wrong shape, a sample is not finite, the times are not in order, or the section
            is of a set of sensors without gyros.
    """
    checked_increments(ideal)
    if isinstance(spec, ImuSection) and spec.sensor_set.type != "gyros":
        raise InputError(
            f'a block of three gyros and three accelerometers is emulated; sensor_set.type = "{spec.sensor_set.type}" '
            "is another one."
        )
    errors = draw(spec, seed) if isinstance(spec, ImuSection) else spec
    interval = np.diff(ideal.time)
    return ImuData(
        ideal.time,
        _measure(ideal.dtheta, interval, errors.gyro, "gyro", seed),
        _measure(ideal.dvel, interval, errors.accel, "accel", seed),
    )


def _measure(ideal: Array, interval: Array, errors: TriadErrors, triad: str, seed: int) -> Array:
    if not (
        np.any(errors.bias)
        or np.any(errors.scale)
        or np.any(errors.misalignment)
        or np.any(errors.quadratic)
        or np.any(errors.cubic)
        or errors.random_walk
        or errors.quantum
        or errors.instability
    ):
        return ideal
    measured = np.empty_like(ideal)
    for i in range(3):
        # The whole axis at once in one contiguous column; no matrix product, whose rounding depends on the machine.
        axis = ideal[:, i].copy()
        for j in range(3):
            if errors.misalignment[i, j]:
                axis += errors.misalignment[i, j] * ideal[:, j]
        if errors.quadratic[i] or errors.cubic[i]:
            mean = axis / interval
            axis += mean * (errors.quadratic[i] + errors.cubic[i] * mean) * axis
        axis *= 1.0 + errors.scale[i]
        axis += errors.bias[i] * interval  # (2)
        if errors.instability:
            axis += _instability(interval, errors, term_generator(seed, f"{triad} instability", i))
        if errors.random_walk:
            white = term_generator(seed, f"{triad} random walk", i).standard_normal(len(interval))
            axis += errors.random_walk * np.sqrt(interval) * white
        if errors.quantum:
            # Whole pulses of the accumulated sum: the remainder stays in the counter, so nothing is lost.
            axis = np.diff(np.rint(np.cumsum(axis) / errors.quantum), prepend=0.0) * errors.quantum
        measured[:, i] = axis
    return measured


def _instability(interval: Array, errors: TriadErrors, generator: np.random.Generator) -> Array:
    """Return the integral of a stationary first-order Gauss-Markov bias over each interval, (N,)."""
    from sinssim.sensors.gauss_markov import gauss_markov

    bias = gauss_markov(
        interval,
        errors.correlation_time,
        errors.instability * generator.standard_normal(len(interval) + 1),
    )
    # Trapezoid: the expected integral between two known values of the process, to (T/τ)²/12 of itself.
    return 0.5 * (bias[:-1] + bias[1:]) * interval
