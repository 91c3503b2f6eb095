"""Integrates the lock-in equation of a dithered laser gyro, which gives the error by the coupling of the beams.

The dither moves from turning point to turning point along half a cosine, θ_d = θ_k + ½(θ_{k+1} − θ_k)(1 − cos 2πft), so
that its angle is known exactly. Without this known phase, equation (1) of `laser_gyro` becomes an equation of the error
ε,

    ψ = ψ₀ + K(Ωt + θ_d(t) − θ_d(0)) + ε,    ε̇ = −K Ω_L sin ψ

which the classical fourth-order Runge-Kutta method integrates in steps that are short compared with a fringe.
"""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import POSITIVE, check_kind, number, numbers
from sinssim.data import Array
from sinssim.errors import InputError, check_name
from sinssim.jit import kernel
from sinssim.sensors.imu.laser_gyro import LaserGyro

Randomised = Literal["both", "one", "none"]
"""Which turning points are random: those on both sides, those on one side, or none."""

_MOST_SWINGS = 10**8
"""Maximum number of turning points: an array of them takes 0.8 GB, and a dither of 400 Hz takes 35 hours for them."""

_MOST_STEPS = 1e9
"""Maximum number of steps, for which the kernel takes about two minutes."""


@kernel
def _follow(
    scale: float, lock_in: float, rate: float, turnarounds: Array, swing: float, steps: int, phase: float, error: Array
) -> None:
    """Write the phase error at the middle of every swing; `steps` is even."""
    coupling = scale * lock_in
    h = swing / steps
    drift = scale * rate
    c, s = math.cos(0.5 * math.pi / steps), math.sin(0.5 * math.pi / steps)  # half a step of the dither
    psi, total = phase, 0.0
    for k in range(len(turnarounds) - 1):
        half = 0.5 * scale * (turnarounds[k + 1] - turnarounds[k])
        e, co, si = 0.0, 1.0, 0.0
        k1 = -coupling * math.sin(psi)
        for i in range(steps):
            if i == steps // 2:
                error[k] = total + e
            co, si = co * c - si * s, si * c + co * s
            middle = psi + drift * (i + 0.5) * h + half * (1.0 - co)
            co, si = co * c - si * s, si * c + co * s
            end = psi + drift * (i + 1.0) * h + half * (1.0 - co)
            k2 = -coupling * math.sin(middle + e + 0.5 * h * k1)
            k3 = -coupling * math.sin(middle + e + 0.5 * h * k2)
            k4 = -coupling * math.sin(end + e + h * k3)
            e += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            k1 = -coupling * math.sin(end + e)
        total += e
        psi += drift * swing + 2.0 * half + e
        psi -= 2.0 * math.pi * math.floor(psi / (2.0 * math.pi))


def turnarounds(
    gyro: LaserGyro,
    swings: int,
    rng: np.random.Generator,
    randomised: Randomised = "both",
    spread: float = 1.0,
) -> Array:
    """Return the dither angles at successive turning points, on alternate sides: angles, (swings + 1,) rad.

    Args:
        swings: number of swings from one side to the other; a dither period has two.
        rng: generator of the random part, one independent normal number for each turning point.
        randomised: which turning points have a random part.
        spread: standard deviation of the random part, in pulses; from about one pulse on, the phase of a turning point
            is practically uniform.
    """
    check_kind("gyro", gyro, LaserGyro)
    check_kind("rng", rng, np.random.Generator, "a numpy.random.Generator, for example numpy.random.default_rng(seed)")
    check_name("randomised", randomised, get_args(Randomised))
    if number("swings", swings, low=1.0, high=_MOST_SWINGS) % 1.0:
        raise InputError(f"swings = {swings!r} must be a whole number.")
    swings, spread = int(swings), number("spread", spread, "pulses", low=0.0)
    noise = spread * gyro.pulse_weight * rng.standard_normal(swings + 1)
    if randomised != "both":
        noise[1::2] = 0.0
    if randomised == "none":
        noise[:] = 0.0
    side = np.where(np.arange(swings + 1) % 2, 1.0, -1.0)
    return np.asarray(side * gyro.dither_amplitude + noise)


def angle_error(gyro: LaserGyro, rate: float, angles: ArrayLike, phase: float = 0.0, step: float = 1.0) -> Array:
    """Integrate the lock-in equation and return the angle error by the coupling of the beams.

    Args:
        gyro: the gyro.
        rate: Ω, constant, rad/s.
        angles: dither angles at the turning points, (M + 1,) rad; zeros for no dither.
        phase: ψ at the start, rad.
        step: longest step, in radians of the phase; the error of the method falls with its fourth power.

    Returns:
        Angle from the pulses minus the true rotation and the dither, at the middle of every half period of the dither,
        (M,) rad.
    """
    check_kind("gyro", gyro, LaserGyro)
    rate, phase = number("rate", rate, "rad/s"), number("phase", phase, "rad")
    step, at = number("step", step, "rad of phase", low=POSITIVE), numbers("angles", angles)
    if at.ndim != 1 or len(at) < 2 or not np.isfinite(at).all():
        raise InputError(
            f"angles of shape {at.shape} must be finite numbers, (M + 1,) rad, of at least two turning points."
        )
    swing = 0.5 / gyro.dither_frequency
    fastest = 0.5 * math.pi * float(np.abs(np.diff(at)).max()) / swing + abs(rate) + gyro.lock_in
    half_steps = gyro.scale * fastest * swing / 2.0 / step
    if not half_steps * 2.0 * (len(at) - 1) <= _MOST_STEPS:
        raise InputError(
            f"lock-in: a beat of up to {gyro.scale * fastest:.3g} rad/s in steps of {step:g} rad needs more than "
            f"{_MOST_STEPS:g} steps over {len(at) - 1} swings; use a lower rate, a longer step or fewer turning points."
        )
    steps = 2 * math.ceil(half_steps)
    error = np.empty(len(at) - 1)
    _follow(gyro.scale, gyro.lock_in, rate, at, swing, steps, phase, error)
    return error / gyro.scale
