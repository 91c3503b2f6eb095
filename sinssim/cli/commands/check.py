"""`sinssim check`: checks a scenario and shows its plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sinssim.cli.command_line import Debug, GradeOption, Json, Settings, command, print_json, scenario_names, with_grade

if TYPE_CHECKING:
    from sinssim.scenario import Scenario


ScenarioFile = Annotated[
    str | None,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=scenario_names,
        help="Path of a TOML file, or a name from `sinssim list scenarios`.",
    ),
]
Plot = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE", help="Draw the plan: map, height, speed (.png, .svg, .pdf).")
]
Keys = Annotated[
    str | None,
    typer.Option(
        "--keys",
        metavar="TABLE",
        help="Show the keys of a table with default, limits and meaning instead, or those with a common beginning: "
        "imu, flight.legs, imu.gyro_bias.",
    ),
]


@command
def check(
    scenario: ScenarioFile = None,
    settings: Settings = None,
    grade: GradeOption = None,
    as_json: Json = False,
    plot: Plot = None,
    keys: Keys = None,
    debug: Debug = False,
) -> None:
    """Check a scenario without a simulation, and show its plan.

    Checks the file, the aircraft, all legs and all names. If there are mistakes, the command lists all of them and
    exits with code 2.

    Examples:

        sinssim check my_flight.toml --set flight.aircraft=f16
        sinssim check my_flight.toml --grade my_unit.toml
        sinssim check my_flight.toml --plot plan.png
        sinssim check --keys imu.gyro_bias
    """
    if keys is not None:
        from sinssim.scenario.schema import keys_under, toml_lines

        print("\n".join(line for table in keys_under(keys) for line in toml_lines(table)).rstrip())
        return
    if scenario is None:
        from sinssim.errors import InputError

        raise InputError("give a scenario to check, or --keys TABLE for the keys that a table may have.")
    from sinssim.scenario import load_scenario

    if plot is not None:
        from sinssim.recording.figures import check_format

        check_format(plot)
    plan = load_scenario(scenario, with_grade(settings, grade))
    if plot is not None and (plan.source.recorded or not plan.source.in_space):
        from sinssim.experiments.run.motion_exhibits import plan_of

        plan_of(plan)  # raises: there is no plan to draw
    if plan.source.recorded:
        _check_log(plan, as_json)
        return
    resolved, lines = checked(plan)
    if as_json:
        from sinssim.scenario.planned_limits import expected_duration

        print_json({"expected_duration_s": round(expected_duration(plan)), "scenario": resolved.as_written()})
    else:
        print("\n".join(lines))
    if plot is not None:
        from sinssim.experiments.run.motion_exhibits import plan_charts
        from sinssim.recording.figures import figure_of, save

        save(figure_of(plan_charts(plan)), plot)
        if not as_json:
            print(f"plot        {plot}")


def checked(plan: Scenario) -> tuple[Scenario, list[str]]:
    """Check a scenario with simulated sensors; return it with the states of its filter, and the lines of its plan."""
    from sinssim.scenario.plan_summary import plan_lines
    from sinssim.scenario.planned_limits import check_limits, check_route, check_times

    check_times(plan)
    check_route(plan)
    if plan.use:
        from sinssim.strapdown.engine_assembly import check_own_files

        check_own_files(plan.navigation.algorithms, plan.navigation.frame)
    if plan.navigator:
        from sinssim.simulation.foreign_navigator import check_programs

        check_programs(plan, to_start=False)
    check_limits(plan)
    if plan.flight is not None:
        from sinssim.truth.flight.jsbsim_model import check_fuel

        check_fuel(plan.flight)
    resolved, about_filter = plan, list[str]()
    if plan.filter is not None:
        from sinssim.scenario import filter_model as filter_states
        from sinssim.scenario.run_memory import check_memory

        resolved = filter_states.with_states(plan)
        check_memory(resolved)
        about_filter = [*filter_states.choice(plan), *(f"note        {note}" for note in filter_states.notes(plan))]
    return resolved, [*plan_lines(resolved), *about_filter]


def _check_log(plan: Scenario, as_json: bool) -> None:
    """Read the files of a scenario with recorded sensors, and show what they hold and what follows from them."""
    from sinssim.scenario import filter_model as filter_states
    from sinssim.scenario.plan_summary import plan_lines
    from sinssim.scenario.planned_limits import expected_duration
    from sinssim.scenario.run_memory import check_memory
    from sinssim.simulation.recorded_filter_run import prepare

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
