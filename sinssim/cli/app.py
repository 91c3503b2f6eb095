"""The application: its commands are the files of `commands/`; a new file there is a new command.

Mistakes in options and arguments are reported in the sentences of sinssim's other errors.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from sinssim import __version__
from sinssim.cli import commands
from sinssim.errors import InputError, shortened

_UsageError: type[Exception] = typer.BadParameter.__bases__[0]
_KINDS = (("integer", "a whole number"), ("number", "a number"), ("float", "a number"), ("boolean", "true or false"))
"""Words of typer's messages, which differ from version to version, and what an option needs."""


class Commands(TyperGroup):
    """The commands; a mistake in their options is an `InputError`, which is printed like any other."""

    def make_context(self, *args: Any, **options: Any) -> Any:
        """Read the options before the command's name."""
        with _in_sentences():
            return super().make_context(*args, **options)

    def invoke(self, ctx: Any) -> Any:
        """Run the command that the arguments name."""
        with _in_sentences():
            return super().invoke(ctx)


@contextmanager
def _in_sentences() -> Iterator[None]:
    try:
        yield
    except _UsageError as error:
        if type(error).__name__ == "NoArgsIsHelpError":  # nothing is given: the help is printed
            raise
        raise InputError(sentence(error)) from error


def sentence(error: Any) -> str:
    """Return what is wrong, for example "--runs = 'abc' must be a whole number. See `sinssim ensemble --help`."."""
    text = error.message.strip().rstrip(".")
    parameter = getattr(error, "param", None)
    name = "" if parameter is None else next((o for o in parameter.opts if o.startswith("--")), "") or parameter.metavar
    if "Missing" in type(error).__name__:
        text = f"{name} is missing" if name else " ".join(error.format_message().split()).rstrip(".")
    elif name:
        given, kind = _given(error), next((kind for word, kind in _KINDS if f"valid {word}" in text), None)
        text = f"{name} = {given}: {text}" if kind is None else f"{name} = {given} must be {kind}"
    elif similar := getattr(error, "possibilities", None):
        text = f"{text}. Did you mean {' or '.join(similar)}?"
    context = getattr(error, "ctx", None)
    command = "sinssim" if context is None else context.command_path
    return f"{text}{'' if text.endswith('?') else '.'} See `{command} --help`."


def _given(error: Any) -> str:
    """Return the value that was given, as far as it is known."""
    cause = error.__cause__
    try:
        return shortened(repr(cause.errors()[0]["input"]))
    except (AttributeError, LookupError, TypeError):
        quoted = error.message.split("'")
        return shortened(repr(quoted[1])) if len(quoted) > 2 else "what was given"


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
