"""Whether the gate has caught a fault of the satellite receiver."""

from __future__ import annotations

import pytest

from sinssim.experiments.run import filter_summary
from tests.experiments.run.test_filter_numbers import faulty, scenario


@pytest.mark.parametrize(("end", "readings", "caught"), [(107.0, 8, False), (108.0, 9, True)])
def test_more_than_half_of_the_readings_make_a_fault_detected(end: float, readings: int, caught: bool) -> None:
    """From 99.5 s on, 100 to 103 s and from 105 s on are rejected; 94 to 99 s are not: 7 of 14, then 8 of 15."""
    own, _ = faulty()
    jumps = [{"from_s": 93.5, "to_s": end, "up_m": 5.0}]
    (found,) = filter_summary._faults(own, scenario(aiding={"gnss": {"jumps": jumps}}))
    assert (found["readings"], found["refused"]) == (readings + 6, readings - 1)
    assert found["caught"] == caught
