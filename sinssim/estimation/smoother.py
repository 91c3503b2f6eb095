"""The smoother of Rauch, Tung and Striebel for the total state of the closed loop.

Between two rows the filter's error state propagates linearly, x⁻ₖ₊₁ = Φ xₖ. At a row errors are fed back, and from
there on the state is the error of another trajectory. Referred to one trajectory, the smoother's recursion (Rauch, Tung
and Striebel, AIAA Journal 3, 1965, 1445) is

    x̂ₖ ← xₖ + Kₖ (x̂ₖ₊₁ + cₖ₊₁ − Φ xₖ),   Kₖ = Pₖ Φᵀ (P⁻ₖ₊₁)⁻¹,   P̂ₖ ← Pₖ + Kₖ (P̂ₖ₊₁ − P⁻ₖ₊₁) Kₖᵀ

with cₖ₊₁ the feedback at row k+1; without it the feedback would count as an innovation. filterpy's smoother does not
provide for it. The covariance of gyro noise with zero-rate readings is neglected here.
"""

from __future__ import annotations

from sinssim.data import Array, solution_of
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.estimation.consistency import scaled_solve
from sinssim.estimation.filter_result import History, Smoothed, corrected
from sinssim.estimation.state_model import NAVIGATION, ErrorModel


def smooth(model: ErrorModel, history: History, ellipsoid: Ellipsoid, algorithm: str) -> Smoothed:
    """Smooth a closed or open loop; return the estimate at the rows from all readings."""
    x, p = history.state.copy(), history.covariance.copy()
    gain, predicted = _gains(history)
    for k in range(len(x) - 2, -1, -1):
        x[k] += gain[k] @ (x[k + 1] + history.fed_back[k + 1] - history.transition[k + 1] @ x[k])
        p[k] += gain[k] @ (p[k + 1] - predicted[k]) @ gain[k].T
    state = corrected(history.navigation, x, ellipsoid, model.axes)
    total = history.compensated + x
    blocks = model.blocks[len(NAVIGATION) :]
    return Smoothed(
        history.time,
        solution_of(history.time, state, algorithm),
        {block.name: total[:, model.slices[block.name]] for block in blocks},
        p,
    )


def _gains(history: History) -> tuple[Array, Array]:
    """Return Kₖ and P⁻ₖ₊₁ for all rows but the last, (R−1, n, n) each."""
    phi = history.transition[1:]
    across = history.covariance[:-1] @ phi.transpose(0, 2, 1)
    predicted = phi @ across + history.noise[1:]
    return scaled_solve(predicted, across.transpose(0, 2, 1)).transpose(0, 2, 1), predicted
