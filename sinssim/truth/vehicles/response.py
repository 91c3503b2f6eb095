"""The response of a body on springs to the motion of what carries it.

A damped oscillator of natural angular frequency ω₀ and damping ratio ζ. The carrier moves the spring, and the damper
too if it stands on the carrier as that of a suspension does (base excitation):

    z̈ + 2ζω₀(ż − u̇) + ω₀²(z − u) = 0,   H = (1 + 2iζr)/(1 − r² + 2iζr),   r = ω/ω₀

The damper of a hull acts against still water: its term is ż alone, and H = 1/(1 − r² + 2iζr). See Den Hartog,
Mechanical Vibrations, 4th ed., 1956, ch. 2.
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array


def respond(u: Array, interval: float, frequency_hz: float, damping: float, *, on_carrier: bool) -> Array:
    """Return the motion of the body, which begins at rest on a carrier at rest.

    The carrier moves on straight lines between its samples, for which the solution is exact (first-order hold).

    Args:
        u: motion of the carrier, (K,).
        interval: time between samples, s.
        frequency_hz: natural frequency, Hz.

    Returns:
        z, (K,).
    """
    from scipy.signal import cont2discrete, lfilter

    w = 2.0 * np.pi * frequency_hz
    numerator = [2.0 * damping * w, w * w] if on_carrier else [w * w]
    top, bottom, _ = cont2discrete((numerator, [1.0, 2.0 * damping * w, w * w]), interval, method="foh")  # type: ignore[call-overload]
    return np.asarray(lfilter(np.ravel(top), bottom, u - u[0]) + u[0])
