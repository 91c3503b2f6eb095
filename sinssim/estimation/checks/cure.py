"""What would cure a filter that refuses readings: the key that tells it of noise that the inertial readings show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.estimation.model import ErrorModel
from sinssim.estimation.result import Innovations
from sinssim.sensors.from_readings.vibration import AddedNoise, vibration

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
