"""`sinssim check`: checks a scenario and shows its plan."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.cli.options import Debug, Json, ScenarioName, Settings
from sinssim.cli.terminal import print_json

if TYPE_CHECKING:
    from sinssim.scenario import Scenario


def command(scenario: ScenarioName, settings: Settings = None, as_json: Json = False, debug: Debug = False) -> None:
    """Check a scenario without flying it, and show its plan.

    Checks everything that is known beforehand: the file, the aircraft, all legs and all names. If there are mistakes,
    it lists all of them and exits with code 2.

    Example:

        sinssim check my_flight.toml --set flight.aircraft=f16
    """
    from sinssim.scenario import load_scenario
    from sinssim.scenario.duration import check_times, expected_duration
    from sinssim.scenario.route import check_route
    from sinssim.scenario.summary import plan_lines

    plan = load_scenario(scenario, settings or ())
    if plan.log is not None:
        _check_log(plan, as_json)
        return
    check_times(plan)
    check_route(plan)
    resolved, about_filter = plan, list[str]()
    if plan.filter is not None:
        from sinssim.estimation.from_scenario import filter_states
        from sinssim.estimation.from_scenario.memory import check_memory

        resolved = filter_states.with_states(plan)
        check_memory(resolved)
        about_filter += filter_states.choice(plan)
        about_filter += (f"note        {sentence}" for sentence in filter_states.notes(plan))
    if as_json:
        duration = expected_duration(plan)
        print_json({"expected_duration_s": round(duration), "scenario": resolved.as_written()})
    else:
        print("\n".join((*plan_lines(resolved), *about_filter)))


def _check_log(plan: Scenario, as_json: bool) -> None:
    """Read the files of a scenario with recorded sensors, and show what they hold and what follows from them."""
    from sinssim.estimation.from_scenario import filter_states
    from sinssim.estimation.from_scenario.memory import check_memory
    from sinssim.estimation.from_scenario.recorded_run import prepare
    from sinssim.scenario.duration import expected_duration
    from sinssim.scenario.summary import plan_lines

    prepared = prepare(plan)
    log, resolved = prepared.log, prepared.scenario
    check_memory(resolved, of_log=log.rates)
    notes = [*log.notes, prepared.start.words]
    if as_json:
        duration = expected_duration(resolved)
        print_json({"expected_duration_s": round(duration), "notes": notes, "scenario": resolved.as_written()})
        return
    print("\n".join(plan_lines(resolved)))
    for name, rate in log.rates.items():
        print(f"recorded    {name}, {rate:.4g} Hz")
    if plan.filter is not None:
        print("\n".join(filter_states.choice(plan, prepared.moved)))
    print("\n".join(f"note        {sentence}" for sentence in notes))
