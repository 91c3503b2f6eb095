"""sinssim: an end-to-end simulator of strapdown inertial navigation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

__version__ = "0.1.0"

if TYPE_CHECKING:
    from sinssim.algorithms import ALGORITHMS
    from sinssim.calibration.calibrate import calibrate
    from sinssim.calibration.result import CalibrationResult
    from sinssim.data import ImuData, Measurements, NavSolution, NavState, SingularityEvent
    from sinssim.earth.models import ELLIPSOIDS, GRAVITY_MODELS
    from sinssim.ensembles.result import EnsembleResult
    from sinssim.ensembles.running.run import ensemble
    from sinssim.error_budget.analyse import budget
    from sinssim.error_budget.result import BudgetResult
    from sinssim.errors import InputError, RunError, SinssimError, SinssimWarning
    from sinssim.estimation.estimate import estimate
    from sinssim.estimation.result import Estimate, Innovations
    from sinssim.frames import FRAMES
    from sinssim.logs.load import load_log
    from sinssim.mechanization import Mechanization
    from sinssim.own_content.registry import use
    from sinssim.recording.finished.run_streams import load_streams
    from sinssim.scenario.load import load_scenario
    from sinssim.scenario.schema import Scenario
    from sinssim.scenario.true_motion import block_of
    from sinssim.sensors.imu.emulate import emulate
    from sinssim.sensors.imu.grades import GRADES
    from sinssim.simulation.execute import run
    from sinssim.simulation.result import RunResult
    from sinssim.strapdown.nav_error import NavError, navigation_error
    from sinssim.strapdown.navigate import navigate
    from sinssim.trades.result import TradeResult
    from sinssim.trades.running.compare import compare
    from sinssim.trades.schema import TradeStudy
    from sinssim.truth.curve import Curve
    from sinssim.truth.source import fly
    from sinssim.truth.trajectory import Trajectory

__all__ = [
    "ALGORITHMS",
    "ELLIPSOIDS",
    "FRAMES",
    "GRADES",
    "GRAVITY_MODELS",
    "BudgetResult",
    "CalibrationResult",
    "Curve",
    "EnsembleResult",
    "Estimate",
    "ImuData",
    "Innovations",
    "InputError",
    "Measurements",
    "Mechanization",
    "NavError",
    "NavSolution",
    "NavState",
    "RunError",
    "RunResult",
    "Scenario",
    "SingularityEvent",
    "SinssimError",
    "SinssimWarning",
    "TradeResult",
    "TradeStudy",
    "Trajectory",
    "block_of",
    "budget",
    "calibrate",
    "compare",
    "emulate",
    "ensemble",
    "estimate",
    "fly",
    "load_log",
    "load_scenario",
    "load_streams",
    "navigate",
    "navigation_error",
    "run",
    "use",
]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "ALGORITHMS": "sinssim.algorithms",
        "BudgetResult": "sinssim.error_budget.result",
        "CalibrationResult": "sinssim.calibration.result",
        "Curve": "sinssim.truth.curve",
        "ELLIPSOIDS": "sinssim.earth.models",
        "EnsembleResult": "sinssim.ensembles.result",
        "Estimate": "sinssim.estimation.result",
        "FRAMES": "sinssim.frames",
        "GRADES": "sinssim.sensors.imu.grades",
        "GRAVITY_MODELS": "sinssim.earth.models",
        "ImuData": "sinssim.data",
        "Innovations": "sinssim.estimation.result",
        "InputError": "sinssim.errors",
        "Measurements": "sinssim.data",
        "Mechanization": "sinssim.mechanization",
        "NavError": "sinssim.strapdown.nav_error",
        "NavSolution": "sinssim.data",
        "NavState": "sinssim.data",
        "RunError": "sinssim.errors",
        "RunResult": "sinssim.simulation.result",
        "Scenario": "sinssim.scenario.schema",
        "SingularityEvent": "sinssim.data",
        "SinssimError": "sinssim.errors",
        "SinssimWarning": "sinssim.errors",
        "TradeResult": "sinssim.trades.result",
        "TradeStudy": "sinssim.trades.schema",
        "Trajectory": "sinssim.truth.trajectory",
        "block_of": "sinssim.scenario.true_motion",
        "budget": "sinssim.error_budget.analyse",
        "calibrate": "sinssim.calibration.calibrate",
        "compare": "sinssim.trades.running.compare",
        "emulate": "sinssim.sensors.imu.emulate",
        "ensemble": "sinssim.ensembles.running.run",
        "estimate": "sinssim.estimation.estimate",
        "fly": "sinssim.truth.source",
        "load_log": "sinssim.logs.load",
        "load_scenario": "sinssim.scenario.load",
        "load_streams": "sinssim.recording.finished.run_streams",
        "navigate": "sinssim.strapdown.navigate",
        "navigation_error": "sinssim.strapdown.nav_error",
        "run": "sinssim.simulation.execute",
        "use": "sinssim.own_content.registry",
    },
)
