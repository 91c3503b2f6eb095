"""The linear model of an aircraft about trimmed flight, from its flown responses to small steps of the controls.

The responses are differences of two flights with steps of opposite sign, thirty times a second: what the autopilot sees
of the airframe, its control system, actuators and engines, with the hold between two of its commands. The state space
follows from them by the eigensystem realisation algorithm (J.-N. Juang, R. S. Pappa, An eigensystem realization
algorithm for modal parameter identification and model reduction, Journal of Guidance 8, 1985): the singular values of
the Hankel matrix of the pulse responses, which are those of its balanced realisation, give the order.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.system.files import Draft
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.autopilot import INTERVAL
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_model import bring_to_start, loaded_model, quiet
from sinssim.units import FOOT

_LARGEST_ORDER = 12  # rigid body 4, actuators and control system 4, two engines' states 4
_LEAST_SHARE = 2e-5  # of the largest singular value: below it is what JSBSim's steps and the two signs leave
_WANTED = 0.03  # rate after a second of a step, rad/s, a fifth of that of a usual manoeuvre
_STEPS = (0.002, 0.15)  # range of the steps, fractions of full travel
_FIRST = 0.01
_GOOD_FIT = 0.02  # of the responses: a model of fewer states is not tried

OUTPUTS = {
    "p": ("velocities/p-rad_sec", 1.0), "q": ("velocities/q-rad_sec", 1.0), "r": ("velocities/r-rad_sec", 1.0),
    "phi": ("attitude/phi-rad", 1.0), "theta": ("attitude/theta-rad", 1.0), "beta": ("aero/beta-rad", 1.0),
    "alpha": ("aero/alpha-rad", 1.0), "climb": ("velocities/h-dot-fps", FOOT), "cas": ("velocities/vc-fps", FOOT),
}  # fmt: skip
"""Outputs by name: JSBSim's property and its factor to SI."""
LATERAL = (("aileron", "rudder"), ("p", "phi", "r", "beta"))
"""Inputs and outputs of the lateral motion."""
VERTICAL = (("elevator", "throttle"), ("q", "theta", "alpha", "climb", "cas"))
"""Inputs and outputs of the longitudinal motion; a glider has no throttle."""
_SCALES = {"climb": 0.1, "cas": 0.1}  # m/s beside rad and rad/s, so that each output counts in the singular values


@dataclass(frozen=True)
class LinearModel:
    """x' = A x + B u, y = C x, thirty times a second; y is zero at the trim."""

    a: Array  # (N, N)
    b: Array  # (N, inputs), inputs as fractions of full travel
    c: Array  # (outputs, N), SI units
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    misfit: float  # largest share of an output's response that the model misses

    def response(self, omega: Array) -> Array:
        """Return the frequency response, (frequencies, outputs, inputs), at angular frequencies, rad/s."""
        z = np.exp(1j * np.asarray(omega) * INTERVAL)
        eye = np.eye(len(self.a))
        response: Array = np.array([self.c @ np.linalg.solve(at * eye - self.a, self.b) for at in z])
        return response

    def step(self, control: str, count: int) -> Array:
        """Return the response to a unit step of a control, (count + 1, outputs)."""
        state, column = np.zeros(len(self.a)), self.b[:, self.inputs.index(control)]
        outputs = [self.c @ state]
        for _ in range(count):
            state = self.a @ state + column
            outputs.append(self.c @ state)
        return np.array(outputs)

    def poles(self) -> Array:
        """Return the poles, rad/s, complex: log z over the interval."""
        exponents: Array = np.log(np.linalg.eigvals(self.a).astype(complex)) / INTERVAL
        return exponents


@dataclass(frozen=True)
class Trim:
    """What JSBSim's trim has found."""

    alpha: float  # rad
    throttle: float  # 0 without an engine
    elevator: float
    tas: float  # m/s
    cas: float  # m/s
    theta: float  # rad


def realised(steps: Array, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> LinearModel:
    """Return the model of step responses.

    Args:
        steps: responses to unit steps, (instants, outputs, inputs), the first of them zero.
        inputs: names of the inputs.
        outputs: names of the outputs.
    """
    scale = np.array([_SCALES.get(name, 1.0) for name in outputs])
    pulses = np.diff(steps * scale[:, None], axis=0)  # Markov parameters C A^(k-1) B
    rows = len(pulses) // 2
    hankel = np.block([[pulses[i + j] for j in range(rows)] for i in range(rows)])
    u, s, vt = np.linalg.svd(hankel[:, : rows * len(inputs)], full_matrices=False)
    order = max(2, min(_LARGEST_ORDER, int(np.sum(s > _LEAST_SHARE * s[0]))))
    sized, best = steps * scale[:, None], None
    for size in range(order, 1, -1):  # a state that is only noise may be unstable: then fewer
        root = np.sqrt(s[:size])
        observe, reach = u[:, :size] * root, root[:, None] * vt[:size]
        m = len(outputs)
        a = np.linalg.lstsq(observe[:-m], observe[m:], rcond=None)[0]
        c = observe[:m] / scale[:, None]
        model = LinearModel(a, reach[:, : len(inputs)], c, inputs, outputs, math.inf)
        model = replace(model, misfit=_misfit(model, sized, scale))
        if best is None or model.misfit < best.misfit:
            best = model
        if best.misfit < _GOOD_FIT:
            break
    assert best is not None
    return best


def _misfit(model: LinearModel, sized: Array, scale: Array) -> float:
    """Return the largest share of an input's scaled responses that a model misses."""
    worst = 0.0
    for number, name in enumerate(model.inputs):
        known, predicted = sized[:, :, number], model.step(name, len(sized) - 1) * scale
        size = float(np.abs(known).max())
        if size > 0.0:
            missed = float(np.abs(predicted - known).max()) / size
            worst = max(worst, missed if math.isfinite(missed) else math.inf)
    return worst


class FlownResponses:
    """Flies the responses of an aircraft at one trim."""

    def __init__(self, flight: FlightPlan) -> None:
        self._flight, self._aircraft = flight, load_aircraft(flight.aircraft)

    def fly(self, moves: Callable[[int], dict[str, float]], outputs: tuple[str, ...], count: int) -> Array:
        """Fly from the trim with changes of the controls at each step of the autopilot; return the outputs, SI units,
        (count + 1, outputs)."""
        import jsbsim

        with quiet(), Draft() as folder:
            executive = loaded_model(self._flight.aircraft, self._aircraft, str(folder.path))
            try:
                bring_to_start(executive, self._flight, self._aircraft, 0)
            except jsbsim.BaseError as error:
                raise InputError(f"JSBSim's trim fails: {' '.join(str(error).split())}") from error
            manager = executive.get_property_manager()
            engines = executive.get_propulsion().get_num_engines()
            nodes = {name: [manager.get_node(f"fcs/{name}-cmd-norm")] for name in ("elevator", "aileron", "rudder")}
            nodes["throttle"] = [manager.get_node(f"fcs/throttle-cmd-norm[{i}]") for i in range(engines)]
            rest = {name: [node.get_double_value() for node in given] for name, given in nodes.items()}
            read = [(manager.get_node(OUTPUTS[name][0]).get_double_value, OUTPUTS[name][1]) for name in outputs]
            self.trim = _trim(executive)
            rows = [[factor * value() for value, factor in read]]
            for step in range(count):
                for name, change in moves(step).items():
                    for node, value in zip(nodes[name], rest[name], strict=True):
                        node.set_double_value(value + change)
                for _ in range(4):
                    executive.run()
                rows.append([factor * value() for value, factor in read])
        values = np.array(rows)
        if not np.isfinite(values).all():
            raise InputError("the model diverges within seconds of its trim")
        return values

    def linear(self, motion: tuple[tuple[str, ...], tuple[str, ...]], seconds: float) -> LinearModel:
        """Return the linear model of `LATERAL` or `VERTICAL` from responses of some seconds."""
        inputs, outputs = motion
        if self._aircraft.performance.glider:
            inputs = tuple(name for name in inputs if name != "throttle")
        count = round(seconds / INTERVAL)
        columns = []
        for name in inputs:
            step = self._size(name, outputs)
            up, down = (self.fly(lambda _, s=s, n=name: {n: s}, outputs, count) for s in (step, -step))  # type: ignore[misc]
            columns.append((up - down) / (2.0 * step))
        steps = np.stack(columns, axis=2)
        return realised(steps - steps[0], inputs, outputs)

    def _size(self, control: str, outputs: tuple[str, ...]) -> float:
        """Return the size of a step that moves the aircraft as wanted."""
        if control == "throttle":
            return 0.05
        count = round(1.0 / INTERVAL)
        up, down = (self.fly(lambda _, s=s: {control: s}, outputs, count) for s in (_FIRST, -_FIRST))  # type: ignore[misc]
        rates = [place for place, name in enumerate(outputs) if name in "pqr"]
        reached = float(np.abs(up - down)[:, rates].max()) / 2.0
        return min(_STEPS[1], max(_STEPS[0], _FIRST * _WANTED / max(reached, 1e-9)))


def _trim(executive: Any) -> Trim:
    return Trim(
        executive["aero/alpha-rad"],
        executive["fcs/throttle-cmd-norm[0]"] if executive.get_propulsion().get_num_engines() else 0.0,
        executive["fcs/elevator-cmd-norm"],
        executive["velocities/vtrue-fps"] * FOOT, executive["velocities/vc-fps"] * FOOT,
        executive["attitude/theta-rad"],
    )  # fmt: skip


OMEGA = np.geomspace(0.05, (1.0 - 1e-9) * math.pi / INTERVAL, 400)
"""Angular frequencies of the margins, rad/s: up to the half of the autopilot's rate, where z = −1."""


@dataclass(frozen=True)
class Margins:
    """How far a loop is from oscillating."""

    gain_db: float  # least factor of the gain, up or down, dB
    phase_deg: float  # least phase lag or lead, degrees
    crossover: float  # highest frequency at which the loop's gain is 1, rad/s; 0: nowhere


_REAL = 1e-6  # phase within which a loop counts as real at the last frequency [rad]


def margins(loop: Array, omega: Array = OMEGA) -> Margins:
    """Return the margins of a loop's frequency response, negative feedback, closed loop stable."""
    size, angle = np.abs(loop), np.unwrap(np.angle(loop))
    phase, crossover = math.inf, 0.0
    for k in np.flatnonzero((size[1:] - 1.0) * (size[:-1] - 1.0) < 0.0):
        on = math.log(size[k]) / (math.log(size[k]) - math.log(size[k + 1]))
        at = angle[k] + on * (angle[k + 1] - angle[k])
        phase = min(phase, abs(math.remainder(at + math.pi, 2.0 * math.pi)))
        crossover = float(omega[k] * (omega[k + 1] / omega[k]) ** on)
    gain = math.inf
    turned = (angle + math.pi) / (2.0 * math.pi)  # a whole number where the phase is −180°
    for k in np.flatnonzero(np.floor(turned[1:]) != np.floor(turned[:-1])):
        on = (max(np.floor(turned[k : k + 2])) - turned[k]) / (turned[k + 1] - turned[k])
        at = math.log(size[k]) + on * (math.log(size[k + 1]) - math.log(size[k]))
        gain = min(gain, abs(20.0 * at / math.log(10.0)))
    if abs(math.remainder(angle[-1] + math.pi, 2.0 * math.pi)) < _REAL:
        gain = min(gain, abs(20.0 * math.log10(size[-1])))  # a sampled loop is real at z = −1
    return Margins(gain, math.degrees(phase), crossover)


def lift_lag(model: LinearModel, trim: Trim) -> float:
    """Return the lag of the lift behind the pitch rate, s: V/g over the change of load factor with angle of attack.

    The flight path turns at γ' = α/T, so γ = ḣ/V follows α; both are of the response to the elevator, of which the
    first seconds count, before the airspeed changes.
    """
    response = model.step("elevator", round(3.0 / INTERVAL))
    path = response[:, model.outputs.index("climb")] / trim.tas
    alpha = response[:, model.outputs.index("alpha")]
    turn = np.diff(path) / INTERVAL
    middle = 0.5 * (alpha[1:] + alpha[:-1])
    # the elevator's lift is proportional to its step: a constant beside the proportion
    slope = np.linalg.lstsq(np.column_stack([middle, np.ones(len(middle))]), turn, rcond=None)[0][0]
    return float(1.0 / slope) if slope > 0.0 else math.inf
