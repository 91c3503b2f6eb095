"""The phases of a mission in a run's report: cells, sources, reasons."""

from __future__ import annotations

from typing import Any

from sinssim.experiments.run.parts.phases import Phases
from tests.recording.spies import Shown, cells, read


def row(phase: str, begin: float, end: float, *values: float, sources: Any = None, **more: Any) -> dict[str, Any]:
    keys = ("horizontal_error_m", "horizontal_added_m", "velocity_error_mps", "velocity_added_mps",
            "heading_error_arcmin", "heading_added_arcmin", "tilt_error_arcsec", "tilt_added_arcsec")  # fmt: skip
    found = {"phase": phase, "from_s": begin, "to_s": end, **dict(zip(keys, values, strict=True)), **more}
    return found if sources is None else {**found, "sources": sources}


SOURCES = {
    "horizontal": {"horizontal_sigma_m": 123.4, "shares": {"gyro_bias": 0.625, "accel_bias": 0.25, "noise": 0.125}},
    "heading": {"heading_sigma_arcmin": 4.5, "shares": {"gyro_arw": 0.96, "other": 0.04}},
    "tilt": {"tilt_sigma_arcsec": 0.0, "shares": {}},
}


def test_a_table_for_each_solution() -> None:
    entry = {
            "poisson": [
                row("alignment", 0.0, 300.4, 1.5, 0.5, 0.125, 0.25, -3.75, 2.5, 12.25, 6.125, sources=SOURCES),
                row("flight <a>", 300.4, 900.0, 2774.3, 2773.1, 1.25, 1.375, 4.5, 8.25, 0.0, -0.5, sources=SOURCES),
            ],
            "aided": [row("taxi", 5.0, 7.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, no_sources="No gyro & no run.")],
    }  # fmt: skip
    run: Any = None
    html = Shown(Phases(run, entry=entry).exhibits()).html
    heads = ["phase", "from … to, s", "horizontal, m", "added, m", "velocity, m/s", "added, m/s", "heading, arcmin",
             "added, arcmin", "tilt, arcsec", "added, arcsec"]  # fmt: skip
    rows = cells(html)
    assert rows == [
        heads,
        ["alignment", "0 … 300", "1.50", "0.500", "0.125", "0.250", "−3.75", "2.50", "12.2", "6.12"],
        ["flight &lt;a&gt;", "300 … 900", "2774", "2773", "1.25", "1.38", "4.50", "8.25", "0", "−0.500"],
        heads, ["taxi", "5 … 7", "1.00", "2.00", "3.00", "4.00", "5.00", "6.00", "7.00", "8.00"],
        ["phase", "horizontal", "heading", "tilt"],
        *([name, "123 m: gyro_bias 62\u00a0%, accel_bias 25\u00a0%", "4.50 arcmin: gyro_arw 96\u00a0%", "0"]
          for name in ("alignment", "flight &lt;a&gt;")),
    ]  # fmt: skip
    text = read(html)
    assert text.index("poisson") < text.index("aided") < text.index("poisson: sources")
    assert "aided: the sources of the phases’ errors are unknown (no budget). No gyro &amp; no run." in text
    assert "<code>sinssim budget</code> ranks the sources" in html
    assert not list(Phases(run, entry={}).exhibits())
