"""The registry of navigation frames.

A new frame takes a file under `sinssim/strapdown/frames/` and an entry here (`docs/extending/frame.md`). The registry
is separate from the frames' files, so that checking a scenario and listing the choices need no compiler.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields

from sinssim.errors import InputError
from sinssim.strapdown.attitude import REGISTRY
from sinssim.system.extensions import Item, Outline
from sinssim.system.registries import Registry, Sentences, sentence_of
from sinssim.units import listed


@dataclass(frozen=True)
class Frame:
    """The entry of a navigation frame."""

    sentence: str  # description
    file: str  # its file under `sinssim/strapdown/frames/`, without ".py"; several frames may share one
    has_radii: bool = True  # whether it uses radii of curvature, so that simplified ones have an effect
    takes_route: bool = False  # whether it is oriented along a route
    passes_poles: bool = True  # whether it can be used at the Earth's poles
    has_azimuth: bool = False  # whether its x axis has a direction of its own in the local level
    has_three_rates: bool = False  # whether the three-rate schedule works in it: `solve_three_rates` in its file
    # whether its engine fits across `Problem.first`, where a filter's segment begins; the segments of a frame without
    # it are fitted by their own samples, which is less accurate at their ends
    starts_anywhere: bool = False
    path: str = ""  # its file, of a frame outside the package; "" otherwise

    @property
    def takes_azimuth(self) -> bool:
        """Whether the direction of its x axis at the start can be chosen."""
        return self.has_azimuth and not self.takes_route


_SHIPPED = {
    "level": Frame(
        "local geodetic level with north orientation (north, east, down)",
        "level",
        passes_poles=False,
        has_three_rates=True,
        starts_anywhere=True,
    ),
    "wander": Frame(
        "local level that does not rotate about the vertical relative to the Earth; also over the poles",
        "wander_free_transverse",
        has_azimuth=True,
        has_three_rates=True,
        starts_anywhere=True,
    ),
    "free-azimuth": Frame(
        "local level that does not rotate about the vertical in inertial space; also over the poles",
        "wander_free_transverse",
        has_azimuth=True,
        has_three_rates=True,
        starts_anywhere=True,
    ),
    "transverse": Frame(
        "local level oriented along a great circle: spherical coordinates with the route as equator, "
        "not usable near their poles",
        "wander_free_transverse",
        takes_route=True,
        has_azimuth=True,
        has_three_rates=True,
        starts_anywhere=True,
    ),
    "inertial": Frame(
        "Earth-centred inertial, with geodetic output",
        "inertial",
        has_radii=False,
        has_three_rates=True,
        starts_anywhere=True,
    ),
}
"""The navigation frames of the package."""


def _of_file(item: Item, content: Outline) -> Frame:
    """Return the entry of a frame outside the package."""
    flags = [field for field in fields(Frame) if field.type == "bool"]
    truths = {flag.name: content.constant(flag.name.upper(), flag.default) for flag in flags}
    truths["has_three_rates"] = "solve_three_rates" in content.names
    return Frame(sentence_of(item, content), item.file.stem, **truths, path=str(item.file))


FRAME_REGISTRY: Registry[Frame] = Registry("frames", "frame", _SHIPPED, _of_file)
"""All navigation frames by name."""

FRAMES: Mapping[str, str] = Sentences(FRAME_REGISTRY)
"""All navigation frames by name, with a description each."""

AXES: dict[str, str] = {
    "north": "velocity and attitude in north, east, down, each at its own place",
    "transported": "those of the true place carried to that of the solution without a turn about the vertical",
}
"""Ways to compare velocity and attitude at two places, see `sinssim.strapdown.navigation_error`."""


def frames_that(wanted: Callable[[Frame], bool]) -> list[str]:
    """Return the names of the frames with a property."""
    return [name for name, frame in FRAME_REGISTRY.items() if wanted(frame)]


def check_correctable(algorithm: str) -> None:
    """Raise for an algorithm that a filter cannot correct between its updates."""
    entry = REGISTRY.get(algorithm)
    if entry is not None and entry.windowed:
        raise InputError(
            f"{algorithm} processes windows of samples in a separate engine, in which a filter cannot correct the "
            f"state; every other algorithm can be corrected, for example quaternion."
        )


def check_three_rates(algorithm: str, frame: str) -> None:
    """Raise for an algorithm or a frame that cannot run at three rates."""
    if not FRAME_REGISTRY[frame].has_three_rates:
        able = listed(frames_that(lambda entry: entry.has_three_rates))
        raise InputError(f"rates_hz: the three-rate schedule works in the frames {able}, not in {frame}.")
    if not REGISTRY[algorithm].sample_by_sample:
        raise InputError(
            f"rates_hz: the fast part advances the attitude sample by sample, but {algorithm} by several at once; "
            "use quaternion, poisson, euler or one of their variants, or rotation-vector-1p."
        )
