"""Heading through full turns: integrated, and from ratios of direction cosines by arctangents.

The chapter prefers integrated Euler angles in turns because arctangents have limits. Here the attitude alone is
computed from the same samples, with the true rate of the navigation frame, in two ways: Euler angles, whose heading is
a variable that counts turns; and the direction cosine matrix of a quaternion, whose heading is taken from the ratio
C₂₁/C₁₁ by the arctangent of one argument, by that of two, and by the latter unwrapped from sample to sample.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array, ImuData
from sinssim.earth.coordinates import radii
from sinssim.experiments.studies.results import Heading
from sinssim.jit import bind, inline
from sinssim.strapdown.assemble import parts
from sinssim.strapdown.attitude.quaternion import dcm_k, start_k, step_k
from sinssim.strapdown.increments.fit import is_uniform, weight_table
from sinssim.strapdown.increments.interval import fitted_turn_k as turn_k
from sinssim.strapdown.increments.interval import frame_turn_k
from sinssim.units import ARCSEC, DEG

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory

FORMS = ("integrated", "arctangent of one argument", "arctangent of two arguments", "arctangent of two, unwrapped")
"""The ways to the heading."""
STEEPEST = 85.0 * DEG
"""Pitch above which heading is not compared, rad: at ±90° it is not defined."""

_JUMP = 0.5 * np.pi  # change of the difference from the truth from one row to the next that counts as a jump
_WRONG = 0.3 / 60.0 * DEG
_KEPT = 2000


@inline
def _ratio_k(attitude: Any) -> tuple[float, float]:
    """C₂₁ and C₁₁, whose ratio is the tangent of the heading."""
    c = dcm_k(attitude)
    return c[3], c[0]


@inline
def _variable_k(attitude: Any) -> tuple[float, float]:
    """The heading, the third variable of the Euler angles."""
    return attitude[2], 0.0


read_k = _ratio_k


# A compiled loop over samples: the attitude alone, and what its heading is read from.
def _follow(
    dtheta: Array, dvel: Array, weights: Array, uniform: bool, start: Array, u0: Array, um: Array, u1: Array, out: Array
) -> None:
    attitude = start_k(start[0], start[1], start[2], start[3])
    out[0, 0], out[0, 1] = read_k(attitude)
    for k in range(dtheta.shape[0]):
        frame = frame_turn_k(
            (u0[k, 0], u0[k, 1], u0[k, 2]), (um[k, 0], um[k, 1], um[k, 2]), (u1[k, 0], u1[k, 1], u1[k, 2])
        )
        attitude = step_k(attitude, turn_k(dtheta, dvel, weights, uniform, k), frame)
        out[k + 1, 0], out[k + 1, 1] = read_k(attitude)


@cache
def _loop(algorithm: str) -> Callable[..., None]:
    own = parts(algorithm)
    read = _variable_k if algorithm == "euler" else _ratio_k
    return bind(_follow, f"heading_of_{algorithm}", **{**own, "read_k": read})


def headings(trajectory: Trajectory, imu: ImuData, truth: Array) -> dict[str, Array]:
    """Return the heading in each form by its name, (N+1,) rad each: integrated and unwrapped ones count turns.

    The trajectory gives the start and the rate of the navigation frame; the true headings at the edges, (N+1,) rad, the
    turn that the integration starts in.
    """
    weights, uniform = weight_table(imu.time, is_uniform(imu.time)), is_uniform(imu.time)
    edges, middle = imu.time, 0.5 * (imu.time[1:] + imu.time[:-1])
    at_edges, step = _frame_rate(trajectory, edges), np.diff(edges)[:, None]
    turns = (step * at_edges[:-1], step * _frame_rate(trajectory, middle), step * at_edges[1:])
    start = np.ascontiguousarray(trajectory.state(edges[0]).q_nb)
    found = {}
    for algorithm in ("euler", "quaternion"):
        out = np.empty((len(edges), 2))
        _loop(algorithm)(imu.dtheta, imu.dvel, weights, uniform, start, *turns, out)
        found[algorithm] = out
    c21, c11 = found["quaternion"].T
    integrated = found["euler"][:, 0]
    with np.errstate(divide="ignore"):
        one = np.arctan(c21 / c11)
    two = np.arctan2(c21, c11)
    unwrapped = np.unwrap(two)
    first = 2.0 * np.pi * np.round((truth[0] - np.array([integrated[0], unwrapped[0]])) / (2.0 * np.pi))
    return dict(zip(FORMS, (integrated + first[0], one, two, unwrapped + first[1]), strict=True))


def _frame_rate(trajectory: Trajectory, time: Array) -> Array:
    """Return ω_in of the local level in its own axes, (N, 3) rad/s."""
    state, ellipsoid = trajectory.state(time), trajectory.ellipsoid
    north, east = radii(state.latitude, ellipsoid)
    sine, cosine = np.sin(state.latitude), np.cos(state.latitude)
    v_north, v_east = state.velocity_ned[:, 0], state.velocity_ned[:, 1]
    about_north = v_east / (east + state.height)
    w = ellipsoid.omega
    return np.stack(
        [w * cosine + about_north, -v_north / (north + state.height), -w * sine - about_north * sine / cosine], axis=1
    )


def compare_headings(
    part: str, motion: str, trajectory: Trajectory, ideal: ImuData, ratios: dict[float, int]
) -> list[Heading]:
    """Compare the heading in each form with the true heading, which counts turns.

    `ratios` are numbers of the `ideal` samples per sample, by rate, Hz; in an ideal sample the true heading changes by
    less than half a turn. A motion that comes near to pitch ±90° has no results.
    """
    _, pitch, heading = rotation.euler_from_quaternion(trajectory.state(ideal.time).q_nb)
    if np.abs(pitch).max() > STEEPEST:
        return []
    truth = np.unwrap(heading)
    found = []
    for rate, ratio in ratios.items():
        count = len(ideal) // ratio
        rows = slice(0, count * ratio + 1, ratio)
        imu = ImuData(
            ideal.time[rows].copy(),
            *(x[: count * ratio].reshape(count, ratio, 3).sum(axis=1) for x in (ideal.dtheta, ideal.dvel)),
        )
        true = truth[rows]
        for form, own in headings(trajectory, imu, true).items():
            apart = own - true
            error = np.mod(apart + np.pi, 2.0 * np.pi) - np.pi  # a heading of 370° is one of 10°
            shown = np.unique(np.linspace(0, count, min(count + 1, _KEPT)).round().astype(np.intp))
            found.append(
                Heading(
                    part, motion, form, rate,
                    turns=float(true[-1] - true[0]) / (2.0 * np.pi),
                    max_error_arcsec=float(np.abs(error).max()) / ARCSEC,
                    final_error_arcsec=float(error[-1]) / ARCSEC,
                    jumps=int(np.count_nonzero(np.abs(np.diff(apart)) > _JUMP)),
                    wrong=float(np.mean(np.abs(error) > _WRONG)),
                    least_hz=_least_rate(true, rate) if form == FORMS[-1] else 0.0,
                    time=imu.time[shown], heading=own[shown], truth=true[shown],
                )
            )  # fmt: skip
    return found


def _least_rate(truth: Array, rate_hz: float) -> float:
    """Return the lowest rate of reading at which unwrapping counts the turns, Hz: a half of the fastest turn's."""
    slow = rate_hz
    for every in dict.fromkeys(np.geomspace(1.0, len(truth) - 1.0, 400).astype(int).tolist()):
        read = truth[::every]
        if np.abs(np.unwrap(np.mod(read, 2.0 * np.pi)) - read - (np.mod(read[0], 2.0 * np.pi) - read[0])).max() > _JUMP:
            break
        slow = rate_hz / every
        if len(read) < 3:
            break
    return slow
