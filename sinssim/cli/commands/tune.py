"""`sinssim tune`: noises of a filter by the likelihood of its innovations."""

from __future__ import annotations

from typing import Annotated

import typer

from sinssim.cli.options import Debug, Json, Quiet, ScenarioName, Settings, command
from sinssim.cli.terminal import has_bars, print_result
from sinssim.progress import shown

Keys = Annotated[
    list[str] | None,
    typer.Option(
        "--key",
        metavar="KEY[=VALUE]",
        help="A noise to tune, with a value to begin with other than the scenario's; may be given several times.",
        show_default="of a recording the noises and biases of [imu] and the σ of each aiding sensor, of a simulation "
        "the two noise factors of [filter]",
    ),
]
HeldOut = Annotated[
    float,
    typer.Option(
        "--held-out", metavar="SHARE", min=0.0, max=0.9,
        help="Share of the data, at its end, that judges the values and is not used to find them.",
    ),
]  # fmt: skip


@command
def tune(
    scenario: ScenarioName,
    keys: Keys = None,
    held_out: HeldOut = 1.0 / 3.0,
    settings: Settings = None,
    as_json: Json = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Find the noises of a scenario's filter under which its innovations are most probable.

    Each key gets its value of maximum likelihood with a 95 % interval. A key that the data cannot tell is named and
    stays. The end of the data judges the values. The last lines are the settings that apply them.

    Examples:

        sinssim tune my_drive.toml
        sinssim tune my_drive.toml --key log.gnss.sigma_factor --key imu.gyro_arw_deg_sqrt_h=0.5
        sinssim tune mems_uav --set filter.measurement_noise_factor=3
    """
    from sinssim.analyses.filter_tuning.tuning import tune

    with shown(has_bars(quiet or as_json)) as progress:
        result = tune(scenario, settings or (), keys=keys or (), held_out=held_out, progress=progress)
    print_result(result, as_json=as_json, quiet=quiet)
