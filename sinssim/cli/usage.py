"""Mistakes in options and arguments, in the sentences of sinssim's other errors."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer
from typer.core import TyperGroup

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
    """Return what is wrong with an option or argument.

    Args:
        error: typer's error.

    Returns:
        For example "--runs = 'abc' must be a whole number. See `sinssim ensemble --help`."
    """
    told = error.message.strip().rstrip(".")
    parameter = getattr(error, "param", None)
    name = "" if parameter is None else next((o for o in parameter.opts if o.startswith("--")), "") or parameter.metavar
    if "Missing" in type(error).__name__:
        told = f"{name} is missing" if name else error.format_message().rstrip(".")
    elif name:
        given, kind = _given(error), next((kind for word, kind in _KINDS if f"valid {word}" in told), None)
        told = f"{name} = {given}: {told}" if kind is None else f"{name} = {given} must be {kind}"
    elif similar := getattr(error, "possibilities", None):
        told = f"{told}. Did you mean {' or '.join(similar)}?"
    context = getattr(error, "ctx", None)
    command = "sinssim" if context is None else context.command_path
    return f"{told}{'' if told.endswith('?') else '.'} See `{command} --help`."


def _given(error: Any) -> str:
    """Return the value that was given, as far as it is known."""
    cause = error.__cause__
    try:
        return shortened(repr(cause.errors()[0]["input"]))
    except (AttributeError, LookupError, TypeError):
        quoted = error.message.split("'")
        return shortened(repr(quoted[1])) if len(quoted) > 2 else "what was given"
