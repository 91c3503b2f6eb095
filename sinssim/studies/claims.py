"""Decides the textbook chapter's claims, and further laws, from the numbers of a study.

A part of a study names the claims that it has the numbers for. This module holds the decision rules and their
thresholds.
"""

# Longer than 400 lines: one function for each claim, and shared helpers.

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sinssim.algorithms import family
from sinssim.formatting import number_text
from sinssim.frames import listed
from sinssim.strapdown.coning_drift import drift, leading_term
from sinssim.studies.motions import MotionFacts
from sinssim.studies.results import Row, StudyResult, Verdict
from sinssim.studies.schema import CLAIMS
from sinssim.units import ARCSEC

FEW_TENTHS_ARCSEC = 18.0
"""The chapter's "few tenths of a minute of arc": 0.3′."""
NEGLIGIBLE = 0.1
"""A rate is sufficient if its error is less than this fraction of the error of sensors of the 1 nmi/h grade."""
GOOD_GYRO_DEG_H = 0.0035
"""A high-quality gyro: the bias of the grade laser-navigation."""
KEPT = 1e-9
"""Deviation from 1 up to which a norm counts as preserved."""
SMALL_TILT_DEG = 5.0
"""Tilt up to which the errors of a block without gyros are linear."""
LAW_HOLDS = 0.03
"""Relative error up to which a law holds."""

_LOW_ORDER = ("poisson-1", "poisson-2", "quaternion-1", "quaternion-2", "two-quaternions", "rotation-vector-1")
_PLAIN = ("poisson-3", "poisson-4", "quaternion-3", "quaternion-4")
"""Algorithms of high order for a constant rate, with the increment in place of the rotation vector."""
_SAMPLES = {"1": 1, "1p": 1, "2": 2, "3": 3, "4": 4}
_LEAST_DRIFT = 1e-5 * ARCSEC  # total drift; a smaller one contains rounding
_GYRO_FREE = "six-accelerometers-"
_EULER = "euler"
_OTHERS = ("direction cosines", "Euler angles")
_FAMILIES = {
    "quaternion": "quaternions",
    "two-quaternions": "quaternions",
    "poisson": _OTHERS[0],
    _EULER: _OTHERS[1],
    "rotation-vector": "beyond the chapter, rotation vectors",
}

Outcome = tuple[str, str, tuple[str, ...], dict[str, float]]


def decide(comparison: StudyResult) -> list[Verdict]:
    """Decide the claims that a study's parts have numbers for.

    Args:
        comparison: results of the study.

    Returns:
        A verdict for each claim, in the order of the chapter; "undecided" if the study ended early or lacks numbers
        that the claim needs.
    """
    verdicts = []
    for claim, sentence in CLAIMS.items():
        parts = [part for part in comparison.study.parts if claim in part.decides]
        titles = [part.title for part in parts]
        if not titles:
            continue
        planned = sum(part.cases * len(part.motions) for part in parts)
        done = sum(row.part in titles for row in comparison.rows)
        if comparison.status != "finished" and done < planned:  # an incomplete set of numbers is not conclusive
            outcome = _undecided(f"{planned - done} of its {planned} navigations were not reached")
            verdicts.append(Verdict(claim, sentence, *outcome))
            continue
        rows = [row for row in comparison.rows if row.part in titles and row.status == "done"]
        facts = {row.motion: comparison.motions[row.part, row.motion] for row in rows}
        outcome = _DECIDERS[claim](rows, facts)
        verdicts.append(Verdict(claim, sentence, *outcome))
    return verdicts


def _undecided(lacking: str) -> Outcome:
    return "undecided", f"The study lacks the numbers that decide it: {lacking}.", (), {}


def _by(rows: list[Row], key: Callable[[Row], str]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def _base(algorithm: str) -> str:
    return algorithm.removesuffix("-ortho").removesuffix("-norm")


def _needed(rows: list[Row], bar: float) -> dict[str, Row]:
    """Return, by algorithm, the row of the lowest rate from which on the attitude error stays within a limit,
    arcsec."""
    needed = {}
    for algorithm, found in _by(rows, lambda row: row.algorithm).items():
        enough = None
        for row in sorted(found, key=lambda row: -row.rate_hz):
            if not row.max_attitude_error_arcsec <= bar:
                break
            enough = row
        if enough is not None:
            needed[algorithm] = enough
    return needed


def _velocity_rate(rows: list[Row], facts: dict[str, MotionFacts]) -> Outcome:
    """Decide on slow velocity and position with fast attitude, relative to the errors of sensors."""
    numbers: dict[str, float] = {}
    said = []
    worst: dict[float, tuple[float, str]] = {10.0: (0.0, ""), 20.0: (0.0, "")}
    for motion, found in _by(rows, lambda row: row.motion).items():
        real = [r for r in found if r.sensors != "ideal" and (not r.schedule_hz or len(set(r.schedule_hz)) == 1)]
        words = []
        for rate in worst:
            slow = [r for r in found if r.sensors == "ideal" and r.schedule_hz[1:] == (rate, rate)]
            if not slow or not real:
                return _undecided(
                    "velocity and position at 10 and 20 Hz with perfect sensors, and real sensors at the full rate"
                )
            ratio = max(
                slow[0].max_horizontal_error_m / real[0].max_horizontal_error_m,
                slow[0].max_velocity_error_mps / real[0].max_velocity_error_mps,
            )
            worst[rate] = max(worst[rate], (ratio, motion))
            numbers[f"{motion}: {rate:g} Hz, m"] = slow[0].max_horizontal_error_m
            numbers[f"{motion}: {rate:g} Hz, m/s"] = slow[0].max_velocity_error_mps
            words.append(
                f"{rate:g} Hz {slow[0].max_horizontal_error_m:.3g} m and {slow[0].max_velocity_error_mps:.3g} m/s"
            )
        numbers[f"{motion}: {real[0].sensors}, m"] = real[0].max_horizontal_error_m
        numbers[f"{motion}: {real[0].sensors}, m/s"] = real[0].max_velocity_error_mps
        words.append(
            f"{real[0].sensors} sensors {real[0].max_horizontal_error_m:.3g} m and "
            f"{real[0].max_velocity_error_mps:.3g} m/s"
        )
        said.append(f"{motion}: {', '.join(words)}")
    if not said:
        return _undecided("any result")
    loads = {row.pace: row.operations_per_step for row in rows if row.schedule_hz and row.operations_per_step > 0.0}
    numbers |= {f"{pace}: operations per step": load for pace, load in loads.items()}
    if loads:
        said.append(f"operations per fast step: {', '.join(f'{pace} {load:.0f}' for pace, load in loads.items())}")
    enough = {rate: ratio < NEGLIGIBLE for rate, (ratio, _) in worst.items()}
    verdict = "confirmed" if all(enough.values()) else "partly" if enough[20.0] else "refuted"
    judged = ", ".join(
        f"{rate:g} Hz {'is' if enough[rate] else 'is not'} ({100.0 * ratio:.2g} % on {motion})"
        for rate, (ratio, motion) in worst.items()
    )
    numbers |= {f"{rate:g} Hz, part of what sensors cost": ratio for rate, (ratio, _) in worst.items()}
    reason = (
        f"A rate is sufficient if its error is less than {100.0 * NEGLIGIBLE:g} % of the sensors' error, in position "
        f"and in velocity: {judged}. Largest errors due to the slow rates alone, and due to the sensors:"
    )
    return verdict, reason, tuple(said), numbers


def _attitude_rate(rows: list[Row], facts: dict[str, MotionFacts]) -> Outcome:
    """Find the lowest rate that keeps attitude within a few tenths of a minute of arc."""
    numbers: dict[str, float] = {}
    said = []
    high: list[float] = []
    low: list[float] = []
    for motion, found in _by(rows, lambda row: row.motion).items():
        needed = _needed(found, FEW_TENTHS_ARCSEC)
        good = [r for r in needed.values() if _base(r.algorithm) not in (*_LOW_ORDER, *_PLAIN)]
        plain = [r for r in needed.values() if _base(r.algorithm) in _LOW_ORDER]
        uncompensated = [r.rate_hz for r in needed.values() if _base(r.algorithm) in _PLAIN]
        if not good:
            return "refuted", f"On {motion} no algorithm of high order stays within 0.3′ at any rate.", (), numbers
        best = min(good, key=lambda r: (r.rate_hz, r.max_attitude_error_arcsec))
        high.append(best.rate_hz)
        arcmin = best.max_attitude_error_arcsec / 60.0
        text = f"{motion}: high order from {best.rate_hz:g} Hz ({best.algorithm}, {arcmin:.2g}′)"
        numbers[f"{motion}: high order, Hz"] = best.rate_hz
        numbers[f"{motion}: high order, arcmin"] = arcmin
        if plain:
            best = min(plain, key=lambda r: (r.rate_hz, r.max_attitude_error_arcsec))
            low.append(best.rate_hz)
            numbers[f"{motion}: low order, Hz"] = best.rate_hz
            text += f", first and second order from {best.rate_hz:g} Hz"
        else:
            low.append(float("inf"))
            text += ", first and second order at no rate"
        if uncompensated:
            text += f", third and fourth order without coning compensation from {min(uncompensated):g} Hz"
            numbers[f"{motion}: third and fourth order without coning compensation, Hz"] = min(uncompensated)
        said.append(text)
    if not said:
        return _undecided("any result")
    worst, plainest = max(high), max(low)
    verdict = "confirmed" if 50.0 <= worst <= 80.0 else "partly" if worst < 50.0 < plainest else "refuted"
    than = f"first and second order {f'{plainest:g} Hz' if np.isfinite(plainest) else 'a higher rate than any here'}"
    reason = (
        f"On the most demanding motion a high order needs {worst:g} Hz, {than}. Lowest rate that stays within 0.3′ to "
        "the end of the motion:"
    )
    return verdict, reason, tuple(said), numbers


def _cheapest(rows: list[Row], facts: dict[str, MotionFacts]) -> Outcome:
    """Compare families by the operations per second of motion that keep attitude within a few tenths of a minute of
    arc.

    The chapter's algorithms, which make a step of every sample, decide; rotation vectors of several samples per step
    are listed beside them. The whole navigation decides; the attitude alone is compared, too.
    """
    numbers: dict[str, float] = {}
    said = []
    won, margins, alone = [], [], []
    for motion, found in _by(rows, lambda row: row.motion).items():
        best: dict[str, Row] = {}
        for row in _needed(found, FEW_TENTHS_ARCSEC).values():
            group = _FAMILIES.get(family(row.algorithm))
            if group and (group not in best or _load(row) < _load(best[group])):
                best[group] = row
        chapter = sorted((f for f in best if f in ("quaternions", *_OTHERS)), key=lambda f: _load(best[f]))
        if "quaternions" not in chapter or len(chapter) < 2:
            return _undecided("quaternions and another of the chapter's families within 0.3′")
        won.append(chapter[0] == "quaternions")
        margins.append(min(_load(best[f]) for f in chapter if f != "quaternions") / _load(best["quaternions"]) - 1.0)
        attitude = _attitude_loads(found)
        others = [load for group, load in attitude.items() if group in _OTHERS]
        if "quaternions" in attitude and others:
            alone.append(min(others) / attitude["quaternions"] - 1.0)
        for group, load in attitude.items():
            numbers[f"{motion}: {group}, attitude alone, 1000 operations/s"] = load / 1e3
        for group, row in best.items():
            numbers[f"{motion}: {group}, 1000 operations/s"] = _load(row) / 1e3
            numbers[f"{motion}: {group}, µs/s"] = row.ns_per_step * row.rate_hz / 1e3
        words = [
            f"{group} {_load(row) / 1e3:.3g} thousand ({row.algorithm} at {row.rate_hz:g} Hz)"
            for group, row in ((f, best[f]) for f in (*chapter, *(f for f in best if f not in chapter)))
        ]
        said.append(f"{motion}: {', '.join(words)}")
    if not said:
        return _undecided("any result")
    verdict = "confirmed" if all(won) else "partly" if any(won) else "refuted"
    reason = (
        f"Quaternions need the fewest operations on {sum(won)} of {len(won)} motions; the best of the others "
        f"takes {100.0 * min(margins):+.1f} % to {100.0 * max(margins):+.1f} %"
        + (f", of the attitude alone {100.0 * min(alone):+.1f} % to {100.0 * max(alone):+.1f} %" if alone else "")
        + ". Operations of the whole navigation per second of motion, for 0.3′:"
    )
    return verdict, reason, tuple(said), numbers


def _load(row: Row) -> float:
    return row.operations_per_step * row.rate_hz


def _attitude_loads(rows: list[Row]) -> dict[str, float]:
    """Return, by family, the least operations per second of the attitude alone that keep it within 0.3′."""
    least: dict[str, float] = {}
    for row in _needed(rows, FEW_TENTHS_ARCSEC).values():
        group, load = _FAMILIES.get(family(row.algorithm)), row.attitude_operations_per_step * row.rate_hz
        if group and load < least.get(group, np.inf):
            least[group] = load
    return least


def _orthogonality(rows: list[Row], facts: dict[str, MotionFacts]) -> Outcome:
    """Decide on the norm that the two quaternions lose."""
    two = [row for row in rows if row.algorithm == "two-quaternions"]
    if not two:
        return _undecided("the algorithm two-quaternions")
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
    if best is not worst:
        text += f", and by {best.max_defect:.2g} on {best.motion} at {best.pace} Hz"
    if worst.max_defect < KEPT:
        return "confirmed", text + ".", (), numbers
    ppm = 2.0 * worst.max_defect * 1e6
    numbers["scale error of the forces, ppm"] = ppm
    return "partly", text + f". At worst the resolved forces are {ppm:.2g} ppm too large: normalise.", (), numbers


def _euler_limit(rows: list[Row], facts: dict[str, MotionFacts]) -> Outcome:
    """Decide on the errors of Euler angles and of quaternions at ±90° of pitch."""
    passed = [row for row in rows if row.algorithm == _EULER and row.passages]
    if not passed:
        return _undecided("Euler angles on a motion that passes ±90° of pitch")
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
    # A passage with an error of a few tenths of an arcminute at most would not be a limit.
    return "refuted" if worst.max_damage_arcsec > FEW_TENTHS_ARCSEC else "confirmed", text + ".", (), numbers


def _simplified_radii(rows: list[Row], facts: dict[str, MotionFacts]) -> Outcome:
    """Find, for each form of simplified radii, the gyro bias that causes the same position error."""
    numbers: dict[str, float] = {}
    said = []
    worst: dict[str, float] = {}
    for motion, found in _by(rows, lambda row: row.motion).items():
        forms = [r for r in found if r.curvature != "exact" and r.sensors == "ideal"]
        biased = [r for r in found if r.curvature == "exact" and r.sensors == "gyro-0_01-deg-h"]
        if not forms or not biased:
            return _undecided("simplified radii with perfect sensors, and exact radii with the block gyro-0_01-deg-h")
        by_bias = biased[0].max_horizontal_error_m
        numbers[f"{motion}: gyros of 0.01 deg/h, m"] = by_bias
        words = []
        for row in forms:
            error = row.max_horizontal_error_m
            equivalent = 0.01 * error / by_bias
            worst[row.curvature] = max(worst.get(row.curvature, 0.0), equivalent)
            numbers[f"{motion}: {row.curvature}, m"] = error
            numbers[f"{motion}: {row.curvature}, equivalent gyro bias, deg/h"] = equivalent
            words.append(f"{row.curvature} {number_text(error)} m, as much as {number_text(equivalent, 2)} deg/h")
        said.append(f"{motion}: {'; '.join(words)}")
    if not said:
        return _undecided("any result")
    costly = [value >= GOOD_GYRO_DEG_H for value in worst.values()]
    verdict = "confirmed" if all(costly) else "partly" if any(costly) else "refuted"
    numbers |= {f"{form}: largest equivalent gyro bias, deg/h": value for form, value in worst.items()}
    shown = [f"{form} ({number_text(value, 2)})" for form, value in worst.items()]
    as_much = [text for text, much in zip(shown, costly, strict=True) if much]
    less = [text for text, much in zip(shown, costly, strict=True) if not much]
    judged = [f"{listed(as_much)} cost as much or more"] if as_much else []
    judged += [f"{listed(less)} cost less"] if less else []
    reason = (
        f"A high-quality gyro has {GOOD_GYRO_DEG_H:g} deg/h. By their largest error, deg/h in brackets, "
        f"{'; '.join(judged)}. Largest position error with perfect sensors, and the gyro bias with the same error:"
    )
    return verdict, reason, tuple(said), numbers


def _latitude_rate(rows: list[Row], facts: dict[str, MotionFacts]) -> Outcome:
    """Compute the rate of latitude on a true motion due north."""
    best = max(
        facts.items(), key=lambda item: item[1].latitude_rate_deg_h / max(item[1].ground_speed_kmh, 1.0), default=None
    )
    if best is None:
        return _undecided("a motion to the north")
    motion, fact = best
    rate = fact.latitude_rate_deg_h * 1100.0 / fact.ground_speed_kmh
    text = (
        f"On the motion “{motion}” latitude changes by {fact.latitude_rate_deg_h:.3f} deg/h at "
        f"{fact.ground_speed_kmh:.1f} km/h; at 1100 km/h that is {rate:.2f} deg/h."
    )
    return "confirmed" if abs(rate - 10.0) < 0.5 else "refuted", text, (), {"latitude rate, deg/h": rate}


def _gyro_free(rows: list[Row], facts: dict[str, MotionFacts]) -> Outcome:
    """Find the power of time with which six accelerometers drift: an error ~ tᵖ has (final/rms)² = 2p + 1."""
    numbers: dict[str, float] = {}
    said = []
    powers: list[float] = []
    for row in rows:
        if not row.variant.startswith(_GYRO_FREE) or row.sensors == "ideal":
            continue
        arm = row.variant.removeprefix(_GYRO_FREE)
        name = f"{row.motion}, {row.sensors}, arms of {arm}"
        numbers[f"{name}, m"] = row.final_horizontal_error_m
        text = f"{name}: {number_text(row.final_horizontal_error_m)} m after {row.duration_s:g} s"
        if row.max_attitude_error_arcsec < SMALL_TILT_DEG * 3600.0:
            powers.append(0.5 * ((row.final_horizontal_error_m / row.rms_horizontal_error_m) ** 2 - 1.0))
            numbers[f"{name}, power of time"] = powers[-1]
            text += f", power {powers[-1]:.2f}"
        else:
            text += f", tilted by up to {number_text(row.max_attitude_error_arcsec / 3600.0)}°"
        said.append(text)
    if not powers:
        return _undecided(f"a block of six accelerometers with errors, tilted by less than {SMALL_TILT_DEG:g}°")
    reason = (
        f"While the tilt is small, below {SMALL_TILT_DEG:g}°, the error grows with the power {min(powers):.2f} to "
        f"{max(powers):.2f} of time: a bias tilts the block with the square of time, and gravity moves it with the "
        "fourth power:"
    )
    return ("confirmed" if min(powers) > 2.0 else "refuted"), reason, tuple(said), numbers


def _coning_drift(rows: list[Row], facts: dict[str, MotionFacts]) -> Outcome:
    """Compare the drift after whole turns of a cone with the law and with the exact theory."""
    numbers: dict[str, float] = {}
    said = []
    kept: list[tuple[str, float]] = []
    farthest = 0.0
    for motion, found in _by(rows, lambda row: row.motion).items():
        cone = facts[motion].cone
        for algorithm, at_rates in _by(found, lambda row: row.algorithm).items():
            name = algorithm.removeprefix("rotation-vector-")
            if cone is None or name not in _SAMPLES:
                continue
            words = []
            for row in sorted(at_rates, key=lambda row: -row.rate_hz):
                case = (_SAMPLES[name], *cone, 1.0 / row.rate_hz, name == "1p")
                law, exact = leading_term(*case), abs(drift(*case))
                if exact * row.duration_s < _LEAST_DRIFT:
                    continue
                measured = row.final_attitude_error_arcsec * ARCSEC / row.duration_s
                x = cone[1] / row.rate_hz
                numbers[f"{motion}, {name}, Ωh = {x:.3f}: measured/law"] = measured / law
                numbers[f"{motion}, {name}, Ωh = {x:.3f}: measured/exact"] = measured / exact
                farthest = max(farthest, abs(measured / exact - 1.0))
                holds = abs(exact / law - 1.0) < LAW_HOLDS
                if holds:
                    kept.append((name, measured / law))
                words.append(f"{measured / law:.3f}{'' if holds else f' [{exact / law:.3f}]'} at {x:.3f}")
            if words:
                said.append(f"{motion}, n = {'1 and the one before' if name == '1p' else name}: {', '.join(words)}")
    if {name for name, _ in kept} != set(_SAMPLES):
        return _undecided("for each number of samples a cone and a rate at which the law holds")
    worst = max((ratio for _, ratio in kept), key=lambda ratio: abs(ratio - 1.0))
    good = abs(worst - 1.0) < LAW_HOLDS and farthest < LAW_HOLDS
    reason = (
        f"The law is the leading term. Where it is within {100.0 * LAW_HOLDS:g} % of the exact drift, measured drifts "
        f"are {worst:.3f} of it in the worst case; elsewhere (exact ratio in brackets) the next term or the floor of "
        f"triple products dominates. They differ from the exact drift by at most {100.0 * farthest:.2g} %. Measured "
        "drift over the law, at Ωh:"
    )
    return ("confirmed" if good else "refuted"), reason, tuple(said), numbers


_DECIDERS: dict[str, Callable[[list[Row], dict[str, MotionFacts]], Outcome]] = {
    "velocity-rate": _velocity_rate,
    "attitude-rate": _attitude_rate,
    "cheapest": _cheapest,
    "orthogonality": _orthogonality,
    "euler-limit": _euler_limit,
    "simplified-radii": _simplified_radii,
    "latitude-rate": _latitude_rate,
    "gyro-free": _gyro_free,
    "coning-drift": _coning_drift,
}
