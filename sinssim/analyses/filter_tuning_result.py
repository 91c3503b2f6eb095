"""The tuning of a filter: its numbers, and what it shows."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from sinssim.exhibits import Column, Exhibits, Item, Sentence, Table
from sinssim.recording.result import Media, Result
from sinssim.units import capital, listed, number_text


@dataclass(frozen=True)
class Tuned:
    """One key."""

    key: str
    start: float  # value to begin with, in its unit
    value: float  # value that applies
    low: float  # 95 % interval; zero or infinite to a side to which the data say nothing
    high: float
    refused: str = ""  # why its value is not tuned; "" if it is
    array: tuple[float, ...] = ()  # the values to begin with of the array that the key is a numbered value of


@dataclass(frozen=True)
class Judged:
    """One sensor in the held-out part."""

    sensor: str
    readings: int
    before: float  # mean NIS per component with the values to begin with; 1 is expected
    after: float  # with the tuned values


@dataclass(frozen=True, eq=False)
class TuningResult(Result):
    """The tuning of a filter.

    Attributes:
        scenario: file or name of the scenario.
        settings: settings "key=value" that replaced values of it.
        simulated: whether the sensors are simulated.
        keys: the keys.
        outliers: measurements left out of the fitted part, by sensor.
        split: instant at which the held-out part begins, s; the data end at `end`, s.
        gain: twice the logarithm of the ratio of the probabilities of the held-out measurements with the tuned values
            and with those to begin with.
        judged: the sensors in the held-out part.
        passes: passes of the filter, and replays.
        directory: directory of the tuning; None if none was written.
        media: what draws and writes it.
    """

    scenario: str
    settings: tuple[str, ...]
    simulated: bool
    keys: tuple[Tuned, ...]
    outliers: Mapping[str, int]
    split: float
    end: float
    gain: float
    judged: tuple[Judged, ...]
    passes: tuple[int, int]
    directory: Path | None = None
    media: Media[TuningResult] = field(default_factory=lambda: TuningMedia(), kw_only=True, repr=False, compare=False)

    @property
    def lines(self) -> tuple[str, ...]:
        """The settings that apply the tuned values."""
        settings: dict[str, str] = {}
        arrays: dict[str, list[float]] = {}
        for of in self.keys:
            if not of.refused and of.array:
                whole, _, number = of.key.rpartition(".")
                arrays.setdefault(whole, list(of.array))[int(number) - 1] = of.value
                settings[whole] = f"[{', '.join(f'{value:.4g}' for value in arrays[whole])}]"
            elif not of.refused:
                settings[of.key] = f"{of.value:.4g}"
        return tuple(f"{key}={value}" for key, value in settings.items())

    @property
    def confirmed(self) -> bool:
        """Whether the held-out measurements are more probable with the tuned values, or none is changed."""
        return self.gain > 0.0 or not self.lines


class TuningMedia(Media[TuningResult]):
    """Draws and writes a tuning."""

    file = "tuning.json"

    def summary(self, result: TuningResult) -> dict[str, Any]:
        """Return the numbers of a tuning, for JSON."""
        return {
            "scenario": result.scenario,
            "simulated": result.simulated,
            "keys": [asdict(key) for key in result.keys],
            "settings": list(result.lines),
            "outliers": dict(result.outliers),
            "held_out": {
                "from_s": result.split, "to_s": result.end, "gain": result.gain, "confirmed": result.confirmed,
                "sensors": [asdict(sensor) for sensor in result.judged],
            },
            "passes": result.passes[0],
            "replays": result.passes[1],
        }  # fmt: skip

    def exhibits(self, result: TuningResult) -> Exhibits:
        """Return the tables and sentences of a tuning."""
        items = [*_keys(result), *_held_out(result), *_lines(result)]
        return Exhibits(f"Tuning of the filter of {result.scenario}", items)


def _keys(result: TuningResult) -> Iterator[Item]:
    rows = [
        (key.key, number_text(key.start, 4), "–" if key.refused else f"**{number_text(key.value, 4)}**",
         f"{_limit(key.low)} … {_limit(key.high)}")
        for key in result.keys
    ]  # fmt: skip
    columns = (Column("key", words=True), Column("now"), Column("tuned"), Column("95 % interval"))
    yield Table(columns, rows)
    for key in result.keys:
        if key.refused:
            yield Sentence(f"{capital(key.refused)}. It stays at {number_text(key.start, 4)}.")
    if result.outliers:
        counts = [f"{count} of {name}" for name, count in result.outliers.items()]
        yield Sentence(
            f"Measurements left out as outliers, beyond what one correct measurement in ten thousand exceeds: "
            f"{listed(counts)}."
        )


def _limit(value: float) -> str:
    return "∞" if math.isinf(value) else number_text(value, 3)


def _held_out(result: TuningResult) -> Iterator[Item]:
    if not result.judged:
        return
    rows = [(of.sensor, str(of.readings), f"{of.before:.3f}", f"{of.after:.3f}") for of in result.judged]
    columns = (Column("sensor", words=True), Column("measurements"), Column("NIS now"), Column("NIS tuned"))
    yield Table(columns, rows, note="Mean NIS per component in the held-out part; 1 is expected of a correct filter.")
    span = f"from {result.split:.0f} s to {result.end:.0f} s, which the values were not fitted to"
    if result.confirmed:
        yield Sentence(
            f"The held-out part ({span}) confirms the values: with them twice the logarithm of the probability of its "
            f"measurements is {number_text(result.gain, 3)} larger.",
            "strong",
        )
    else:
        yield Sentence(
            f"The held-out part ({span}) does not confirm the values: with them twice the logarithm of the probability "
            f"of its measurements is {number_text(-result.gain, 3)} smaller. Both parts of the data differ, or the "
            "filter lacks an error that a noise cannot stand for (filter.diagnose).",
            "warning",
        )


def _lines(result: TuningResult) -> Iterator[Item]:
    if not result.lines:
        yield Sentence("The data determine none of the keys.", "strong")
        return
    tuned = {text.partition("=")[0] for text in result.lines}
    others = [text for text in result.settings if text.partition("=")[0].strip() not in tuned]
    settings = " ".join(f"--set {shlex.quote(text)}" for text in (*others, *result.lines))
    yield Sentence(f"To apply them: `sinssim run {shlex.quote(result.scenario)} {settings}`")
    by_table: dict[str, list[str]] = {}
    for text in result.lines:
        path, _, value = text.partition("=")
        table, _, key = path.rpartition(".")
        by_table.setdefault(table, []).append(f"{key} = {value}")
    if not any(part.isdigit() for table in by_table for part in table.split(".")):
        parts = [f"`[{table}]` " + ", ".join(f"`{line}`" for line in lines) for table, lines in by_table.items()]
        yield Sentence(f"In the file: {'; '.join(parts)}.")
    if result.simulated and any(not text.startswith("filter.") for text in result.lines):
        yield Sentence(
            "The sensors of this scenario are simulated: keys outside [filter] change what they read, too, not only "
            "what the filter assumes.",
            "note",
        )
