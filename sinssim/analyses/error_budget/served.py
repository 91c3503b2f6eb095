"""Which scenarios have a covariance budget, and why the others have none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.errors import InputError

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

_OTHER_SETS = {
    "accelerometers": "its angular rate comes from differences of accelerometers, which it integrates once more than "
    "the budget's error equations do",
    "attitude-sensor": "its attitude is measured and not integrated, so that the budget's error equations of the "
    "attitude do not hold",
    "platform": "its gimbals rotate the sensors relative to the sensor block, and the budget takes the inputs of the "
    "sensors from the motion of the block",
}
"""Why sets other than three gyros and three accelerometers have none."""


def check_kind(scenario: Scenario, solution: str | None) -> str:
    """Return the solution that a budget is made of; raise for a scenario that has none.

    Args:
        solution: "inertial", "filter", or None for the filter's if there is one.

    Returns:
        "inertial" or "filter".

    Raises:
        InputError: the scenario has no budget; the message names the key.
    """
    if not scenario.source.in_space:
        raise InputError(
            f"the scenario {scenario.name} has [one_component], whose errors in a vertical plane have no budget; "
            "`sinssim run` prints their closed forms. Give a scenario with [flight], [parked], [great_circle], "
            "[motion] or [track]."
        )
    if scenario.source.recorded:
        raise InputError(
            f"the scenario {scenario.name} has [log]; a budget needs the true motion, and a recording has none. Give a "
            "scenario with [flight], [parked], [great_circle] or [motion]."
        )
    if scenario.imu.sensor_set.type == "redundant":
        if scenario.imu.faults:
            raise InputError(
                "imu.faults of a redundant set have no budget: the monitoring excludes sensors by the errors of each "
                "run, which is not linear. Remove them, or use an ensemble."
            )
    elif scenario.imu.sensor_set.type != "gyros":
        kind = scenario.imu.sensor_set.type
        raise InputError(
            f'imu.sensor_set.type = "{kind}" has no budget: {_OTHER_SETS[kind]}. Use an ensemble, or '
            'imu.sensor_set.type = "gyros".'
        )
    if solution not in (None, "inertial", "filter"):
        raise InputError(f'solution = {solution!r} must be "inertial" or "filter".')
    if solution == "filter" and scenario.filter is None:
        raise InputError('solution = "filter" needs a scenario with [filter].')
    chosen = solution or ("inertial" if scenario.filter is None else "filter")
    f = scenario.filter if chosen == "filter" else None
    if f is not None and f.vibration_noise:
        raise InputError(
            f"filter.vibration_noise = {f.vibration_noise:g} has no budget: it follows from the data of one run. "
            f"Remove it, or use an ensemble."
        )
    if f is not None and f.alignment_s is not None and f.alignment != "at-rest":
        raise InputError(
            f'filter.alignment = "{f.alignment}" has no budget: the alignment starts from an unknown attitude, for '
            "which linear theory is not valid. Remove filter.alignment_s, or use an ensemble."
        )
    return chosen
