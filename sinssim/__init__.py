"""sinssim: an end-to-end simulator of strapdown inertial navigation."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from sinssim.data import ImuData, Measurements, NavSolution, NavState, SingularityEvent
    from sinssim.earth import ELLIPSOIDS, GRAVITY_MODELS
    from sinssim.errors import InputError, RunError, SinssimError
    from sinssim.estimation.estimate import estimate
    from sinssim.scenario import Scenario, load_scenario
    from sinssim.sensors import GRADES, emulate
    from sinssim.simulation import RunResult, run
    from sinssim.strapdown import ALGORITHMS, FRAMES
    from sinssim.strapdown.navigate import navigate
    from sinssim.truth import Trajectory
    from sinssim.truth.fly import fly

# Loaded on first use, so that `import sinssim` (and `sinssim --help`) stays light.
_HOME = {
    "ImuData": "data",
    "NavSolution": "data",
    "NavState": "data",
    "SingularityEvent": "data",
    "ELLIPSOIDS": "earth",
    "GRAVITY_MODELS": "earth",
    "InputError": "errors",
    "RunError": "errors",
    "SinssimError": "errors",
    "RunResult": "simulation",
    "run": "simulation",
    "Scenario": "scenario",
    "load_scenario": "scenario",
    "GRADES": "sensors",
    "emulate": "sensors",
    "Measurements": "data",
    "estimate": "estimation.estimate",
    "ALGORITHMS": "strapdown",
    "FRAMES": "strapdown",
    "navigate": "strapdown",
    "Trajectory": "truth",
    "fly": "truth",
}

__all__ = [
    "ALGORITHMS", "ELLIPSOIDS", "FRAMES", "GRADES", "GRAVITY_MODELS",
    "ImuData", "InputError", "Measurements", "NavSolution", "NavState", "RunError", "RunResult", "Scenario",
    "SingularityEvent", "SinssimError", "Trajectory",
    "emulate", "estimate", "fly", "load_scenario", "navigate", "run",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sinssim' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"sinssim.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
