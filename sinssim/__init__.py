"""sinssim: an end-to-end simulator of strapdown inertial navigation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

__version__ = "0.1.0"

if TYPE_CHECKING:
    from sinssim.analyses.alignment_result import AlignmentResult as AlignmentResult
    from sinssim.analyses.alignment_session import align as align
    from sinssim.analyses.calibration_result import CalibrationResult as CalibrationResult
    from sinssim.analyses.error_budget.budget_result import BudgetResult as BudgetResult
    from sinssim.analyses.error_budget.covariance_budget import budget as budget
    from sinssim.analyses.filter_tuning_result import TuningResult as TuningResult
    from sinssim.analyses.filter_tuning_search import tune as tune
    from sinssim.analyses.turntable_calibration import calibrate as calibrate
    from sinssim.data import ImuData as ImuData
    from sinssim.data import Measurements as Measurements
    from sinssim.data import NavSolution as NavSolution
    from sinssim.data import NavState as NavState
    from sinssim.data import SingularityEvent as SingularityEvent
    from sinssim.earth.ellipsoids import ELLIPSOIDS as ELLIPSOIDS
    from sinssim.earth.ellipsoids import GRAVITY_MODELS as GRAVITY_MODELS
    from sinssim.errors import InputError as InputError
    from sinssim.errors import RunError as RunError
    from sinssim.errors import SinssimError as SinssimError
    from sinssim.errors import SinssimWarning as SinssimWarning
    from sinssim.estimation.estimate import estimate as estimate
    from sinssim.estimation.filter_result import Estimate as Estimate
    from sinssim.estimation.filter_result import Innovations as Innovations
    from sinssim.estimation.state_model import Block as Block
    from sinssim.estimation.state_model import ErrorModel as ErrorModel
    from sinssim.estimation.state_model import error_model as error_model
    from sinssim.experiments.ensembles.ensemble_result import EnsembleResult as EnsembleResult
    from sinssim.experiments.ensembles.ensemble_run import ensemble as ensemble
    from sinssim.experiments.run.finished_runs import load_streams as load_streams
    from sinssim.experiments.run.run_execution import run as run
    from sinssim.experiments.run.run_result import PlaneRun as PlaneRun
    from sinssim.experiments.run.run_result import Run as Run
    from sinssim.experiments.studies.study_results import StudyResult as StudyResult
    from sinssim.experiments.studies.study_schema import Study as Study
    from sinssim.experiments.studies.trade_result import TradeResult as TradeResult
    from sinssim.experiments.studies.trade_schema import TradeStudy as TradeStudy
    from sinssim.experiments.study import compare as compare
    from sinssim.logs.recorded_log import RecordedLog as RecordedLog
    from sinssim.recording.result import Result as Result
    from sinssim.scenario.load import load_log as load_log
    from sinssim.scenario.load import load_scenario as load_scenario
    from sinssim.scenario.schema import Scenario as Scenario
    from sinssim.scenario.true_motion import block_of as block_of
    from sinssim.scenario.true_motion import fly as fly
    from sinssim.sensors.imu.emulation import emulate as emulate
    from sinssim.sensors.imu.grades import GRADES as GRADES
    from sinssim.strapdown.attitude import ALGORITHMS as ALGORITHMS
    from sinssim.strapdown.frames import FRAMES as FRAMES
    from sinssim.strapdown.mechanization import Mechanization as Mechanization
    from sinssim.strapdown.navigate import navigate as navigate
    from sinssim.strapdown.navigation_error import NavError as NavError
    from sinssim.strapdown.navigation_error import navigation_error as navigation_error
    from sinssim.system.registries import use as use
    from sinssim.truth.curve import Curve as Curve
    from sinssim.truth.trajectory import Trajectory as Trajectory

__getattr__, __dir__, __all__ = on_first_use(__name__)
