"""The registry of attitude algorithms: adding one takes a file under `sinssim/strapdown/` and a line here.

It stands apart from the algorithms, so that listing them needs no compiler. What a file holds: see
`docs/adding-an-algorithm.md`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Algorithm:
    """An attitude algorithm as a person chooses it.

    Attributes:
        sentence: what it is, for a person.
        module: file under `sinssim/strapdown/` that holds it.
        variant: values for the file's constants; those not named keep the value written in the file.
        windowed: whether the file brings a whole engine, which works on windows of samples.
    """

    sentence: str
    module: str
    variant: Mapping[str, int | bool] = field(default_factory=dict)
    windowed: bool = False

    @property
    def samples(self) -> int:
        """Number of samples that one update takes."""
        return self.variant.get("SAMPLES", 1)

    @property
    def sample_by_sample(self) -> bool:
        """Whether it advances by one sample at a time, as the three-rate schedule needs."""
        return self.samples == 1 and not self.windowed

    @property
    def needs_equal_intervals(self) -> bool:
        """Whether its coefficients hold for samples of one length only."""
        return self.samples > 1 or bool(self.variant.get("PREVIOUS", False))


_ORDINAL = ("", "first", "second", "third", "fourth")


def _poisson(order: int, orthonormal: bool) -> Algorithm:
    end = ", re-orthonormalised after each step" if orthonormal else ""
    return Algorithm(
        f"direction cosine matrix, {_ORDINAL[order]}-order Taylor step in the plain increment{end}",
        "poisson",
        {"ORDER": order, "COMPENSATED": False, "ORTHONORMAL": orthonormal},
    )


def _quaternion(order: int, normalized: bool) -> Algorithm:
    end = ", normalised after each step" if normalized else ""
    return Algorithm(
        f"quaternion (8.18), {_ORDINAL[order]}-order Picard step in the plain increment{end}",
        "quaternion_picard",
        {"ORDER": order, "NORMALIZED": normalized},
    )


REGISTRY: dict[str, Algorithm] = {
    "quaternion": Algorithm(
        "quaternion relative to the navigation frame (8.18), advanced by the exact rotation of each interval",
        "quaternion",
    ),
    "poisson": Algorithm(
        "direction cosine matrix from Poisson's equation, fourth-order steps, never re-orthonormalised", "poisson"
    ),
    "euler": Algorithm("roll, pitch and heading integrated as such (Runge-Kutta 4), singular at pitch ±90°", "euler"),
    "poisson-1": _poisson(1, False),
    "poisson-2": _poisson(2, False),
    "poisson-3": _poisson(3, False),
    "poisson-4": _poisson(4, False),
    "poisson-1-ortho": _poisson(1, True),
    "poisson-2-ortho": _poisson(2, True),
    "poisson-3-ortho": _poisson(3, True),
    "poisson-4-ortho": _poisson(4, True),
    "quaternion-1": _quaternion(1, False),
    "quaternion-2": _quaternion(2, False),
    "quaternion-3": _quaternion(3, False),
    "quaternion-4": _quaternion(4, False),
    "quaternion-1-norm": _quaternion(1, True),
    "quaternion-2-norm": _quaternion(2, True),
    "quaternion-3-norm": _quaternion(3, True),
    "quaternion-4-norm": _quaternion(4, True),
    "two-quaternions": Algorithm(
        "two quaternions (8.19), body to inertial and navigation to inertial, second-order Picard steps",
        "two_quaternions",
    ),
    "rotation-vector-1": Algorithm(
        "rotation vector from one sample: no coning or sculling compensation", "rotation_vector", {"SAMPLES": 1}
    ),
    "rotation-vector-1p": Algorithm(
        "rotation vector with coning and sculling from one sample and the previous one",
        "rotation_vector",
        {"SAMPLES": 1, "PREVIOUS": True},
    ),
    "rotation-vector-2": Algorithm(
        "rotation vector with two-sample coning and sculling", "rotation_vector", {"SAMPLES": 2}
    ),
    "rotation-vector-3": Algorithm(
        "rotation vector with three-sample coning and sculling", "rotation_vector", {"SAMPLES": 3}
    ),
    "rotation-vector-4": Algorithm(
        "rotation vector with four-sample coning and sculling", "rotation_vector", {"SAMPLES": 4}
    ),
    "functional-iteration": Algorithm(
        "quaternion, velocity and position iterated to rounding on windows of eight samples (iNavFIter)",
        "functional_iteration",
        windowed=True,
    ),
}
"""Every algorithm by name. The first three share high-order compensated increments."""
