"""The result of a trade study: the numbers of its cells as arrays over the grid, and as a table."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.experiments.trades.cells import Cell, command_of, digest_of, name_of
from sinssim.experiments.trades.keys import value_text
from sinssim.experiments.trades.measure import CellNumbers, CellVerdict
from sinssim.experiments.trades.schema import Axis, TradeStudy
from sinssim.recording.result import Result
from sinssim.statistics.requirements.quantity import Quantity, parse_quantity
from sinssim.system.drafts import draft
from sinssim.system.short_repr import html_table, short_repr

Status = Literal["finished", "failed", "open"]


@short_repr
@dataclass(frozen=True)
class CellResult:
    """What became of a cell.

    Attributes:
        cell: the cell.
        numbers: its numbers; None if it failed or was not reached.
        failure: why it failed; "" otherwise.
    """

    cell: Cell
    numbers: CellNumbers | None = None
    failure: str = ""

    @property
    def status(self) -> Status:
        """ "finished", "failed", or "open" if it was not reached."""
        return "failed" if self.failure else "open" if self.numbers is None else "finished"

    def value(self, column: str) -> float:
        """Return a number of the cell, NaN without one."""
        return float("nan") if self.numbers is None else self.numbers.values.get(column, float("nan"))

    def verdict(self, requirement: str) -> CellVerdict | None:
        """Return its verdict on a requirement, None without one."""
        there = () if self.numbers is None else self.numbers.verdicts
        return next((one for one in there if one.requirement == requirement), None)


@dataclass(eq=False, repr=False)
class TradeResult(Result):
    """The result of a trade study.

    Attributes:
        study: the study.
        cells: result of each cell; the last axis changes fastest.
        status: "finished", "interrupted" or "failed".
        directory: directory of the study; None if nothing is kept.
        seconds: duration of the computation, s, of this call alone.
        computed: number of cells computed by this call; the others had been finished before.
        notes: remarks on how it was computed, whole sentences.
    """

    study: TradeStudy
    cells: tuple[CellResult, ...]
    status: str = "finished"
    directory: Path | None = None
    seconds: float = 0.0
    computed: int = 0
    notes: list[str] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.cells)

    def __repr__(self) -> str:
        grid = " × ".join(map(str, self.shape))
        return f"TradeResult({self.study.name}: {grid} {self.study.cell} cells, {len(self.failures)} failed)"

    def _repr_html_(self) -> str:
        rows = [
            (self.name(one.cell.number), one.status, *(f"{one.value(q.column):.4g}" for q in self.study.drawn))
            for one in self.cells
        ]
        return html_table(repr(self), rows, ("cell", "status", *(q.column for q in self.study.drawn)))

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return self.study.shape

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes of the grid."""
        return self.study.axes

    @property
    def failures(self) -> dict[int, str]:
        """Why cells failed, by their number from 1."""
        return {one.cell.number: one.failure for one in self.cells if one.failure}

    @property
    def finished(self) -> int:
        """Number of cells with numbers."""
        return sum(one.status == "finished" for one in self.cells)

    def values(self, quantity: str | Quantity) -> Array:
        """Return a quantity over the grid.

        Args:
            quantity: for example "r95(end)", "heading(1800 s)"; or a column of the table, such as "nees_mean".

        Returns:
            SI, rates in nmi/h, of the shape of the grid; NaN where a cell has none.

        Raises:
            InputError: the study does not have the quantity.
        """
        return self._grid(self._column(quantity))

    def band(self, quantity: str | Quantity) -> tuple[Array, Array]:
        """Return the 95 % band of a quantity over the grid; NaN for budgets, which have no scatter.

        Args:
            quantity: as for `values`.

        Returns:
            Its low and its high end, as for `values`.

        Raises:
            InputError: the study does not have the quantity.
        """
        column = self._column(quantity)
        return self._grid(f"{column}_low"), self._grid(f"{column}_high")

    def _grid(self, column: str) -> Array:
        return np.array([one.value(column) for one in self.cells]).reshape(self.shape)

    def _column(self, quantity: str | Quantity) -> str:
        if isinstance(quantity, Quantity):
            return quantity.column
        columns = self.columns
        if quantity in columns:
            return quantity
        column = parse_quantity(quantity).column
        if column not in columns:
            known = [one.text for one in self.study.quantities]
            raise InputError(
                f"the study {self.study.name} does not have {shortened(repr(quantity))}: give its time in times_s, or "
                f"the quantity in draw. It has {', '.join(known)}."
            )
        return column

    @property
    def columns(self) -> list[str]:
        """Names of the numbers of the cells."""
        found: dict[str, None] = {one.column: None for one in self.study.quantities}
        for one in self.cells:
            found |= dict.fromkeys(one.numbers.values if one.numbers is not None else ())
        return list(found)

    def verdicts(self, requirement: str | None = None) -> NDArray[np.str_]:
        """Return verdicts over the grid.

        Args:
            requirement: one of `study.require`; all of them together by default.

        Returns:
            "met", "not met", "undecided", or "" where a cell has no verdict.

        Raises:
            InputError: the study does not have the requirement.
        """
        texts = [one.text for one in self.study.requirements]
        if requirement is not None and requirement not in texts:
            raise unknown_name("requirement", requirement, texts)
        wanted = texts if requirement is None else [requirement]
        words = []
        for one in self.cells:
            found = [v.verdict for text in wanted if (v := one.verdict(text)) is not None]
            words.append(next((w for w in ("not met", "undecided", "met") if w in found), ""))
        return np.array(words).reshape(self.shape)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """A row for each cell: values of the axes by their keys, status, numbers by column, verdicts, failure."""
        columns, rows = self.columns, []
        for one in self.cells:
            row: dict[str, Any] = {"cell": one.cell.number}
            for axis, k in zip(self.study.axes, one.cell.place, strict=True):
                row |= dict(axis.settings(k))
                if axis.labels:
                    row[axis.title] = axis.labels[k]
            row |= {"status": one.status}
            row |= {column: one.value(column) for column in columns}
            for text in self.study.require:
                found = one.verdict(text.strip())
                row[text] = None if found is None else found.verdict
            rows.append(row | {"failure": one.failure})
        return rows

    def name(self, number: int) -> str:
        """Return the values of a cell in words.

        Args:
            number: its number, from 1.

        Returns:
            "grade tactical, gyro bias σ 0.01 deg/h".
        """
        return name_of(self.study, self._cell(number).cell)

    def command(self, number: int, program: str = "sinssim") -> str:
        """Return the command that computes a cell by itself, with the same numbers.

        Args:
            number: its number, from 1.
            program: how sinssim is called.

        Returns:
            `sinssim budget …` or `sinssim ensemble …`.
        """
        return command_of(self.study, self._cell(number).cell, program)

    def digest(self, number: int) -> str:
        """Return the digest of a cell's scenario and of the requested results.

        Args:
            number: its number, from 1.

        Returns:
            SHA-256 in hexadecimal; "" if the cell has no scenario.
        """
        cell = self._cell(number).cell
        return "" if cell.scenario is None else digest_of(self.study, cell)

    def _cell(self, number: int) -> CellResult:
        if not 1 <= number <= len(self.cells):
            raise InputError(f"cell {number}: the study has the cells 1 to {len(self.cells)}.")
        return self.cells[number - 1]

    def to_table(self) -> Any:
        """Return a row for each cell as a `pyarrow.Table`.

        Returns:
            The columns of `rows`; values of an axis that are not numbers are texts.
        """
        import pyarrow as pa

        rows, columns = self.rows, {}
        for name in rows[0]:
            values = [row[name] for row in rows]
            if all(isinstance(v, bool) for v in values) or all(v is None or isinstance(v, str) for v in values):
                columns[name] = pa.array(values, pa.bool_() if isinstance(values[0], bool) else pa.string())
            elif all(isinstance(v, int) and not isinstance(v, bool) for v in values):
                columns[name] = pa.array(values, pa.int64())
            elif all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
                columns[name] = pa.array([float(v) for v in values])
            else:
                columns[name] = pa.array([value_text(v) for v in values])
        return pa.table(columns)

    def to_parquet(self, path: Path | str) -> Path:
        """Write a row for each cell as a Parquet file.

        Args:
            path: the file.

        Returns:
            The file.

        Raises:
            InputError: it cannot be written.
        """
        import pyarrow.parquet as pq

        try:
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            with draft(Path(path)) as beside:
                pq.write_table(self.to_table(), beside)
        except OSError as error:
            raise InputError(f"{path} cannot be written: {error.strerror or error}.") from error
        return Path(path)
