"""Errors of the angles of a rotating IMU: they enter the vehicle's attitude alone, and directly.

A navigator turns its attitude out by the encoders' angles (`sinssim.sensors.imu.encoder`). An error b of the angle
about an axis a of the rotation, in north-east-down axes, is an attitude error φ = a b. The noise and the step of the
encoders count with σ² and Q²/12. A filter compares the readings of its sensors with the vehicle's attitude, so that the
error acts on them, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from sinssim import rotation
from sinssim.analyses.error_budget.inputs.sources import Source
from sinssim.data import Array
from sinssim.sensors.imu.encoder import EncoderErrors, draw_encoders, encoders_of
from sinssim.truth.motions.turning_block import TurningBlock
from sinssim.units import ARCSEC

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory

_GROUP = "rotation"


@dataclass(frozen=True)
class AngleError:
    """An error of the angles.

    Attributes:
        source: the source.
        what: a constant of a run, a noise of its own at every instant, or an error that is the same in every run.
        size: 1σ of each component, rad; 1 for a given error, (c,).
        phi: returns the vehicle's attitude error by a unit of each component at instants (K,) s, (K, 3, c).
    """

    source: Source
    what: Literal["constant", "noise", "given"]
    size: Array
    phi: Callable[[Array], Array]


def angle_errors(scenario: Scenario, block: Trajectory) -> list[AngleError]:
    """Return the errors of the angles of a rotating IMU.

    Returns:
        The errors that are not zero; none for a block that does not turn.
    """
    section = scenario.imu.rotation
    if section is None or not isinstance(block, TurningBlock):
        return []
    turning, turns = block, block.turns
    found: list[AngleError] = []

    def axes(time: Array) -> Array:
        q_nv = turning.base.state(time).q_nb
        outer_turn = rotation.quaternion_from_rotation_vector(turns.angles(time)[:, :1] * turns.outer)
        outer = rotation.rotate(q_nv, turns.outer)
        inner = rotation.rotate(rotation.multiply(q_nv, outer_turn), turns.inner)
        return np.stack([outer, inner][: 2 if turns.two_axes else 1], axis=2)

    def add_random(name: str, label: str, what: Literal["constant", "noise"], value: float, size: float) -> None:
        if value:
            source = Source(name, label, _GROUP, "random", value, "arcsec")
            found.append(AngleError(source, what, np.full(2 if turns.two_axes else 1, size * ARCSEC), axes))

    bias, noise, step = section.encoder_bias_sigma_arcsec, section.encoder_noise_arcsec, section.encoder_quantum_arcsec
    add_random("encoder_bias", "encoder bias", "constant", bias, bias)
    add_random("encoder_noise", "encoder noise", "noise", noise, noise)
    add_random("encoder_quantum", "step of the encoder", "noise", step, step / 12.0**0.5)
    same = scenario.imu.model_copy(update={"rotation": section.model_copy(update={"encoder_bias_sigma_arcsec": 0.0})})
    given = draw_encoders(same, scenario.seed)
    assert given is not None
    given = replace(given, noise=0.0, quantum=0.0)
    largest = max(np.abs(given.bias).max(), given.periodic) / ARCSEC
    for name, label, errors, wobbles, value in (
        ("encoder_given", "encoder errors equal in every run", given, False, float(largest)),
        ("wobble", "wobble of the axis", EncoderErrors(), True, section.wobble_arcsec),
    ):
        if value:
            source = Source(name, label, _GROUP, "given", value, "arcsec")
            found.append(AngleError(source, "given", np.ones(1), _given(turning, errors, wobbles)))
    return found


def _given(block: TurningBlock, errors: EncoderErrors, wobbles: bool) -> Callable[[Array], Array]:
    """Return the attitude error by errors that are the same in every run, with or without the wobble of the axis."""

    def phi(time: Array) -> Array:
        q_nv, turns = block.base.state(time).q_nb, block.turns
        encoders = encoders_of(block, errors, time)
        assert encoders is not None
        true = turns.attitude(time) if wobbles else turns.without_wobble(turns.angles(time))
        q_solution = rotation.multiply(rotation.multiply(q_nv, true), rotation.conjugate(encoders.attitude(time)))
        off = rotation.multiply(q_nv, rotation.conjugate(q_solution))
        return np.asarray(rotation.rotation_vector_from_quaternion(off)[:, :, None])

    return phi


def of_turning(
    scenario: Scenario, block: Trajectory, outputs: Array
) -> tuple[list[Source], dict[str, Array], dict[str, Array]]:
    """Return the errors of a rotating IMU's angles as sources of an inertial solution.

    Args:
        outputs: instants, (E,) s.

    Returns:
        The sources, the covariances of the random ones, (E, 9, 9), and the errors that are the same in every run,
        (E, 9), SI; nothing for a block that does not turn.
    """
    sources: list[Source] = []
    covariance: dict[str, Array] = {}
    mean: dict[str, Array] = {}
    for error in angle_errors(scenario, block):
        sources.append(error.source)
        phi = error.phi(outputs) * error.size
        if error.what == "given":
            mean[error.source.name] = np.hstack([np.zeros((len(outputs), 6)), phi.sum(axis=2)])
        else:
            covariance[error.source.name] = np.zeros((len(outputs), 9, 9))
            covariance[error.source.name][:, 6:, 6:] = phi @ phi.transpose(0, 2, 1)
    return sources, covariance, mean
