"""The application: its commands are the files of `commands/`; a new file there is a new command."""

from __future__ import annotations

import importlib
import pkgutil
from typing import Annotated

import typer

from sinssim import __version__
from sinssim.cli import commands
from sinssim.cli.usage import Commands

_FIRST = ("run", "view", "check", "compare")
"""Commands at the top of the list in `sinssim --help`; the others follow in alphabetical order."""

app = typer.Typer(
    name="sinssim",
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 success, 1 the run failed, 2 wrong input, 130 interrupted.",
)


def command_names() -> list[str]:
    """Return the names of the commands, in the order of the help."""
    names = [module.name.replace("_", "-") for module in pkgutil.iter_modules(commands.__path__)]
    return sorted(names, key=lambda name: (_FIRST.index(name) if name in _FIRST else len(_FIRST), name))


def _print_version(value: bool) -> None:
    if value:
        print(f"sinssim {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Simulate strapdown inertial navigation from end to end.

    JSBSim flies an aircraft along a flight plan. An inertial measurement unit with the errors of its grade measures the
    flight. Navigation algorithms compute attitude, velocity and position from its output. One Rerun recording contains
    all data.

    A scenario may add aiding sensors and a Kalman filter: see `sinssim run aided_airliner`.

    Begin with `sinssim run first_flight`, then `sinssim view runs/first_flight`.
    """


for _name in command_names():
    # The name of a file is that of its command, with underscores for hyphens.
    app.command(_name)(importlib.import_module(f"{commands.__name__}.{_name.replace('-', '_')}").command)
