"""Claims about attitude algorithms.

Drift under coning, headings through full turns, passages through pitch ±90°, norm and orthogonality.

Heading: the chapter prefers integrated Euler angles in turns because arctangents have limits. The attitude alone is
computed from the same samples, with the true rate of the navigation frame, in two ways: Euler angles, whose heading
is a variable that counts turns; and the direction cosine matrix of a quaternion, whose heading is taken from C₂₁/C₁₁
by the arctangent of one argument, by that of two, and by the latter unwrapped from sample to sample.

Norm: a step by φ = ‖Δθ‖ multiplies a quaternion of norm 1 by the truncated series T_p(iφ/2) of the exponential
function, and the eigenvalues of a direction cosine matrix by T_p(iφ), where p is the order of the step. To the
leading term,

    norm of a quaternion    φ²/8    φ⁴/128   −φ⁴/384   −φ⁶/9216     p = 1…4
    BBᵀ − I of a matrix     φ²      φ⁴/4     −φ⁴/12    −φ⁶/72

for each step. The number of steps grows as 1/h: the defect after a given time is of the order h¹, h³, h³, h⁵.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array, ImuData
from sinssim.earth.geodetic_coordinates import radii
from sinssim.experiments.studies.study_results import (
    EULER,
    FEW_TENTHS_ARCSEC,
    Evidence,
    Heading,
    Outcome,
    Point,
    Row,
    by,
    of_motion,
    overall,
    undecided,
)
from sinssim.jit import bind, inline
from sinssim.strapdown.attitude import REGISTRY, family
from sinssim.strapdown.attitude.quaternion import dcm_k, start_k, step_k
from sinssim.strapdown.attitude.rotation_vector import drift_under_coning, leading_drift_under_coning
from sinssim.strapdown.coning_sculling import fitted_turn_k as turn_k
from sinssim.strapdown.coning_sculling import frame_turn_k, is_uniform, weight_table
from sinssim.strapdown.engine_assembly import parts
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCSEC, DEG, number_text

LAW_HOLDS = 0.03
"""Relative error up to which a law holds."""

_SAMPLES = {"1": 1, "1p": 1, "2": 2, "3": 3, "4": 4}
_LEAST_DRIFT = 1e-5 * ARCSEC  # total drift; a smaller one contains rounding


def coning_drift(evidence: Evidence) -> Outcome:
    """Compare the drift after whole turns of a cone with the law and with the exact theory."""
    numbers: dict[str, float] = {}
    points = []
    lawful: list[tuple[str, float]] = []
    farthest = 0.0
    for motion, rows in by(evidence.rows, of_motion).items():
        cone = evidence.facts[motion].cone
        for algorithm, at_rates in by(rows, lambda row: row.algorithm).items():
            name = algorithm.removeprefix("rotation-vector-")
            if cone is None or name not in _SAMPLES:
                continue
            words, apart = [], 0.0
            for row in sorted(at_rates, key=lambda row: -row.rate_hz):
                case = (_SAMPLES[name], *cone, 1.0 / row.rate_hz, name == "1p")
                law, exact = leading_drift_under_coning(*case), abs(drift_under_coning(*case))
                if exact * row.duration_s < _LEAST_DRIFT:
                    continue
                measured = row.final_attitude_error_arcsec * ARCSEC / row.duration_s
                x = cone[1] / row.rate_hz
                numbers[f"{motion}, {name}, Ωh = {x:.3f}: measured/law"] = measured / law
                numbers[f"{motion}, {name}, Ωh = {x:.3f}: measured/exact"] = measured / exact
                apart = max(apart, abs(measured / exact - 1.0))
                holds = abs(exact / law - 1.0) < LAW_HOLDS
                if holds:
                    lawful.append((name, measured / law))
                words.append(f"{measured / law:.3f}{'' if holds else f' [{exact / law:.3f}]'} at {x:.3f}")
            farthest = max(farthest, apart)
            if words:
                text = f"{motion}, n = {'1 and the one before' if name == '1p' else name}: {', '.join(words)}"
                points.append(Point(text, "confirmed" if apart < LAW_HOLDS else "refuted"))
    if {name for name, _ in lawful} != set(_SAMPLES):
        return undecided("for each number of samples a cone and a rate at which the law holds")
    worst = max((ratio for _, ratio in lawful), key=lambda ratio: abs(ratio - 1.0))
    good = abs(worst - 1.0) < LAW_HOLDS and farthest < LAW_HOLDS
    reason = (
        f"The law is the leading term. Where it is within {100.0 * LAW_HOLDS:g} % of the exact drift, measured drifts "
        f"are {worst:.3f} of it in the worst case; elsewhere (exact ratio in brackets) the next term or the floor of "
        f"triple products dominates. They differ from the exact drift by at most {100.0 * farthest:.2g} %. Measured "
        "drift over the law, at Ωh:"
    )
    shown, expected = f"{worst:.3f} of the law", f"1 ± {LAW_HOLDS:g}"
    return Outcome("confirmed" if good else "refuted", reason, tuple(points), numbers, shown, expected)


def euler_heading(evidence: Evidence) -> Outcome:
    """Decide on the heading through full turns: integrated, and from ratios of direction cosines by arctangents.

    The verdict is that of the integrated heading, at the highest rate of each motion: it must be right and must not
    jump. The other forms are judged modulo 360°, beside it: a heading of 10° is that of 370°.
    """
    turned = [heading for heading in evidence.headings if abs(heading.turns) > 1.0]
    if not turned:
        return undecided("a motion that turns through more than 360° of heading with a pitch below 85°")
    numbers: dict[str, float] = {}
    points, integrated, errors = [], [], []
    for motion in dict.fromkeys(heading.motion for heading in turned):
        here = [heading for heading in turned if heading.motion == motion]
        highest = max(heading.rate_hz for heading in here)
        for heading in (h for h in here if h.rate_hz == highest):
            right = heading.max_error_arcsec <= FEW_TENTHS_ARCSEC
            if heading.form == "integrated":
                right = right and not heading.jumps
                integrated.append("confirmed" if right else "refuted")
                errors.append(heading.max_error_arcsec)
            name = f"{motion}, {heading.form}"
            numbers[f"{name}: jumps"] = float(heading.jumps)
            numbers[f"{name}: largest error, arcsec"] = heading.max_error_arcsec
            numbers[f"{name}: wrong, part of the time"] = heading.wrong
            verdict = "confirmed" if right else "refuted"
            points.append(Point(f"{motion}, {heading.form} at {highest:g} Hz: {_heading_error_text(heading)}", verdict))
    verdict = integrated[0] if len(set(integrated)) == 1 else "partly"
    most = max(turned, key=lambda heading: abs(heading.turns))
    reason = (
        f"Through up to {abs(most.turns):.1f} turns of heading, errors modulo 360°. Integrated angles count turns by "
        "themselves. The arctangent of one argument has limits: it is wrong by 180° in half of all headings. That of "
        "two arguments is right in every quadrant and only restarts at ±180°; unwrapped, it counts turns, too, but "
        "must be evaluated at least every half turn. So the advantage is one over the arctangent of one argument. A "
        "form is confirmed if it stays within 0.3′, the integrated one also without a jump:"
    )
    measured = f"{number_text(max(errors), 2)}″ in {abs(most.turns):.0f} turns"
    return Outcome(verdict, reason, tuple(points), numbers, measured, "at most 18″ (0.3′), no jump")


def _heading_error_text(heading: Heading) -> str:
    if heading.max_error_arcsec < 3600.0:
        text = f"off by at most {number_text(heading.max_error_arcsec, 2)}″"
    else:
        text = (
            f"off by up to {number_text(heading.max_error_arcsec / 3600.0)}°, wrong for {100.0 * heading.wrong:.0f} % "
            "of the time"
        )
    text += f", {heading.jumps or 'no'} jumps"
    if heading.least_hz:
        text += f", read at least at {number_text(heading.least_hz, 2)} Hz"
    return text


def euler_limit(evidence: Evidence) -> Outcome:
    """Decide on the errors of Euler angles and of quaternions at ±90° of pitch."""
    rows = evidence.rows
    passed = [row for row in rows if row.algorithm == EULER and row.passages]
    if not passed:
        return undecided("Euler angles on a motion that passes ±90° of pitch")
    worst, best = max(passed, key=lambda r: r.max_damage_arcsec), min(passed, key=lambda r: r.max_damage_arcsec)
    numbers = {"greatest damage, arcsec": worst.max_damage_arcsec, "least damage, arcsec": best.max_damage_arcsec}
    text = (
        f"Passing it on {worst.motion} causes an attitude error of {worst.max_damage_arcsec / 60.0:.3g}′ at "
        f"{worst.pace} Hz" + (f", {best.max_damage_arcsec / 60.0:.3g}′ at {best.pace} Hz" if best is not worst else "")
    )
    other = [r for r in rows if r.algorithm == "quaternion" and (r.motion, r.pace) == (worst.motion, worst.pace)]
    if other:
        numbers["quaternion, arcsec"] = other[0].max_attitude_error_arcsec
        text += (
            f"; the error of the quaternion is at most {other[0].max_attitude_error_arcsec:.2g}″ on the whole motion"
        )
    points = [
        Point(f"{motion} at {row.pace} Hz: {number_text(row.max_damage_arcsec)}″", _of_damage(row))
        for motion, passages in by(passed, of_motion).items()
        for row in passages
    ]
    text += ". It is a limit where a passage costs more than 0.3′. Damage by the worst passage:"
    measured = f"{number_text(worst.max_damage_arcsec)}″ by a passage at {worst.pace} Hz"
    return Outcome(_of_damage(worst), text, tuple(points), numbers, measured, "at most 18″ (0.3′)")


def _of_damage(row: Row) -> str:
    """A passage with an error of a few tenths of an arcminute at most is no limit."""
    return "refuted" if row.max_damage_arcsec > FEW_TENTHS_ARCSEC else "confirmed"


KEPT = 1e-9
"""Deviation from 1 up to which a norm counts as preserved."""


def orthogonality(evidence: Evidence) -> Outcome:
    """Decide on the norm that the two quaternions lose."""
    rows = evidence.rows
    two = [row for row in rows if row.algorithm == "two-quaternions"]
    if not two:
        return undecided("the algorithm two-quaternions")
    worst, best = max(two, key=lambda r: r.max_defect), min(two, key=lambda r: r.max_defect)
    numbers = {"greatest defect": worst.max_defect, "least defect": best.max_defect}
    text = (
        "A matrix made of quaternions has orthogonal axes by construction, but their length is the squared "
        f"norm, which each step multiplies by 1 + e⁴/64: the norm is in error by {worst.max_defect:.2g} on "
        f"{worst.motion} at {worst.pace} Hz"
    )
    matrices = [
        r for r in rows if r.algorithm == "poisson-2" and r.motion == worst.motion and r.rate_hz == worst.rate_hz
    ]
    if matrices:
        numbers["direction cosines of second order"] = matrices[0].max_defect
        text += f", where Poisson's equation of second order loses {matrices[0].max_defect:.2g} of orthogonality"
    text += "."
    points = []
    for motion, at_motion in by(two, of_motion).items():
        ends = [max(at_motion, key=lambda r: r.max_defect), min(at_motion, key=lambda r: r.max_defect)]
        shown = " to ".join(f"{r.max_defect:.2g} at {r.pace} Hz" for r in dict.fromkeys(ends))
        preserved = [row.max_defect < KEPT for row in at_motion]
        verdict = "confirmed" if all(preserved) else "partly"
        points.append(Point(f"{motion}: norm in error by {shown}", verdict))
    if worst.max_defect >= KEPT:
        ppm = 2.0 * worst.max_defect * 1e6
        numbers["scale error of the forces, ppm"] = ppm
        text += f" At worst the resolved forces are {ppm:.2g} ppm too large: normalise."
    text += f" Kept means to {KEPT:g}:"
    measured = f"norm in error by up to {worst.max_defect:.2g}"
    return Outcome(overall(points), text, tuple(points), numbers, measured, f"at most {KEPT:g}")


EXACTLY = "exactly"
ROUNDING = "to rounding"
ORDER = "to an order"
OPEN = "to the fit of its polynomials"

_POWER = {1: 1, 2: 3, 3: 3, 4: 5}
_NORM_STEP = {1: "φ²/8", 2: "φ⁴/128", 3: "−φ⁴/384", 4: "−φ⁶/9216"}
_MATRIX_STEP = {1: "φ²", 2: "φ⁴/4", 3: "−φ⁴/12", 4: "−φ⁶/72"}


@dataclass(frozen=True)
class Guarantee:
    """What an attitude algorithm guarantees: how well its own variables keep a condition, norm or orthogonality.

    The order is the power of the interval with which the defect after a given time shrinks.
    """

    condition: str
    kept: str
    reason: str
    order: int | None = None

    @property
    def words(self) -> str:
        """How well the condition is kept, for example "to h³"."""
        return f"to {'h' + '⁰¹²³⁴⁵⁶⁷⁸⁹'[self.order]}" if self.order is not None else self.kept


def guarantee(algorithm: str) -> Guarantee:
    """Return what an algorithm guarantees of the norm or orthogonality of its variables."""
    kind, variant = family(algorithm), REGISTRY[algorithm].variant
    power = int(variant.get("ORDER", 0))
    if kind == "euler":
        return Guarantee("none", EXACTLY, "B is orthogonal by construction")
    if variant.get("ORTHONORMAL"):
        return Guarantee("orthogonality", ROUNDING, "orthogonalised after each step")
    if variant.get("NORMALIZED"):
        return Guarantee("norm", ROUNDING, "normalised after each step")
    if kind == "poisson":
        power = power or 4
        return Guarantee("orthogonality", ORDER, f"a step adds {_MATRIX_STEP[power]}", _POWER[power])
    if kind == "two-quaternions":
        return Guarantee("norm", ORDER, f"a step adds {_NORM_STEP[2]}", _POWER[2])
    if kind == "quaternion" and power:
        return Guarantee("norm", ORDER, f"a step adds {_NORM_STEP[power]}", _POWER[power])
    if kind in ("quaternion", "rotation-vector"):
        return Guarantee("norm", ROUNDING, "steps are unit quaternions")
    return Guarantee("norm", OPEN, "polynomials, not normalised")


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
    functions = parts(algorithm)
    read = _variable_k if algorithm == "euler" else _ratio_k
    return bind(_follow, f"heading_of_{algorithm}", **{**functions, "read_k": read})


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
    solutions = {}
    for algorithm in ("euler", "quaternion"):
        out = np.empty((len(edges), 2))
        _loop(algorithm)(imu.dtheta, imu.dvel, weights, uniform, start, *turns, out)
        solutions[algorithm] = out
    c21, c11 = solutions["quaternion"].T
    integrated = solutions["euler"][:, 0]
    with np.errstate(divide="ignore"):
        single = np.arctan(c21 / c11)
    two = np.arctan2(c21, c11)
    unwrapped = np.unwrap(two)
    first = 2.0 * np.pi * np.round((truth[0] - np.array([integrated[0], unwrapped[0]])) / (2.0 * np.pi))
    return dict(zip(FORMS, (integrated + first[0], single, two, unwrapped + first[1]), strict=True))


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
    results = []
    for rate, ratio in ratios.items():
        count = len(ideal) // ratio
        rows = slice(0, count * ratio + 1, ratio)
        imu = ImuData(
            ideal.time[rows].copy(),
            *(x[: count * ratio].reshape(count, ratio, 3).sum(axis=1) for x in (ideal.dtheta, ideal.dvel)),
        )
        true = truth[rows]
        for form, computed in headings(trajectory, imu, true).items():
            apart = computed - true
            error = np.mod(apart + np.pi, 2.0 * np.pi) - np.pi  # a heading of 370° is one of 10°
            shown = np.unique(np.linspace(0, count, min(count + 1, _KEPT)).round().astype(np.intp))
            results.append(
                Heading(
                    part, motion, form, rate,
                    turns=float(true[-1] - true[0]) / (2.0 * np.pi),
                    max_error_arcsec=float(np.abs(error).max()) / ARCSEC,
                    final_error_arcsec=float(error[-1]) / ARCSEC,
                    jumps=int(np.count_nonzero(np.abs(np.diff(apart)) > _JUMP)),
                    wrong=float(np.mean(np.abs(error) > _WRONG)),
                    least_hz=_least_rate(true, rate) if form == FORMS[-1] else 0.0,
                    time=imu.time[shown], heading=computed[shown], truth=true[shown],
                )
            )  # fmt: skip
    return results


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
