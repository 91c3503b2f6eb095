"""Sensors of the whole attitude: a reference in the local level, and a star tracker."""

from __future__ import annotations

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.scenario.aiding import AttitudeSection, StarTrackerSection
from sinssim.sensors.aiding.noise import correlated, turn_on, white
from sinssim.sensors.aiding.readings import Sensed, epochs, sensed
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCMIN, ARCSEC


def attitude_reference(trajectory: Trajectory, section: AttitudeSection, seed: int = 0) -> Sensed:
    """Return what an attitude reference gives: q_nb ∘ q(ε), ε noise and drift about the block's axes.

    Args:
        trajectory: the true motion of the sensor block.
        section: the reference.
        seed: the run's seed.

    Returns:
        Unit quaternions q_nb; the 1σ is that about each axis of the block.

    Raises:
        InputError: the motion is over before the first reading, or the seed cannot be used.
    """
    s = section
    time = epochs(trajectory, s, "attitude")
    slow = (ARCMIN * s.bias_sigma_arcmin,) * 3
    bias = correlated(seed, "attitude drift", slow, time, s.bias_correlation_time_s)
    sigma = ARCMIN * np.array(s.sigma_arcmin)
    value = _turned(trajectory.state(time), bias + white(seed, "attitude noise", sigma, len(time)))
    return sensed("attitude", "attitude", s, time, value, sigma, {"attitude bias": bias})


def star_tracker(trajectory: Trajectory, section: StarTrackerSection, seed: int = 0) -> Sensed:
    """Return what a star tracker gives: the attitude among the stars, turned by the time to Earth-fixed axes.

    It knows nothing of the local level: what it says of tilts is as good as the position that they are told from.

    Args:
        trajectory: the true motion of the sensor block.
        section: the tracker.
        seed: the run's seed.

    Returns:
        Unit quaternions q_eb; the 1σ is that about each axis of the block.

    Raises:
        InputError: the motion is over before the first reading, or the seed cannot be used.
    """
    s = section
    time = epochs(trajectory, s, "star_tracker")
    bias = np.array([turn_on(seed, "star tracker mounting", None, ARCSEC * s.bias_sigma_arcsec, i) for i in range(3)])
    sigma = ARCSEC * np.array(s.sigma_arcsec)
    state = trajectory.state(time)
    q_nb = _turned(state, bias + white(seed, "star tracker noise", sigma, len(time)))
    value = rotation.multiply(earth.q_en(state.latitude, state.longitude), q_nb)
    return sensed("star-tracker", "earth-attitude", s, time, value, sigma, {"star-tracker bias": bias})


def _turned(state: NavState, error: Array) -> Array:
    """Return attitudes turned by small rotation vectors about the block's axes."""
    return rotation.multiply(state.q_nb, rotation.quaternion_from_rotation_vector(error))
