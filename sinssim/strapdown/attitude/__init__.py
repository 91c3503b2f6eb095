"""The registry of attitude algorithms: adding one takes a file under `sinssim/strapdown/attitude/` and a line here.

It is separate from the algorithms, so that listing them needs no compiler. `docs/extending/algorithm.md` describes the
files.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from sinssim.errors import InputError, shortened
from sinssim.system.extensions import Item, Outline
from sinssim.system.registries import Registry, Sentences, sentence_of


@dataclass(frozen=True)
class Algorithm:
    """The entry of an attitude algorithm."""

    name: str  # its name in scenarios
    sentence: str  # description
    module: str  # its file under `sinssim/strapdown/`, for example "attitude.quaternion"
    # values for the file's constants; others keep the value in the file
    variant: Mapping[str, int | bool] = field(default_factory=dict)
    windowed: bool = False  # whether the file has a complete engine, which works on windows of samples
    problem: str = ""  # why the entry cannot be used; "" if it can
    path: str = ""  # its file, of an algorithm outside the package; "" otherwise

    @property
    def samples(self) -> int:
        """Number of samples per update."""
        return self.variant.get("SAMPLES", 1)

    @property
    def sample_by_sample(self) -> bool:
        """Whether it advances by one sample at a time, as the three-rate schedule needs."""
        return self.samples == 1 and not self.windowed

    @property
    def needs_equal_intervals(self) -> bool:
        """Whether its coefficients hold only for samples of equal length."""
        return self.samples > 1 or bool(self.variant.get("PREVIOUS", False))


def by_name(*entries: Algorithm) -> dict[str, Algorithm]:
    """Return algorithms by name; a duplicate name is marked, and refused when chosen."""
    registry: dict[str, Algorithm] = {}
    for entry in entries:
        before = registry.get(entry.name)
        if before is not None:
            entry = replace(
                before,
                problem=f"{__file__} has the name twice, for the files {before.module} and {entry.module}; give one of "
                "them another name.",
            )
        registry[entry.name] = entry
    return registry


_ORDINAL = ("", "first", "second", "third", "fourth")


def _poisson(name: str, order: int, orthonormal: bool) -> Algorithm:
    end = ", re-orthonormalised after each step" if orthonormal else ""
    return Algorithm(
        name,
        f"direction cosine matrix, {_ORDINAL[order]}-order Taylor step in the plain increment{end}",
        "attitude.poisson",
        {"ORDER": order, "COMPENSATED": False, "ORTHONORMAL": orthonormal},
    )


def _quaternion(name: str, order: int, normalized: bool) -> Algorithm:
    end = ", normalised after each step" if normalized else ""
    return Algorithm(
        name,
        f"quaternion (8.18), {_ORDINAL[order]}-order Picard step in the plain increment{end}",
        "attitude.quaternion_picard",
        {"ORDER": order, "NORMALIZED": normalized},
    )


_SHIPPED = by_name(
    Algorithm(
        "quaternion",
        "quaternion relative to the navigation frame (8.18), advanced by the exact rotation of each interval",
        "attitude.quaternion",
    ),
    Algorithm(
        "poisson",
        "direction cosine matrix from Poisson's equation, fourth-order steps, never re-orthonormalised",
        "attitude.poisson",
    ),
    Algorithm(
        "euler", "roll, pitch and heading, integrated by Runge-Kutta 4, singular at pitch ±90°", "attitude.euler"
    ),
    _poisson("poisson-1", 1, False),
    _poisson("poisson-2", 2, False),
    _poisson("poisson-3", 3, False),
    _poisson("poisson-4", 4, False),
    _poisson("poisson-1-ortho", 1, True),
    _poisson("poisson-2-ortho", 2, True),
    _poisson("poisson-3-ortho", 3, True),
    _poisson("poisson-4-ortho", 4, True),
    _quaternion("quaternion-1", 1, False),
    _quaternion("quaternion-2", 2, False),
    _quaternion("quaternion-3", 3, False),
    _quaternion("quaternion-4", 4, False),
    _quaternion("quaternion-1-norm", 1, True),
    _quaternion("quaternion-2-norm", 2, True),
    _quaternion("quaternion-3-norm", 3, True),
    _quaternion("quaternion-4-norm", 4, True),
    Algorithm(
        "two-quaternions",
        "two quaternions (8.19), body to inertial and navigation to inertial, second-order Picard steps",
        "attitude.two_quaternions",
    ),
    Algorithm(
        "rotation-vector-1",
        "rotation vector from one sample: no coning or sculling compensation",
        "attitude.rotation_vector",
        {"SAMPLES": 1},
    ),
    Algorithm(
        "rotation-vector-1p",
        "rotation vector with coning and sculling from one sample and the previous one",
        "attitude.rotation_vector",
        {"SAMPLES": 1, "PREVIOUS": True},
    ),
    Algorithm(
        "rotation-vector-2",
        "rotation vector with two-sample coning and sculling",
        "attitude.rotation_vector",
        {"SAMPLES": 2},
    ),
    Algorithm(
        "rotation-vector-3",
        "rotation vector with three-sample coning and sculling",
        "attitude.rotation_vector",
        {"SAMPLES": 3},
    ),
    Algorithm(
        "rotation-vector-4",
        "rotation vector with four-sample coning and sculling",
        "attitude.rotation_vector",
        {"SAMPLES": 4},
    ),
    Algorithm(
        "functional-iteration",
        "quaternion, velocity and position iterated to rounding on windows of eight samples (iNavFIter)",
        "attitude.functional_iteration",
        windowed=True,
    ),
)
"""The algorithms of the package. The first three share high-order compensated increments."""

MEASURED_ATTITUDE = "measured-attitude"
"""The algorithm in a scenario with a measured attitude."""

PLATFORM = "platform"
"""The algorithm in a scenario with a gimballed platform."""

_NO_ALGORITHM = {
    MEASURED_ATTITUDE: "none: velocity and position with the attitude measured by imu.sensor_set, in inertial axes",
    PLATFORM: "none: the accelerometers of imu.sensor_set are on a platform that rotates with the frame; attitude "
    "from its gimbals",
}


def _of_file(item: Item, content: Outline) -> Algorithm:
    """Return the entry of an algorithm outside the package."""
    of_interval = {key: value for key in ("SAMPLES", "PREVIOUS") if (value := content.constant(key, None)) is not None}
    return Algorithm(
        item.name,
        sentence_of(item, content),
        item.file.stem,
        of_interval if "turn_k" in content.names else {},
        windowed="engine" in content.names,
        path=str(item.file),
    )


REGISTRY: Registry[Algorithm] = Registry("algorithms", "algorithm", _SHIPPED, _of_file, _NO_ALGORITHM)
"""All algorithms by name."""

ALGORITHMS: Mapping[str, str] = Sentences(REGISTRY)
"""All algorithms by name, with a description each."""

SCENARIO_ALGORITHMS: Mapping[str, str] = Sentences(REGISTRY, _NO_ALGORITHM)
"""The names of algorithms in scenarios."""

TAKEN = ("truth", "reference", "ideal", "measured", "compensated", "aided", "smoothed", "backward")
"""Names of other motions and readings of a run, which no solution may have."""


_WHOLE = 2e-6  # relative tolerance of a whole ratio of rates: 33.3333 Hz divides 100 Hz
_NEAR = 0.01  # absolute tolerance of a whole ratio


def whole_ratio(fast: float, slow: float) -> int | None:
    """Return the ratio of two rates if it is a whole number of at least 1 within the precision of rates, else None."""
    ratio = fast / slow
    whole = round(ratio)
    return whole if whole >= 1 and abs(ratio - whole) <= min(_WHOLE * whole, _NEAR) else None


def three_rates(rates_hz: Iterable[float]) -> tuple[float, float, float]:
    """Return the fast, the medium and the slow rate, Hz.

    Two rates are that of the attitude, and that of velocity and position.
    """
    try:
        rates = tuple(float(rate) for rate in rates_hz)
    except (TypeError, ValueError, OverflowError):
        rates = ()
    if isinstance(rates_hz, str | bytes) or len(rates) not in (2, 3) or not all(map(math.isfinite, rates)):
        raise InputError(
            f"rates_hz = {shortened(str(rates_hz))} must be three finite numbers, Hz: the rates of the fast, medium "
            "and slow part; or two: the rate of attitude, and that of velocity and position."
        )
    return rates[0], rates[1], rates[-1]


def schedule(rates_hz: tuple[float, float, float], data_hz: float) -> tuple[int, int, int]:
    """Return how many times the fast rate is in the data's, the medium rate in the fast, and the slow rate in the
    medium one."""
    ratios = []
    above, above_name = data_hz, "the data's rate"
    for name, rate in zip(("fast", "medium", "slow"), rates_hz, strict=True):
        if not (math.isfinite(rate) and rate > 0.0):
            raise InputError(f"rates_hz: the {name} rate, {rate} Hz, must be positive.")
        ratio, whole = above / rate, whole_ratio(above, rate)
        if whole is None:
            low = max(math.floor(ratio), 1)
            near = " or ".join(f"{above / n:.9g}" for n in dict.fromkeys((low, low + 1 if ratio > 1.0 else 1)))
            raise InputError(
                f"rates_hz: the {name} rate, {rate:g} Hz, does not divide {above_name}, {above:.6g} Hz, a whole number "
                f"of times; use {near} Hz."
            )
        ratios.append(whole)
        above, above_name = above / whole, f"the {name} rate"
    return ratios[0], ratios[1], ratios[2]


ORDER = re.compile(r"-(\d+p?)(-\w+)?$")
"""Ending of an algorithm's name: its order or number of samples, and its variant."""


def family(algorithm: str) -> str:
    """Return the family of an algorithm, its name without order and variant: "poisson" of "poisson-3-ortho"."""
    return ORDER.sub("", algorithm)
