"""The table of explanations: order, numbers, units of the sizes, words of the kinds."""

from __future__ import annotations

from typing import Any

from sinssim.experiments.run.filter_remedies import what_to_try
from tests.recording.spies import cells, html, read


def tried(kind: str, name: str, gain: float, needed: float, value: list[float], sigma: list[float]) -> dict[str, Any]:
    return {"kind": kind, "name": name, "gain": gain, "needed": needed, "value": value, "sigma": sigma}


HYPOTHESES = [
    tried("inertial noise", "both", 41.6, 12.34, [2.456], []),
    tried("measurement noise", "gnss, baro", 7.4, 11.06, [], []),
    tried("bias walk", "gyro", 333.6, 13.0, [0.01234, -5.678], [0.00123, 0.45]),
    tried("initial state", "heading", 8.6, 10.0, [1.5, 2.5, 3.5, 4.5], [0.1, 0.2, 0.3, 0.4]),
    tried("gnss time offset", "time offset of gnss", 3.2, 9.87, [0.0251], []),
]


def page(**more: Any) -> str:
    found: Any = {
        "what_to_try": ["Set σ < 3 m."], "hypotheses": HYPOTHESES, "cause": 2, "until_s": 123.456, "false_alarm": 0.013,
        **more,
    }  # fmt: skip
    return html(*what_to_try(found))


def test_the_explanations_from_the_cause_down() -> None:
    """Those above their limits first, each group from the largest gain; three estimates in a line."""
    shown = page()
    assert cells(shown) == [
        ["explanation", "gain", "limit", "size ± 1σ, SI; factor of a σ or a noise"],
        ["random walk of the biases of the gyros", "334", "13.0", "0.0123 ± 0.0012, -5.68 ± 0.45"],
        ["noise of gyros and accelerometers", "42", "12.3", "2.46"],
        ["error of the heading", "9", "10.0",
         "1.50 ± 0.10, 2.50 ± 0.20, 3.50 ± 0.304.50 ± 0.40"],
        ["σ of gnss and baro", "7", "11.1", "–"],
        ["time offset of gnss", "3", "9.9", "0.0251"],
    ]  # fmt: skip
    assert "3.50 ± 0.30<br>4.50 ± 0.40" in shown
    assert shown.count("<strong>") == 1
    assert "<strong>334</strong>" in shown
    text = read(shown)
    assert "Set σ &lt; 3 m." in text
    assert "until 123.5 s; the gains of the others are those of its linear recursion." in text
    assert "in at most 1.3 % of runs with a correct filter" in text


def test_without_a_cause_nothing_is_bold() -> None:
    assert "<strong>" not in page(cause=None)
    only: Any = {"what_to_try": ["The filter is correct."]}
    assert html(*what_to_try(only)) == "<p>The filter is correct.</p>"
