"""Errors of the angles of a turning block: they enter the vehicle's attitude alone, and directly.

A navigator turns its attitude out by the encoders' angles (`sinssim.sensors.imu.encoder`). An error b of the angle
about an axis a of the rotation, in north-east-down axes, is an attitude error φ = a b. The noise and the step of the
encoders count with σ² and Q²/12.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.error_budget.inputs.sources import Source
from sinssim.sensors.imu.encoder import EncoderErrors, draw_encoders, encoders_of
from sinssim.truth.motions.turning_block import TurningBlock
from sinssim.units import ARCSEC

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory

_GROUP = "rotation"


def of_turning(
    scenario: Scenario, block: Trajectory, outputs: Array
) -> tuple[list[Source], dict[str, Array], dict[str, Array]]:
    """Return the errors of a turning block's angles as sources.

    Args:
        scenario: the scenario.
        block: the motion that the sensors feel.
        outputs: instants, (E,) s.

    Returns:
        The sources, the covariances of the random ones, (E, 9, 9), and the errors that are the same in every run,
        (E, 9), SI; nothing for a block that does not turn.
    """
    section = scenario.imu.rotation
    if section is None or not isinstance(block, TurningBlock):
        return [], {}, {}
    sources: list[Source] = []
    covariance: dict[str, Array] = {}
    mean: dict[str, Array] = {}
    q_nv, turns = block.base.state(outputs).q_nb, block.turns
    outer = rotation.rotate(q_nv, turns.outer)
    outer_turn = rotation.quaternion_from_rotation_vector(turns.angles(outputs)[:, :1] * turns.outer)
    inner = rotation.rotate(rotation.multiply(q_nv, outer_turn), turns.inner)

    def add_random(name: str, label: str, value: float, factor: float = 1.0) -> None:
        if value:
            sources.append(Source(name, label, _GROUP, "random", value, "arcsec"))
            covariance[name] = np.zeros((len(outputs), 9, 9))
            for axis in (outer, inner)[: 2 if turns.two_axes else 1]:
                variance = (factor * value * ARCSEC) ** 2
                covariance[name][:, 6:, 6:] += variance * axis[:, :, None] * axis[:, None, :]

    add_random("encoder_bias", "encoder bias", section.encoder_bias_sigma_arcsec)
    add_random("encoder_noise", "encoder noise", section.encoder_noise_arcsec)
    add_random("encoder_quantum", "step of the encoder", section.encoder_quantum_arcsec, 12.0**-0.5)

    def add_given(name: str, label: str, errors: EncoderErrors, true: Array, value: float) -> None:
        encoders = encoders_of(block, errors, outputs)
        assert encoders is not None
        read = encoders.attitude(outputs)
        q_solution = rotation.multiply(rotation.multiply(q_nv, true), rotation.conjugate(read))
        phi = rotation.rotation_vector_from_quaternion(rotation.multiply(q_nv, rotation.conjugate(q_solution)))
        if value:
            sources.append(Source(name, label, _GROUP, "given", value, "arcsec"))
            mean[name] = np.hstack([np.zeros((len(outputs), 6)), phi])

    same = scenario.imu.model_copy(update={"rotation": section.model_copy(update={"encoder_bias_sigma_arcsec": 0.0})})
    given = draw_encoders(same, scenario.seed)
    assert given is not None
    steady = turns.without_wobble(turns.angles(outputs))
    given = replace(given, noise=0.0, quantum=0.0)
    largest = max(np.abs(given.bias).max(), given.periodic) / ARCSEC
    add_given("encoder_given", "encoder errors equal in every run", given, steady, float(largest))
    add_given("wobble", "wobble of the axis", EncoderErrors(), turns.attitude(outputs), section.wobble_arcsec)
    return sources, covariance, mean
