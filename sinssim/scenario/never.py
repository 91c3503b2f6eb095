"""What a scenario writes for times that its run does not reach: a person should know before it runs."""

from __future__ import annotations

from collections.abc import Iterator

from sinssim.scenario.aiding import GnssSection
from sinssim.scenario.schema import Scenario


def never(scenario: Scenario, end: float) -> Iterator[str]:
    """Say which outages, faults and stops of the aiding sensors, or what else of the filter, the run does not reach.

    Args:
        scenario: the scenario.
        end: when the run ends, s.

    Yields:
        Whole sentences, each with its key.
    """
    wanted = None if scenario.filter is None else scenario.filter.alignment_s
    if wanted is not None and wanted >= end:
        yield f"filter.alignment_s = {wanted:g}: the run ends at {end:.0f} s, and the alignment takes longer."
    for name, sensor in scenario.aiding or ():
        if sensor is None:
            continue
        times = [(f"outages_s.{i}", begin) for i, (begin, _) in enumerate(sensor.outages_s, start=1)]
        times += [(f"during_s.{i}", b) for i, (b, _) in enumerate(getattr(sensor, "during_s", None) or (), start=1)]
        if isinstance(sensor, GnssSection):
            for kind, faults in (("jumps", sensor.jumps), ("ramps", sensor.ramps)):
                times += [(f"{kind}.{i}", fault.from_s) for i, fault in enumerate(faults, start=1)]
        for key, begin in times:
            if begin >= end:
                yield f"aiding.{name}.{key} begins at {begin:g} s, and the run ends at {end:.0f} s: it never happens."
        if sensor.latency_s >= end:
            yield (
                f"aiding.{name}.latency_s = {sensor.latency_s:g}: the run ends at {end:.0f} s, and no reading arrives "
                "before."
            )
