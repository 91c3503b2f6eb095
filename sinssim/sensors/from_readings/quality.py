"""Codes of a fix's quality as factors of its 1σ: a receiver's own 1σ is too small for a solution that is not fixed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import number
from sinssim.data import Measurements
from sinssim.errors import InputError

RTKLIB_FACTORS: dict[int, float | None] = {1: 1.0, 2: 10.0, 3: 1.0, 4: 1.0, 5: 1.0, 6: 1.0}
"""By RTKLIB's codes: fixed, float, augmented, differential, single, precise point. A float solution claims centimetres
while its ambiguities are decimetres off; the 1σ of the others are those of code ranges."""


def with_quality(
    measurements: Measurements,
    quality: ArrayLike,
    factors: Mapping[int, float | None] = RTKLIB_FACTORS,
    least: ArrayLike = 0.0,
) -> Measurements:
    """Return fixes whose 1σ follow their codes of quality.

    Args:
        measurements: M fixes with the receiver's 1σ.
        quality: code of each, (M,) whole numbers.
        factors: factor of the 1σ by code; None leaves the fixes of a code out.
        least: least 1σ after that, one number or one for each component, in the unit of the 1σ, for what no receiver
            knows, such as its antenna's phase centre and the resolution of its output.

    Raises:
        InputError: a code has no factor, or there is not one code for each fix.
    """
    codes = np.asarray(quality)
    if codes.shape != (len(measurements),):
        raise InputError(f"quality has the shape {codes.shape}; {len(measurements)} fixes need one code each.")
    present = [int(code) for code in np.unique(codes)]
    unknown = [code for code in present if code not in factors]
    if unknown:
        raise InputError(
            f"quality: the code {unknown[0]} has no factor; there are factors for {sorted(factors)}. Give one, or None "
            "to leave such fixes out."
        )
    scale = np.zeros(len(codes))
    for code in present:
        factor = factors[code]
        scale[codes == code] = 0.0 if factor is None else number(f"factor of quality {code}", factor, low=0.0)
    kept, m = scale > 0.0, measurements
    sigma = np.maximum(m.sigma[kept] * scale[kept, None], np.asarray(least, dtype=np.float64))
    correlation = None if m.correlation is None else m.correlation[kept]
    m = replace(m, correlation=correlation, sigma=sigma)
    return replace(m, time=m.time[kept], arrival=m.arrival[kept], value=m.value[kept])
