"""The result of a calibration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.calibration.least_squares import unobservable
from sinssim.analyses.calibration.parameters import Parameter
from sinssim.analyses.calibration.task import Estimate
from sinssim.data import Array
from sinssim.recording.result import Result
from sinssim.scenario.schema import Scenario
from sinssim.system.short_repr import html_table, short_repr

FRAMES = {
    "separate": "the axes of the table's positions, in which [turntable] gives attitudes and turns",
    "systematic": "the frame of the accelerometers: x along the sensitive axis of the forward one, y in the plane of "
    "the forward and the right one, so that the accelerometers' misalignments xy, xz and yz are zero by definition",
}
"""The frame that the misalignments of a method refer to."""


@short_repr
@dataclass(frozen=True, eq=False)
class CalibrationResult(Result):
    """The errors of a sensor block, estimated from a sequence on a turntable.

    Attributes:
        scenario: the scenario.
        method: "separate" or "systematic".
        parameters: the parameters.
        estimate: values, residuals and the last linear solution.
        dwells: beginning and end of each dwell, (P, 2) s.
        truth: true values of the parameters in the same frame, (p,) SI; None for a log.
        notes: sentences on what was found and what is not modelled.
        directory: directory of the calibration; None if none was written.
    """

    scenario: Scenario
    method: str
    parameters: tuple[Parameter, ...]
    estimate: Estimate
    dwells: Array
    truth: Array | None
    notes: tuple[str, ...]
    directory: Path | None = None

    def _repr_html_(self) -> str:
        rows = [
            (one.name, f"{value / size:.6g}" if seen else "not observable", f"{sigma / size:.3g}", unit)
            for one, value, sigma, seen in zip(self.parameters, self.values, self.sigma, self.observable, strict=True)
            for unit, size in (one.unit,)
        ]
        title = f"Calibration of {self.scenario.name}, {self.method}"
        return html_table(title, rows, ("parameter", "estimate", "1σ", "unit"))

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return [one.name for one in self.parameters]

    @property
    def values(self) -> Array:
        """Estimated values, (p,) SI; zero for what is not observable."""
        return self.estimate.values

    @property
    def covariance(self) -> Array:
        """Covariance of the estimates, (p, p) SI; what is not observable has its size before the calibration."""
        return self.estimate.solution.covariance

    @property
    def sigma(self) -> Array:
        """Standard deviations of the estimates, (p,) SI."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def observable(self) -> NDArray[np.bool_]:
        """Whether the sequence determines each parameter, (p,)."""
        return self.estimate.solution.observable

    @property
    def unobservable(self) -> list[str]:
        """What the sequence does not determine: parameters and combinations of them."""
        return unobservable(self.estimate.solution, self.names)

    @property
    def error(self) -> Array | None:
        """Estimated minus true values, (p,) SI; None for a log."""
        return None if self.truth is None else self.values - self.truth

    @property
    def normalised_error(self) -> Array | None:
        """Error over 1σ, (p,); None for a log."""
        return None if self.error is None else self.error / self.sigma

    @property
    def chi_square_of_errors(self) -> tuple[float, int] | None:
        """Sum of squares of the errors of the observable parameters by their covariance, and its degrees of freedom."""
        if self.error is None:
            return None
        seen = self.observable
        if not seen.any():
            return 0.0, 0
        error, covariance = self.error[seen], self.covariance[np.ix_(seen, seen)]
        return float(error @ np.linalg.solve(covariance, error)), int(np.count_nonzero(seen))

    @property
    def frame(self) -> str:
        """The frame that the misalignments refer to."""
        return FRAMES[self.method]
