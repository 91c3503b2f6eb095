"""Former names of modules and of names in them: they still work, with a warning that gives the current name."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

MOVED = {
    "earth_models": "earth.models",
    "aided": "estimation.from_scenario.aided_run estimation.from_scenario.truth_comparison "
    "estimation.from_scenario.filter_model",
    "alignment.figures": "recording.figures.alignment",
    "alignment.initial": "alignment.initial_conditions",
    "cli.main": "cli.process cli.app",
    "estimation.actual": "estimation.checks.against_truth",
    "estimation.coarse": "estimation.initial_alignment.start",
    "estimation.consistency": "estimation.checks.consistency",
    "estimation.health": "estimation.checks.divergence_checks",
    "estimation.in_motion": "estimation.initial_alignment.in_motion",
    "estimation.measurements.intake": "estimation.intake",
    "estimation.observability": "estimation.checks.observability",
    "estimation.alignment_in_motion": "estimation.initial_alignment.in_motion",
    "estimation.filter_start": "estimation.initial_alignment.start",
    "estimation.filter_states": "estimation.from_scenario.filter_states",
    "estimation.measurements_in": "estimation.intake",
    "estimation.memory": "estimation.from_scenario.memory",
    "estimation.scenario_filter": "estimation.from_scenario.aided_run estimation.from_scenario.truth_comparison "
    "estimation.from_scenario.filter_model",
    "estimation.scenario_model": "estimation.from_scenario.filter_model",
    "estimation.true_parameters": "estimation.from_scenario.true_parameters",
    "estimation.measurement_models": "estimation.measurements.kind",
    "estimation.observation": "estimation.measurements.kind",
    "interrupt": "system.signals",
    "names": "algorithms frames scenario.sections.filter",
    "nav_error": "strapdown.nav_error",
    "rates": "algorithms frames",
    "recording.blueprints": "recording.rerun.views",
    "recording.directory": "recording.store.directory",
    "recording.filter_pictures": "recording.rerun.run.log_filter",
    "recording.filter_report": "recording.report.run.filter",
    "recording.filter_streams": "recording.store.filter_streams",
    "recording.filter_summary": "recording.store.summaries.filter_summary",
    "recording.noise": "recording.rerun.noise",
    "recording.noise_figure": "recording.figures.noise",
    "recording.page": "recording.report.page",
    "recording.parquet": "recording.store.parquet",
    "recording.pictures": "recording.rerun.run.log_run",
    "recording.plot": "recording.report.plot",
    "recording.report_sensors": "recording.report.run.sensors",
    "recording.rrd": "recording.rerun.rrd",
    "recording.scene": "recording.rerun.scene",
    "recording.rerun.filter_views_data": "recording.rerun.run.log_filter",
    "recording.rerun.run_views_data": "recording.rerun.run.log_run",
    "recording.sensed": "recording.sensor_comparison",
    "recording.session": "recording.rerun.alignment",
    "recording.streams": "recording.store.streams",
    "recording.summary": "recording.store.summary",
    "recording.track": "recording.report.run.track",
    "recording.viewer": "recording.rerun.viewer",
    "recording.writer": "recording.rerun.writer",
    "scenario.aiding": "scenario.sections.aiding sensors.aiding.gnss sensors.aiding.barometer "
    "sensors.aiding.magnetometer sensors.aiding.airspeed sensors.aiding.odometer sensors.aiding.standstill "
    "sensors.aiding.attitude_reference sensors.aiding.star_tracker sensors.aiding.master sensors.aiding.base.sensor",
    "scenario.compensation": "scenario.sections.compensation",
    "scenario.datasheet": "sensors.imu.datasheet",
    "scenario.faults": "scenario.sections.within_imu.faults",
    "scenario.filter": "scenario.sections.filter",
    "scenario.grades": "sensors.imu.grades",
    "scenario.pilot": "truth.flight.dead_reckoning",
    "scenario.idle": "scenario.notes",
    "scenario.imu": "scenario.sections.imu",
    "scenario.isolator": "scenario.sections.isolator",
    "scenario.laser_gyro": "scenario.sections.within_imu.laser_gyro",
    "scenario.legs": "scenario.sections.flight",
    "scenario.motion": "scenario.sections.motion",
    "scenario.never": "scenario.notes",
    "scenario.section": "section",
    "scenario.sensor_set": "scenario.sections.within_imu.sensor_set",
    "sensors.accelerometers": "sensors.sets.accelerometers",
    "sensors.aiding.lag": "sensors.aiding.base.lag",
    "sensors.aiding.lever_arm": "sensors.aiding.base.lever_arm",
    "sensors.aiding.noise": "sensors.aiding.base.random_errors",
    "sensors.aiding.readings": "sensors.aiding.base.sensor",
    "sensors.allan": "noise_identification.allan",
    "sensors.attitude_sensor": "sensors.sets.attitude_sensor",
    "sensors.channels": "noise_identification.channels",
    "sensors.compensation": "sensors.imu.compensation",
    "sensors.elements": "sensors.imu.placement",
    "sensors.emulate": "sensors.imu.emulate",
    "sensors.error_checks": "sensors.imu.error_validation",
    "sensors.error_kernel": "sensors.imu.error_kernel",
    "sensors.expectation_report": "recording.tables.expectation",
    "sensors.flicker": "sensors.noise.flicker",
    "sensors.gauss_markov": "sensors.noise.gauss_markov",
    "sensors.imu_errors": "sensors.imu.errors",
    "sensors.lock_in": "sensors.laser_gyro.lock_in",
    "sensors.log": "logs.text.samples",
    "sensors.log_columns": "logs.text.columns",
    "sensors.log_description": "logs.text.description",
    "sensors.noise_bands": "noise_identification.bands",
    "sensors.noise_fit": "noise_identification.fit",
    "sensors.noise_likelihood": "noise_identification.likelihood",
    "sensors.noise_limits": "noise_identification.confidence",
    "sensors.noise_report": "noise_identification.report",
    "sensors.noise_table": "recording.tables.noise",
    "sensors.noise_terms": "noise_identification.terms",
    "sensors.noise_units": "noise_identification.units",
    "sensors.noise_weights": "noise_identification.weights",
    "sensors.null_shift": "sensors.laser_gyro.gas_flow",
    "sensors.pack": "sensors.imu.pack",
    "sensors.random_numbers": "sensors.noise.random_numbers",
    "sensors.rectification": "sensors.imu.rectification",
    "sensors.schuler": "sensors.error_propagation",
    "strapdown.azimuth": "strapdown.frames.azimuth",
    "strapdown.coning_sculling": "strapdown.increments.coning_sculling",
    "strapdown.euler": "strapdown.attitude.euler",
    "strapdown.fit": "strapdown.increments.fit",
    "strapdown.functional_inertial": "strapdown.iteration.functional_inertial",
    "strapdown.functional_iteration": "strapdown.iteration.functional_iteration",
    "strapdown.inertial": "strapdown.frames.inertial",
    "strapdown.interval": "strapdown.increments.interval",
    "strapdown.level": "strapdown.frames.level",
    "strapdown.parts": "strapdown.assemble",
    "strapdown.poisson": "strapdown.attitude.poisson",
    "strapdown.quaternion": "strapdown.attitude.quaternion",
    "strapdown.quaternion_picard": "strapdown.attitude.quaternion_picard",
    "strapdown.rotation_vector": "strapdown.attitude.rotation_vector",
    "strapdown.sensor_sets": "sensors.sets.reading strapdown.measured_attitude",
    "strapdown.gyro_free": "sensors.sets.gyro_free",
    "strapdown.singularity": "strapdown.attitude.singularity",
    "strapdown.stretches": "strapdown.segments",
    "strapdown.turns": "strapdown.increments.block_turns",
    "strapdown.two_quaternions": "strapdown.attitude.two_quaternions",
    "strapdown.vertical": "strapdown.frames.vertical",
    "studies.figures": "recording.figures.studies.study",
    "studies.record": "recording.rerun.study",
    "studies.report": "recording.report.studies.study",
    "studies.claim_names": "studies.schema",
    "studies.variants": "studies.schema",
    "studies.write": "recording.store.study",
    "truth.analytic": "truth.motions.analytic",
    "truth.apart": "truth.flight.subprocess_flight",
    "truth.autopilot": "truth.flight.autopilot",
    "truth.cache": "truth.flight.cache",
    "truth.coning": "truth.motions.coning",
    "truth.fly": "truth.source",
    "truth.great_circle": "truth.motions.great_circle",
    "truth.isolator": "truth.motions.isolator",
    "truth.jsbsim_flight": "truth.flight.jsbsim_flight truth.flight.flight_log",
    "truth.parked": "truth.motions.parked",
    "truth.plan": "truth.flight.leg truth.flight.autopilot",
    "truth.quadrature": "truth.motions.quadrature",
    "truth.rocking": "truth.motions.rocking",
    "truth.rotation_table": "truth.motions.rotation_table",
    "truth.swaying": "truth.motions.swaying",
    "truth.times": "truth.sample_times",
    "truth.vibration": "truth.motions.vibration",
}
"""Current names by former name, without `sinssim.`; for a divided module, all modules that have its names now."""


class _Moved(Loader):
    """Makes a module that finds its names in the modules that now have them."""

    def __init__(self, homes: Sequence[str]) -> None:
        self.homes = homes

    def exec_module(self, module: ModuleType) -> None:
        warnings.warn(
            f"{module.__name__} is now {' and '.join(self.homes)}; the former name will be removed.",
            DeprecationWarning,
            stacklevel=2,
        )

        def find(name: str) -> Any:
            for home in self.homes:
                found = importlib.import_module(home)
                if hasattr(found, name):
                    return getattr(found, name)
            raise AttributeError(f"{module.__name__} is now {' and '.join(self.homes)}, which has no {name!r}")

        module.__dict__["__getattr__"] = find


class _Finder(MetaPathFinder):
    """Finds the former names, after all existing modules."""

    def find_spec(self, fullname: str, path: Any, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return the spec of a module under its former name, None for any other."""
        homes = MOVED.get(fullname.removeprefix("sinssim.")) if fullname.startswith("sinssim.") else None
        if homes is None:
            return None
        return ModuleSpec(fullname, _Moved([f"sinssim.{home}" for home in homes.split()]))


def former_names(module: str, now: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a module in which names have changed: a former one still works, with a warning.

    Args:
        module: full name of the module.
        now: new names by former name.

    Returns:
        The function.
    """

    def find(name: str) -> Any:
        if name not in now:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        warnings.warn(
            f"{module}.{name} is now {now[name]}; the former name will be removed.", DeprecationWarning, stacklevel=2
        )
        return getattr(sys.modules[module], now[name])

    return find


def install() -> None:
    """Make the former names importable."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.append(_Finder())
