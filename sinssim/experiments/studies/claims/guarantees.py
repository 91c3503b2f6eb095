"""What each attitude algorithm guarantees of norm and orthogonality: exactly, to rounding, or to an order only.

A step by the angle φ = ‖Δθ‖ multiplies a quaternion of norm 1 by the truncated series T_p(iφ/2) of the exponential
function, and the eigenvalues of a direction cosine matrix by T_p(iφ), where p is the order of the step. Their
magnitudes give, to the leading term,

    norm of a quaternion    φ²/8    φ⁴/128   −φ⁴/384   −φ⁶/9216     p = 1…4
    BBᵀ − I of a matrix     φ²      φ⁴/4     −φ⁴/12    −φ⁶/72

for each step. The number of steps grows as 1/h, so that the defect after a given time is of the order h¹, h³, h³, h⁵.
"""

from __future__ import annotations

from dataclasses import dataclass

from sinssim.algorithms import REGISTRY, family

EXACTLY = "exactly"
ROUNDING = "to rounding"
ORDER = "to an order"
OPEN = "to the fit of its polynomials"

_POWER = {1: 1, 2: 3, 3: 3, 4: 5}
_NORM_STEP = {1: "φ²/8", 2: "φ⁴/128", 3: "−φ⁴/384", 4: "−φ⁶/9216"}
_MATRIX_STEP = {1: "φ²", 2: "φ⁴/4", 3: "−φ⁴/12", 4: "−φ⁶/72"}


@dataclass(frozen=True)
class Guarantee:
    """What an attitude algorithm guarantees.

    Attributes:
        condition: of the algorithm's own variables: norm, orthogonality, or none.
        kept: `EXACTLY`, `ROUNDING`, `ORDER` or `OPEN`.
        reason: why.
        order: power of the interval with which the defect after a given time shrinks; None if it is not of an order.
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
    """Return what an algorithm guarantees of the norm or orthogonality of its variables.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.

    Returns:
        The guarantee; of an algorithm unknown here, that nothing is known.
    """
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
