"""The errors of one or many runs as the arrays that the kernels of `sinssim.sensors.error_kernel` take."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.sensors import error_kernel as kernel
from sinssim.sensors.error_checks import check_errors
from sinssim.sensors.imu_errors import Fault, ImuErrors

_NEXT, _OTHER = (1, 2, 0), (2, 0, 1)  # the axes after x, y, z

_KINDS = {
    "bias-step": kernel.STEP,
    "spike": kernel.SPIKE,
    "saturation": kernel.NARROW,
    "dropout": kernel.DROP,
    "freeze": kernel.FREEZE,
}

_PER_AXIS = {
    "bias": kernel.BIAS,
    "scale": kernel.SCALE,
    "asymmetry": kernel.ASYMMETRY,
    "quadratic": kernel.QUADRATIC,
    "cubic": kernel.CUBIC,
    "scale_temperature": kernel.SCALE_WARM,
    "bias_temperature": kernel.BIAS_WARM,
    "ramp": kernel.RAMP,
    "random_walk": kernel.RANDOM_WALK,
    "instability": kernel.INSTABILITY,
    "rate_walk": kernel.RATE_WALK,
    "flicker": kernel.FLICKER,
    "limit": kernel.LIMIT,
    "quantum": kernel.QUANTUM,
}
_PAIRS = {
    "misalignment": (kernel.TILT_NEXT, kernel.TILT_OTHER),
    "cross_axis": (kernel.CROSS_NEXT, kernel.CROSS_OTHER),
}

# Which parameters make which stage necessary
_STAGES = {
    kernel.TILTED: (kernel.TILT_NEXT, kernel.TILT_OTHER),
    kernel.BENT: (kernel.ASYMMETRY, kernel.QUADRATIC, kernel.CUBIC, kernel.CROSS_NEXT, kernel.CROSS_OTHER),
    kernel.WARMING: (kernel.SCALE_WARM, kernel.BIAS_WARM),
    kernel.RAMPING: (kernel.RAMP,),
    kernel.G_SENSITIVE: (kernel.G_X, kernel.G_Y, kernel.G_Z),
    kernel.WHITE: (kernel.RANDOM_WALK,),
    kernel.WANDERING: (kernel.INSTABILITY,),
    kernel.RATE_WALKING: (kernel.RATE_WALK,),
    kernel.FLICKERING: (kernel.FLICKER,),
    kernel.LIMITED: (kernel.LIMIT,),
    kernel.QUANTISED: (kernel.QUANTUM,),
}


class Packed(NamedTuple):
    """The errors of R runs.

    Attributes:
        active: the stages that any run needs.
        parameters: (R, 6, PARAMETERS).
        conditions: what all runs share, at the start, (CONDITIONS,).
        kinds: of the faults, (F,).
        spans: their begins and ends, (F, 2) s.
        amounts: what they do to each channel, (F, 6).
    """

    active: int
    parameters: Array
    conditions: Array
    kinds: NDArray[np.int64]
    spans: Array
    amounts: Array

    @property
    def nothing(self) -> bool:
        """Whether there is no error in any run."""
        return not self.active and not self.parameters.any()


def pack(runs: Sequence[ImuErrors], start: float) -> Packed:
    """Put the errors of runs into arrays.

    Args:
        runs: errors of each; correlation times, warm-up and faults are the same in all.
        start: first edge of the samples, s.

    Returns:
        The arrays.

    Raises:
        InputError: an error that no sensor has, as `check_errors`.
    """
    parameters = np.zeros((len(runs), 6, kernel.PARAMETERS))
    for run, errors in enumerate(runs):
        check_errors(errors)
        for first, triad in ((0, errors.gyro), (3, errors.accel)):
            three = slice(first, first + 3)
            for field, parameter in _PER_AXIS.items():
                parameters[run, three, parameter] = getattr(triad, field)
            for field, (after, other) in _PAIRS.items():
                matrix = getattr(triad, field)
                parameters[run, three, after] = matrix[range(3), _NEXT]
                parameters[run, three, other] = matrix[range(3), _OTHER]
        for j, parameter in enumerate((kernel.G_X, kernel.G_Y, kernel.G_Z)):
            parameters[run, :3, parameter] = errors.gyro.g_sensitivity[:, j]
    one = runs[0]
    faults = [fault for fault in one.faults if fault.kind != "jitter"]
    active = sum(stage for stage, needed in _STAGES.items() if parameters[:, :, needed].any())
    conditions = np.zeros(kernel.CONDITIONS)
    conditions[kernel.START] = start
    conditions[kernel.STEADY], conditions[kernel.WARM_UP] = one.warm_up.steady, one.warm_up.time_constant
    conditions[kernel.EXCESS] = one.warm_up.start - one.warm_up.steady
    conditions[kernel.GYRO_TIME], conditions[kernel.ACCEL_TIME] = one.gyro.correlation_time, one.accel.correlation_time
    return Packed(active + (kernel.FAULTY if faults else 0), parameters, conditions, *_faults(faults))


def _faults(faults: Sequence[Fault]) -> tuple[NDArray[np.int64], Array, Array]:
    return (
        np.array([_KINDS[fault.kind] for fault in faults], dtype=np.int64),
        np.array([(fault.start, fault.end) for fault in faults]).reshape(-1, 2),
        np.array([fault.amount for fault in faults]).reshape(-1, 6),
    )
