"""Outages as people write them on a command line, as settings of a scenario's [log.outages]."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from sinssim.errors import InputError, shortened

_NUMBER = r"(\d+(?:\.\d*)?)"
_SPAN = re.compile(f"{_NUMBER}:{_NUMBER}")
_REGULAR = re.compile(rf"{_NUMBER}/{_NUMBER}(?:@({_NUMBER}(?:,{_NUMBER})*))?")


def outage_settings(written: Sequence[str]) -> list[str]:
    """Return settings "key.path=value" for outages.

    Args:
        written: "40:55" from 40 s to 55 s; "15/45" for 15 s every 45 s, "15/45@60" the same, the first at 60 s,
            "15/45@30,45,60" once for each of these beginnings.

    Returns:
        Settings of `log.outages`.

    Raises:
        InputError: one has another form, or two are regular.
    """
    spans, regular = _parsed(written)
    listed = ", ".join(f"[{begin}, {end}]" for begin, end in spans)
    settings = [f"log.outages.at_s=[{listed}]"] if spans else []
    if regular is not None:
        settings += [f"log.outages.length_s={float(regular[1])}", f"log.outages.every_s={float(regular[2])}"]
        if regular[3]:
            first = [float(one) for one in regular[3].split(",")]
            settings.append(f"log.outages.first_s={first if len(first) > 1 else first[0]}")
    return settings


def outage_spans(written: Sequence[str], start: float, end: float) -> tuple[tuple[float, float], ...]:
    """Return the outages within a run.

    Args:
        written: as for `outage_settings`, with one beginning at most.
        start, end: of the run, s.

    Returns:
        Beginning and end of each, in order, s.

    Raises:
        InputError: one has another form, ends before it begins, or no outage lies within the run.
    """
    from sinssim.scenario.sections.log import LogOutages

    spans, regular = _parsed(written)
    keys: dict[str, Any] = {"at_s": spans}
    if regular is not None:
        if "," in (regular[3] or ""):
            raise InputError(f"--outage {regular[0]}: several beginnings need several exports; give one.")
        keys |= {"length_s": float(regular[1]), "every_s": float(regular[2])}
        keys |= {"first_s": float(regular[3])} if regular[3] else {}
    try:
        found = LogOutages.model_validate(keys).spans(start, end)
    except ValidationError as error:
        said = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise InputError(f"--outage {' '.join(written)}: {said}.") from error
    if not found:
        raise InputError(f"--outage {' '.join(written)}: no outage lies within the run, {start:g} to {end:g} s.")
    return found


def _parsed(written: Sequence[str]) -> tuple[list[tuple[float, float]], re.Match[str] | None]:
    """Return single outages, and the regular ones as their parts."""
    spans: list[tuple[float, float]] = []
    regular = None
    for one in written:
        if found := _SPAN.fullmatch(one):
            spans.append((float(found[1]), float(found[2])))
        elif (found := _REGULAR.fullmatch(one)) and regular is None:
            regular = found
        else:
            why = "regular outages are already given" if regular and _REGULAR.fullmatch(one) else "it is not an outage"
            raise InputError(
                f"--outage {shortened(one)}: {why}. Write 40:55 for an outage from 40 s to 55 s. Write 15/45, only "
                "once, for outages of 15 s every 45 s, 15/45@60 if the first begins at 60 s, or 15/45@30,45,60 for "
                "one pass with each of these first times."
            )
    return spans, regular
