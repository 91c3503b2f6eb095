"""Packs the errors of runs into the arrays of `sinssim.sensors.imu.error_kernel`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.sensors.imu import error_kernel as kernel
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_validation import check_errors
from sinssim.sensors.imu.errors import Fault, ImuErrors
from sinssim.sensors.imu.terms import DTHETA_STEP, DVEL_STEP, FIELDS, SLOTS, STAGES

_NEXT, _OTHER = (1, 2, 0), (2, 0, 1)  # the axes after x, y, z

_KINDS = {
    "bias-step": kernel.STEP,
    "spike": kernel.SPIKE,
    "saturation": kernel.NARROW,
    "dropout": kernel.DROP,
    "freeze": kernel.FREEZE,
}


class Packed(NamedTuple):
    """The errors of R runs.

    Attributes:
        nothing: whether no run has any error.
        active: the stages that at least one run needs.
        parameters: (R, 6, PARAMETERS).
        conditions: the conditions common to all runs at the start, (CONDITIONS,).
        kinds: kinds of the faults, (F,).
        spans: their beginnings and ends, (F, 2) s.
        amounts: their effects on each channel, (F, 6).
    """

    nothing: bool
    active: int
    parameters: Array
    conditions: Array
    kinds: NDArray[np.int64]
    spans: Array
    amounts: Array


def pack(runs: Sequence[ImuErrors], start: float, *, rounded: bool = False) -> Packed:
    """Pack the errors of runs into arrays.

    Args:
        runs: errors of each run; correlation times, warm-up and faults are the same in all.
        start: first edge of the samples, s.
        rounded: whether sensors without pulses have steps of 2⁻⁵² rad and 2⁻⁴⁶ m/s.

    Raises:
        InputError: an error is invalid; see `check_errors`.
    """
    parameters = np.zeros((len(runs), 6, kernel.PARAMETERS))
    for run, errors in enumerate(runs):
        check_errors(errors)
        for first, triad in ((0, errors.gyro), (3, errors.accel)):
            for field, slots in SLOTS.items():
                for slot, column in zip(slots, _columns(getattr(triad, field), FIELDS[field]), strict=True):
                    parameters[run, first : first + 3, slot] = column
    one = runs[0]
    faults = [fault for fault in one.faults if fault.kind != "jitter"]
    nothing = not (parameters.any() or faults)
    if rounded and not nothing:
        for first, step in ((0, DTHETA_STEP), (3, DVEL_STEP)):
            quantum = parameters[:, first : first + 3, kernel.QUANTUM]
            quantum[quantum == 0.0] = step
    needed: dict[str, list[int]] = {}
    for field, slots in SLOTS.items():
        needed.setdefault(FIELDS[field].stage, []).extend(slots)
    active = sum(bit for stage, bit in STAGES.items() if parameters[:, :, needed[stage]].any())
    conditions = np.zeros(kernel.CONDITIONS)
    conditions[kernel.START] = start
    conditions[kernel.STEADY], conditions[kernel.WARM_UP] = one.warm_up.steady, one.warm_up.time_constant
    conditions[kernel.EXCESS] = one.warm_up.start - one.warm_up.steady
    conditions[kernel.GYRO_TIME], conditions[kernel.ACCEL_TIME] = one.gyro.correlation_time, one.accel.correlation_time
    return Packed(nothing, active + (kernel.FAULTY if faults else 0), parameters, conditions, *_faults(faults))


def _columns(value: Any, term: ErrorTerm) -> Iterable[Any]:
    """Return the parameters of one term for the kernel's channels, one number or (3,) each."""
    if term.size == 6:
        return value[range(3), _NEXT], value[range(3), _OTHER]
    if term.size == 9:
        return tuple(np.asarray(value).T)
    return (value,) if term.slots is None else ()


def _faults(faults: Sequence[Fault]) -> tuple[NDArray[np.int64], Array, Array]:
    return (
        np.array([_KINDS[fault.kind] for fault in faults], dtype=np.int64),
        np.array([(fault.start, fault.end) for fault in faults]).reshape(-1, 2),
        np.array([fault.amount for fault in faults]).reshape(-1, 6),
    )
