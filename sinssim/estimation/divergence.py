"""Divergence checks and warnings of the filter, and the vibration of inertial readings that its settings leave out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.estimation.filter_result import Divergence, Innovations
from sinssim.estimation.state_model import ErrorModel
from sinssim.sensors.vibration_noise import AddedNoise, vibration

CONTRADICTION_S, CONTRADICTION = 30.0, 10
"""Time, s, and number of readings, over which all readings must be rejected for a contradiction."""


_ROUNDING = 1e-10
"""Eigenvalue of a correlation matrix that may be negative by rounding. States that depend linearly on each other, such
as the tilts and the velocity of a vehicle at rest with sensors without errors, have an eigenvalue of zero."""


class Diverged(Exception):  # noqa: N818 - not an error of the user: the run ends there and keeps its results
    """Signals that the filter cannot continue.

    Args:
        time: s.
        measurement: the reading at which this was found.
        reason: one sentence without its full stop.
    """

    def __init__(self, time: float, measurement: str, reason: str) -> None:
        super().__init__(reason)
        self.divergence = Divergence(time, measurement, reason)


def check_covariance(covariance: Array, varying: NDArray[np.intp], time: float, measurement: str) -> None:
    """Raise for an invalid covariance.

    Args:
        covariance: P, (n, n).
        varying: numbers of the states that are not known exactly.
        time: s.

    Raises:
        Diverged: P is not positive definite.
    """
    p = covariance if len(varying) == len(covariance) else covariance[np.ix_(varying, varying)]
    variance = p.diagonal()
    if variance.min() > 0.0:
        scale = 1.0 / np.sqrt(variance)
        correlation = p * scale[:, None] * scale  # row by row: products of two scales may overflow
        try:
            np.linalg.cholesky(correlation)
        except np.linalg.LinAlgError:
            if np.linalg.eigvalsh(correlation)[0] > -_ROUNDING:
                return
        else:
            return
    raise Diverged(time, measurement, "the covariance is no longer positive definite")


def contradiction(innovations: Sequence[Innovations]) -> Divergence | None:
    """Find the first period in which the gate rejected every reading of every sensor.

    Returns:
        The contradiction between filter and sensors; None if there is none.
    """
    refused = [np.flatnonzero(~i.accepted & ~np.isnan(i.nis)) for i in innovations]
    time = np.concatenate([i.time[rows] for i, rows in zip(innovations, refused, strict=True)] or [np.zeros(0)])
    if not len(time):
        return None
    sensor = np.repeat(np.arange(len(innovations)), [len(rows) for rows in refused])
    order = np.argsort(time, kind="stable")
    time, sensor, row = time[order], sensor[order], np.concatenate(refused)[order]
    # rejected readings with as many accepted ones before them follow one another; of simultaneous readings, the one of
    # the earlier sensor is the first
    before = np.zeros(len(time), dtype=np.intp)
    for number, i in enumerate(innovations):
        accepted = i.time[i.accepted]
        later = sensor > number
        before += np.where(later, np.searchsorted(accepted, time, "right"), np.searchsorted(accepted, time, "left"))
    edges = np.flatnonzero(np.diff(before, prepend=-1, append=-1)).tolist()
    for begin, end in pairwise(edges):
        lasting = time[end - 1] - time[begin]
        if end - begin >= CONTRADICTION and lasting >= CONTRADICTION_S:
            which = f"{innovations[sensor[begin]].sensor} {row[begin]} (valid at {time[begin]:.3f} s)"
            return Divergence(
                float(time[begin]),
                which,
                f"from this measurement on, the gate rejected all {end - begin} measurements in {lasting:.0f} s: "
                "either the sensors are wrong, or the filter is overconfident",
            )
    return None


def remarks(innovations: Sequence[Innovations], late: Sequence[int]) -> list[str]:
    """Report readings that were not used.

    Args:
        late: number of readings of each sensor that arrive after the end.

    Returns:
        Whole sentences; none for a sensor whose readings were all used.
    """
    found = [] if innovations else ["There are no measurements: the result is the inertial solution."]
    for i, later in zip(innovations, late, strict=True):
        count = len(i.time)
        if later > max(1, count // 10) or later == count > 0:  # a few readings pending at the end are normal
            found.append(
                f"{i.sensor}: {later} of {count} measurements arrive after the end of the run; only the smoothed "
                "solution uses them."
            )
        rejected = int(np.count_nonzero(~i.accepted & ~np.isnan(i.nis)))
        unusable = Counter(reason for reason, nis in zip(i.reason, i.nis, strict=True) if reason and np.isnan(nis))
        if not count:
            stood = " (the vehicle was never at rest)" if i.kind in ("zero-velocity", "zero-rate") else ""
            found.append(f"{i.sensor}: there was no measurement{stood}; the sensor corrects nothing.")
            continue
        why = ", ".join(f"{number} {reason}" for reason, number in unusable.items())
        if not i.accepted.any():
            detail = "; ".join(filter(None, [why, f"{rejected} rejected by the gate" if rejected else ""]))
            found.append(
                f"{i.sensor}: none of {count} measurements was used{f' ({detail})' if detail else ''}; the sensor "
                "corrects nothing."
            )
            continue
        if why:
            found.append(f"{i.sensor}: some of {count} measurements could not be used ({why}).")
        if rejected:
            found.append(f"{i.sensor}: the gate rejected {rejected} of {count} measurements.")
    if innovations and not any(i.accepted.any() for i in innovations):
        found.append("No measurement was used: the result is the inertial solution.")
    return found


REFUSED = 0.02
"""Share of refused readings from which a cause is looked for; a gate refuses a ten-thousandth of correct ones."""

SHAKEN = 3.0
"""Ratio of the shaking to the assumed noise from which it is named."""

_AXES = ("forward", "right", "down")


def vibration_untold(
    innovations: Sequence[Innovations], imu: ImuData, model: ErrorModel, added: AddedNoise | None
) -> list[str]:
    """Name the vibration in the inertial readings if readings are refused and the filter was told of none.

    White noise of density N scatters the readings of one sample by N/√Δt. Readings that scatter more hold either more
    noise or vibration, which adds noise.

    Args:
        added: noise in addition to the model's that the filter was told; None for none.
    """
    tested = sum(int(np.count_nonzero(~np.isnan(i.nis))) for i in innovations)
    refused = sum(int(np.count_nonzero(~np.isnan(i.nis) & ~i.accepted)) for i in innovations)
    if added is not None or refused <= REFUSED * tested:
        return []
    try:
        found = vibration(imu)
    except InputError:  # sampled too slowly to show vibration
        return []
    told = (
        ("gyros", found.gyro, model.gyro_noise, 180.0 / np.pi, "°/s"),
        ("accelerometers", found.accel, model.accel_noise, 1.0, "m/s²"),
    )
    words = []
    for name, level, density, unit, symbol in told:
        rms = np.sqrt(np.mean(level**2, axis=0))
        axis, assumed = int(np.argmax(rms)), density / np.sqrt(found.interval)
        if rms[axis] > SHAKEN * assumed:
            times = f"{rms[axis] / assumed:.0f} times the assumed noise of a sample" if assumed else "none is assumed"
            words.append(f"the {name} by {unit * rms[axis]:.3g} {symbol} (rms, {_AXES[axis]}), {times}")
    if not words:
        return []
    return [
        f"The gate rejected {100.0 * refused / tested:.0f} % of all measurements, and the inertial data contain "
        f"vibration: {'; '.join(words)}. Vibration adds noise that the filter does not model: set "
        "filter.vibration_noise (about 0.4), or increase filter.inertial_noise_factor."
    ]
