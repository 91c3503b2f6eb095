"""Injected GNSS outages of recorded data: the table [log.outages], and outages written on a command line."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any, Self

from pydantic import Field, ValidationError, model_validator

from sinssim.errors import InputError, shortened
from sinssim.toml_section import Moment, Positive, Section, Span

_NUMBER = r"(\d+(?:\.\d*)?)"
_SPAN = re.compile(f"{_NUMBER}:{_NUMBER}")
_REGULAR = re.compile(rf"{_NUMBER}/{_NUMBER}(?:@({_NUMBER}(?:,{_NUMBER})*))?")


class Outages(Section):
    """Injected GNSS outages, which show the performance of the system without GNSS."""

    paired = (("length_s", "every_s"),)
    rules = (
        (lambda s: not s.at_s and s.length_s is None, "give at_s, or length_s and every_s"),
        (lambda s: isinstance(s.first_s, tuple) and s.length_s is None,
         "several beginnings (first_s) are those of regular outages: give length_s and every_s"),
        (lambda s: isinstance(s.first_s, tuple) and s.at_s,
         "at_s and several beginnings (first_s) exclude each other"),
    )  # fmt: skip

    at_s: tuple[Span, ...] = Field(default=(), description="[from, to] of each outage, in the time of the run")
    length_s: Positive | None = Field(default=None, description="length of regular outages")
    every_s: Positive | None = Field(default=None, description="period of regular outages")
    first_s: Moment | tuple[Moment, ...] | None = Field(
        default=None,
        description="start of the first regular outage; default: one period after the start; with several values, the "
        "filter makes one further pass for each, and the outages of these passes are evaluated together",
    )

    @model_validator(mode="after")
    def _regular(self) -> Self:
        if self.length_s is not None and self.every_s is not None and self.length_s >= self.every_s:
            raise ValueError(
                f"length_s = {self.length_s:g} must be less than every_s = {self.every_s:g}, or there would be no fix"
            )
        if isinstance(self.first_s, tuple) and len({*self.first_s}) < max(1, len(self.first_s)):
            raise ValueError("first_s: give each beginning once, for example [30.0, 45.0, 60.0]")
        return self

    def spans(self, start: float, end: float) -> tuple[tuple[float, float], ...]:
        """Return the outages within a run, in order.

        Args:
            start, end: of the run, s.

        Returns:
            Beginning and end of each, s; a regular outage that would not end within the run is left out. None with
            several beginnings, whose outages are those of further passes of the filter.
        """
        if isinstance(self.first_s, tuple):
            return ()
        inside = [span for span in self.at_s if span[0] < end and span[1] > start]
        return tuple(sorted((*inside, *self._regular_spans(self.first_s, start, end))))

    def passes(self, start: float, end: float) -> tuple[tuple[tuple[float, float], ...], ...]:
        """Return the outages of each further pass of the filter.

        Args:
            start, end: of the run, s.

        Returns:
            For each of several beginnings the outages within the run, as `spans`; none otherwise.
        """
        beginnings = self.first_s if isinstance(self.first_s, tuple) else ()
        return tuple(tuple(self._regular_spans(first, start, end)) for first in beginnings)

    def _regular_spans(self, first: float | None, start: float, end: float) -> Iterator[tuple[float, float]]:
        """Yield the regular outages from a beginning on."""
        if self.length_s is None or self.every_s is None:
            return
        begin = start + self.every_s if first is None else first
        while begin + self.length_s <= end:
            if begin >= start:
                yield begin, begin + self.length_s
            begin += self.every_s


def outage_settings(written: Sequence[str]) -> list[str]:
    """Return settings "key.path=value" for outages: settings of `log.outages`.

    Args:
        written: "40:55" from 40 s to 55 s; "15/45" for 15 s every 45 s, "15/45@60" the same, the first at 60 s,
            "15/45@30,45,60" once for each of these beginnings.
    """
    spans, regular = _parsed(written)
    listed = ", ".join(f"[{begin}, {end}]" for begin, end in spans)
    settings = [f"log.outages.at_s=[{listed}]"] if spans else []
    if regular is not None:
        settings += [f"log.outages.length_s={float(regular[1])}", f"log.outages.every_s={float(regular[2])}"]
        if regular[3]:
            first = [float(word) for word in regular[3].split(",")]
            settings.append(f"log.outages.first_s={first if len(first) > 1 else first[0]}")
    return settings


def outage_spans(written: Sequence[str], start: float, end: float) -> tuple[tuple[float, float], ...]:
    """Return the outages within a run: beginning and end of each, in order, s.

    Args:
        written: as for `outage_settings`, with one beginning at most.
        start, end: of the run, s.
    """
    spans, regular = _parsed(written)
    keys: dict[str, Any] = {"at_s": spans}
    if regular is not None:
        if "," in (regular[3] or ""):
            raise InputError(f"--outage {regular[0]}: several beginnings need several exports; give one.")
        keys |= {"length_s": float(regular[1]), "every_s": float(regular[2])}
        keys |= {"first_s": float(regular[3])} if regular[3] else {}
    try:
        within = Outages.model_validate(keys).spans(start, end)
    except ValidationError as error:
        why = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise InputError(f"--outage {' '.join(written)}: {why}.") from error
    if not within:
        raise InputError(f"--outage {' '.join(written)}: no outage lies within the run, {start:g} to {end:g} s.")
    return within


def _parsed(written: Sequence[str]) -> tuple[list[tuple[float, float]], re.Match[str] | None]:
    """Return single outages, and the regular ones as their parts."""
    spans: list[tuple[float, float]] = []
    regular = None
    for text in written:
        if parts := _SPAN.fullmatch(text):
            spans.append((float(parts[1]), float(parts[2])))
        elif (parts := _REGULAR.fullmatch(text)) and regular is None:
            regular = parts
        else:
            why = "regular outages are already given" if regular and _REGULAR.fullmatch(text) else "it is not an outage"
            raise InputError(
                f"--outage {shortened(text)}: {why}. Write 40:55 for an outage from 40 s to 55 s. Write 15/45, only "
                "once, for outages of 15 s every 45 s, 15/45@60 if the first begins at 60 s, or 15/45@30,45,60 for "
                "one pass with each of these first times."
            )
    return spans, regular
