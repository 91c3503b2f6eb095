"""Makes the kernel of a batch for an attitude algorithm, a vertical channel, a gravity model and a set of errors."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, get_args

from sinssim.algorithms import REGISTRY
from sinssim.earth.kernels import EarthParameters, near_gravity_k
from sinssim.experiments.ensembles.batch import lanes, layout, variables
from sinssim.jit import inline, rebound
from sinssim.rotation.kernels import small_half_angle_series_k
from sinssim.strapdown.assemble import parts
from sinssim.strapdown.files import algorithm_file
from sinssim.strapdown.frames.radii import FORMS
from sinssim.strapdown.own_algorithm import guarded
from sinssim.system.own_content.registry import on_change

_VARIABLES = {
    4: (variables.four_k, variables.keep_four_k),
    8: (variables.eight_k, variables.keep_eight_k),
    9: (variables.nine_k, variables.keep_nine_k),
}
_IN_RANGE = {"half_angle_series_k": small_half_angle_series_k}
_ANY_HEIGHT = 1e9  # m, either way


@inline
def low_gravity_k(
    p: EarthParameters, model: int, sin_lat: float, cos_lat: float, r2: float, height: float
) -> tuple[float, float]:
    """Normal gravity, north and down, within the heights of `near_gravity_k`."""
    return near_gravity_k(p, sin_lat, cos_lat, height)


def variables_of(algorithm: str) -> int | None:
    """Return the number of an algorithm's attitude variables.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.

    Returns:
        The number; None if they are not numbers of one kind.
    """
    kinds = get_args(getattr(algorithm_file(algorithm), "Attitude", None))
    return len(kinds) if len(kinds) in _VARIABLES and set(kinds) == {float} else None


@cache
def engine(algorithm: str, gravity: int, vertical: int, curvature: str, active: int) -> Callable[..., None]:
    """Return the compiled kernel; see `lanes.navigate_lanes`.

    Args:
        algorithm: one of `sinssim.ALGORITHMS` that `served` admits.
        curvature: one of `sinssim.frames.CURVATURES`.
    """
    suffix = algorithm.replace("-", "_")
    of_algorithm = {
        name: rebound(parts(algorithm)[name], f"{name}_{suffix}_in_range", **_IN_RANGE)
        for name in ("start_k", "dcm_k", "step_k", "quaternion_k")
    }
    load, keep = _VARIABLES[variables_of(algorithm) or 4]
    constants: dict[str, Any] = {
        "ACTIVE": active, "GRAVITY": gravity, "VERTICAL": vertical, "SIMPLIFIED": curvature == "simplified",
    }  # fmt: skip
    if gravity == 0:
        constants["gravity_ned_k"] = low_gravity_k
    else:
        constants |= {"LOWEST": -_ANY_HEIGHT, "HIGHEST": _ANY_HEIGHT}
    of_layout = {name: getattr(layout, name) for name in ("parameter_k", "state_k", "keep_k", "noise_k")}
    name = f"batch_{algorithm}_{gravity}_{vertical}_{curvature}_{active}".replace("-", "_")
    made: Callable[..., None] = rebound(
        lanes.navigate_lanes, name, attitude_k=load, keep_attitude_k=keep,
        **constants, **of_algorithm, **_IN_RANGE, **of_layout, **FORMS.get(curvature, {}),
    )  # fmt: skip
    return guarded(algorithm, made) if REGISTRY[algorithm].path else made


on_change.append(engine.cache_clear)
