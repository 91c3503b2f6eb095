"""The registry of navigation frames, and the radii of curvature and vertical channels that a scenario may choose.

A new frame takes a file under `sinssim/strapdown/frames/` and an entry here (`docs/extending/frame.md`). The registry
stands apart from the frames' files, so that checking a scenario and listing the choices needs no compiler.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from sinssim.algorithms import REGISTRY
from sinssim.errors import InputError

FILTER_ALGORITHM = "quaternion"
"""By which a scenario's filter navigates: it corrects the engine from stretch to stretch in the level frame."""


@dataclass(frozen=True)
class Frame:
    """A navigation frame as a person chooses it.

    Attributes:
        sentence: what it is, for a person.
        file: the file under `sinssim/strapdown/frames/` that navigates in it, without ".py"; it may serve several.
        has_radii: whether it works with radii of curvature, so that simplified ones make a difference.
        takes_route: whether it is oriented along a route.
        passes_poles: whether it can be used at the Earth's poles.
        has_three_rates: whether the three-rate schedule works in it.
    """

    sentence: str
    file: str
    has_radii: bool = True
    takes_route: bool = False
    passes_poles: bool = True
    has_three_rates: bool = False


FRAME_REGISTRY: dict[str, Frame] = {
    "level": Frame(
        "local geodetic level with north orientation (north, east, down)",
        "level",
        passes_poles=False,
        has_three_rates=True,
    ),
    "wander": Frame(
        "local level whose azimuth does not turn relative to the Earth about the vertical; over the poles too",
        "azimuth",
    ),
    "free-azimuth": Frame(
        "local level whose azimuth does not turn in inertial space about the vertical; over the poles too",
        "azimuth",
    ),
    "transverse": Frame(
        "local level oriented along an orthodrome: spherical coordinates whose equator is the route, "
        "and which cannot be used near its poles",
        "azimuth",
        takes_route=True,
    ),
    "inertial": Frame("Earth-centred inertial, with geodetic output", "inertial", has_radii=False),
}
"""Every navigation frame by name."""

FRAMES: dict[str, str] = {name: frame.sentence for name, frame in FRAME_REGISTRY.items()}

CURVATURES: dict[str, str] = {
    "exact": "radii of curvature of the ellipsoid",
    "simplified": "the chapter's first-order radii (8.16), in error by up to 4.5e-5",
}

VERTICALS: dict[str, str] = {
    "free": "pure inertial height, unstable: an error grows 277-fold in an hour",
    "baro-loop": "third-order loop to a height reference (baro-inertial)",
    "truth": "height and vertical velocity held to the height reference",
}

BARO_TIME_CONSTANT = 50.0
"""Time constant of the baro loop where none is given, s."""

SLOW_QUANTITIES: dict[str, str] = {
    "hold": "what the slow part computed is held until it computes again",
    "extrapolate": "what the slow part computed is extrapolated linearly from its last two values",
}


def listed(names: Iterable[str]) -> str:
    """Return names as a sentence lists them: "a, b and c".

    Args:
        names: the names.

    Returns:
        The text.
    """
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def frames_that(wanted: Callable[[Frame], bool]) -> list[str]:
    """Return the names of the frames with a property.

    Args:
        wanted: the property.

    Returns:
        Names, in the order of the registry.
    """
    return [name for name, frame in FRAME_REGISTRY.items() if wanted(frame)]


def check_curvature(frame: str, curvature: str) -> None:
    """Raise for simplified radii of curvature in a frame that has none.

    Args:
        frame: one of `FRAMES`.
        curvature: one of `CURVATURES`.

    Raises:
        InputError: they would have no effect.
    """
    if curvature != "exact" and not FRAME_REGISTRY[frame].has_radii:
        raise InputError(
            f'curvature = "{curvature}" would have no effect: frame = "{frame}" has no radii of curvature; '
            f"{listed(frames_that(lambda entry: entry.has_radii))} have."
        )


def check_three_rates(algorithm: str, frame: str) -> None:
    """Raise for an algorithm or a frame that cannot be run at three rates.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.
        frame: one of `FRAMES`.

    Raises:
        InputError: the schedule works with the attitude algorithms that advance sample by sample, in the level frame.
    """
    if not FRAME_REGISTRY[frame].has_three_rates:
        able = listed(frames_that(lambda entry: entry.has_three_rates))
        raise InputError(f"rates_hz: the three-rate schedule works in the frame {able}, not in {frame}.")
    if not REGISTRY[algorithm].sample_by_sample:
        raise InputError(
            f"rates_hz: the fast part advances the attitude sample by sample, {algorithm} by several at once; "
            "quaternion, poisson, euler and their like, or rotation-vector-1p, would do."
        )
