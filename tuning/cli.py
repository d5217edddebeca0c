"""The command `adwa`: plan, evaluate, ablate, weights, drive, suite make, suite show, tune, claims, demo.

Exit code 0: done; 1: ran, but found nothing; 2: bad input, said in one line.
"""

import io
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from adwa_jax.astar import Status
from adwa_jax.episode import Outcome
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.presets import Preset
from adwa_jax.rules import RULE_NAMES
from scenarios.errors import InputError
from scenarios.formats import MapFile, load_map
from scenarios.suite import SUITE_NAMES, Suite, save_suite
from tuning.compiled import keep_compiled
from tuning.console import note, plans_table, progress_bar, results_table, show
from tuning.evaluate import Interrupted, evaluate
from tuning.interrupts import keep_interrupts
from tuning.options import (
    MAP_HELP,
    CountOption,
    JsonOption,
    MapOption,
    MoversOption,
    PresetOption,
    QuietOption,
    RangeOption,
    ResolutionOption,
    RobotOption,
    SeedOption,
    SensedOnlyOption,
    SpeedOption,
    SquaresOption,
    SuiteFileOption,
    SuiteOption,
    UnknownOption,
    UnknownPolicy,
    Vehicle,
    WeightsOption,
    configured,
    reach_of,
    require_one_disc,
)
from tuning.outputs import ANIMATIONS, PICTURES, STDOUT, check_file, check_folder, parent_made, save_figure, write_json
from tuning.planning import PlannedPath, as_json, plan_paths, planner_constants, planner_options, why_blocked
from tuning.results import Results
from tuning.sources import Source, Work, options_named, read_grid, read_queries, read_suite
from tuning.start import INTERRUPTED
from tuning.suite_files import KINDS, suite_in
from tuning.tune_cli import tune_app
from tuning.weights_file import load_weight_rule, parse_weight_rule, weights_text

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False,
    help="Plan, drive and judge a mobile robot's improved A* + DWA planner.",
)  # fmt: skip
suite_app = typer.Typer(help="Write suites of scenarios to a file, and picture them.")
app.add_typer(suite_app, name="suite")
app.add_typer(tune_app, name="tune")

FOUND_NOTHING, BAD_INPUT = 1, 2
LARGEST_RADIUS = 1e6  # [m]


class PlannerName(StrEnum):
    """Planners of `adwa plan`."""

    improved = "improved"
    traditional = "traditional"
    dijkstra = "dijkstra"


class ScopeName(StrEnum):
    """Where P of eq. 5 is taken."""

    start = "start"
    node = "node"


@app.callback(invoke_without_command=True)
@suite_app.callback(invoke_without_command=True)
@tune_app.callback(invoke_without_command=True)
def help_alone(context: typer.Context) -> None:
    """Without a command: how to give one."""
    if context.invoked_subcommand is None:
        print(context.get_help())
        raise typer.Exit(BAD_INPUT)


@app.command("plan")
def plan_command(
    map: Annotated[Path, typer.Option(help=MAP_HELP)],
    start: Annotated[str | None, typer.Option(help="X,Y in metres.")] = None,
    goal: Annotated[str | None, typer.Option(help="X,Y in metres.")] = None,
    scen: Annotated[Path | None, typer.Option(help="MovingAI .scen: all its queries.")] = None,
    limit: Annotated[int | None, typer.Option(help="Only the first so many queries of the .scen.")] = None,
    planner: PlannerName = PlannerName.improved,
    scope: ScopeName = ScopeName.node,
    weight_rule: Annotated[str | None, typer.Option(help="a,b,c,d: α, β, γ, δ of eq. 5.")] = None,
    weights: Annotated[Path | None, typer.Option(help="TOML of constants; those of eq. 5 are taken.")] = None,
    robot_radius: Annotated[float, typer.Option(help="Obstacles are inflated by it, in metres.")] = 0.0,
    budget: Annotated[int | None, typer.Option(help="Expansions a search may take; default: as many as cells.")] = None,
    unknown: UnknownOption = UnknownPolicy.occupied,
    resolution: ResolutionOption = 1.0,
    json_file: JsonOption = None,
    figure: Annotated[Path | None, typer.Option(help="Draw the (first) plan to this picture.")] = None,
    quiet: QuietOption = False,
) -> None:
    """Plan paths on a known map."""
    _check_outputs(json_file, figure)
    _require_radius(robot_radius)
    constants = planner_constants(_weight_rule(weight_rule, weights), robot_radius)
    options = planner_options(planner.value, scope.value, _budget(budget))
    with options_named(resolution="--resolution"):
        map_file = load_map(map, resolution)
    queries = read_queries(map_file, start, goal, scen, limit, quiet)
    grid = read_grid(map_file, unknown.value, quiet)
    with progress_bar("planning", quiet) as progress, _sizes_refused(map_file.name):
        answers = list(plan_paths(grid, map_file.to_grid_frame(queries.points), constants, options, progress))
    records = [as_json(answer, map_file, expected, queries.listed)
               for answer, expected in zip(answers, queries.expected, strict=True)]  # fmt: skip
    write_json(records, json_file)
    if not quiet and json_file != STDOUT and (queries.listed or answers[0].status == Status.FOUND):
        show(plans_table(map_file.name, records))
    if figure:
        from tuning.figures import plan_figure

        save_figure(lambda: plan_figure(grid, answers[0], planner.value, y_down=map_file.y_down), figure)
    _exit_by_status(answers, records, queries.listed, map_file, robot_radius)


@app.command("evaluate")
def evaluate_command(
    suite: SuiteOption = None,
    suite_file: SuiteFileOption = None,
    map: MapOption = None,
    count: CountOption = None,
    seed: SeedOption = 0,
    sensed_only: SensedOnlyOption = False,
    preset: PresetOption = "paper",
    weights: WeightsOption = None,
    robot: RobotOption = None,
    v_max: SpeedOption = None,
    sensor_range: RangeOption = None,
    unknown: UnknownOption = UnknownPolicy.occupied,
    resolution: ResolutionOption = 1.0,
    unknown_obstacles: SquaresOption = None,
    movers: MoversOption = None,
    json_file: JsonOption = None,
    out: Annotated[Path | None, typer.Option(help="Folder for results.json, results.csv and a contact sheet.")] = None,
    feasible: Annotated[bool, typer.Option("--feasible", help="Prove which scenarios can be solved at all.")] = False,
    gallery: Annotated[Path | None, typer.Option(help="Folder for pictures of the failures, by cause.")] = None,
    quiet: QuietOption = False,
) -> None:
    """Drive every scenario of a suite and judge the planner."""
    _check_outputs(json_file)
    check_folder("--out", out)
    check_folder("--gallery", gallery)
    config = configured(preset, Vehicle(robot, v_max, sensor_range), weights)
    source = Source(suite, suite_file, map, count, seed, unknown.value, resolution, unknown_obstacles, movers,
                    sensed_only)  # fmt: skip
    if feasible:
        require_one_disc("--feasible", config)
    work = _work(source, config, quiet)
    chosen = work.suite
    try:
        with progress_bar(f"evaluating {chosen.name}", quiet) as progress, _sizes_refused(chosen.name):
            results = evaluate(chosen, config, progress=progress)
    except Interrupted as stopped:
        _report_part(stopped, json_file, out, quiet)
        raise
    if feasible:
        results = _labelled(results, chosen, config, quiet)
    write_json(results.summary(), json_file)
    if out:
        results.write(out)
        _draw_sheet(chosen, out / "scenarios.png", quiet)
    if gallery:
        _draw_gallery(gallery, work, results, config, quiet)
    if not quiet and json_file != STDOUT:
        show(results_table(results))
    if not results.reached.any():
        note(f"adwa: none of the {results.count} scenarios reached its goal; see their outcomes")
        raise typer.Exit(FOUND_NOTHING)


def _report_part(stopped: Interrupted, json_file: Path | None, out: Path | None, quiet: bool) -> None:
    """Write and show what was done before the user stopped."""
    results = stopped.results
    done = 0 if results is None else results.count
    note(f"adwa: stopped; {done} of {stopped.total} scenarios are done" + ("" if results is None else ", as follows"))
    if results is None:
        return
    write_json(results.summary(), json_file)
    if out:
        results.write(out)
    if not quiet and json_file != STDOUT:
        show(results_table(results))


@app.command("ablate")
def ablate_command(
    name: Annotated[str | None, typer.Argument(metavar="[SUITE]", help="The suite, as by --suite.")] = None,
    suite: SuiteOption = None,
    suite_file: SuiteFileOption = None,
    map: MapOption = None,
    count: CountOption = None,
    seed: SeedOption = 0,
    sensed_only: SensedOnlyOption = False,
    rule: Annotated[list[str] | None, typer.Option(help="Only this rule; may be given again; default: all.")] = None,
    robot: RobotOption = None,
    v_max: SpeedOption = None,
    sensor_range: RangeOption = None,
    unknown: UnknownOption = UnknownPolicy.occupied,
    resolution: ResolutionOption = 1.0,
    unknown_obstacles: SquaresOption = None,
    movers: MoversOption = None,
    out: Annotated[Path, typer.Option(help="Folder for ablation.md, .json, .csv and .png.")] = Path("ablation"),
    quiet: QuietOption = False,
) -> None:
    """Compare the paper's and the extended planner with and without each rule, on common scenarios."""
    from tuning.ablate import ablate
    from tuning.ablation_report import ablation_table, draw_ablation, row_sentence, write_ablation

    check_folder("--out", out)
    rules, vehicle = _rules(rule), Vehicle(robot, v_max, sensor_range)
    if name and suite:
        raise InputError(f"--suite: {suite}; the suite {name} is given already; name one of them")
    source = Source(name or suite, suite_file, map, count, seed, unknown.value, resolution, unknown_obstacles, movers,
                    sensed_only)  # fmt: skip
    chosen = _work(source, configured("paper", vehicle), quiet).suite
    rows = []
    with progress_bar(f"comparing on {chosen.name}", quiet) as progress, _sizes_refused(chosen.name):
        for row in ablate(chosen, rules, vehicle.driving, progress):
            rows.append(row)
            write_ablation(out, chosen, rows)
            if not quiet:
                note(row_sentence(row))
    draw_ablation(out, chosen, rows)
    if not quiet:
        show(ablation_table(chosen, rows))
        print(f"wrote ablation.md, .json, .csv and .png in {out}")


@app.command("weights")
def weights_command(
    preset: PresetOption = "paper",
    robot: RobotOption = None,
    v_max: SpeedOption = None,
) -> None:
    """Print a preset's constants as TOML, to change and to give back with --weights."""
    config = configured(preset, Vehicle(robot, v_max))
    print(weights_text(config), end="")


@app.command("drive")
def drive_command(
    suite: SuiteOption = None,
    suite_file: SuiteFileOption = None,
    map: MapOption = None,
    index: Annotated[int, typer.Option(help="Which scenario of the suite, from 0.")] = 0,
    seed: SeedOption = 0,
    sensed_only: SensedOnlyOption = False,
    preset: PresetOption = "paper",
    weights: WeightsOption = None,
    robot: RobotOption = None,
    v_max: SpeedOption = None,
    sensor_range: RangeOption = None,
    unknown: UnknownOption = UnknownPolicy.occupied,
    resolution: ResolutionOption = 1.0,
    unknown_obstacles: SquaresOption = None,
    movers: MoversOption = None,
    figure: Annotated[Path, typer.Option(help="Picture to write.")] = Path("drive.png"),
    animation: Annotated[Path | None, typer.Option(help="Animation to write: .gif or .mp4.")] = Path("drive.gif"),
    json_file: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Drive one scenario and picture it."""
    from tuning.replay import draw_replay, replay

    _check_outputs(json_file, figure)
    _check_animation(animation)
    config = configured(preset, Vehicle(robot, v_max, sensor_range), weights)
    if index < 0:
        raise InputError(f"--index: {index}; must be ≥ 0; the first scenario is 0")
    source = Source(suite, suite_file, map, None, seed, unknown.value, resolution, unknown_obstacles, movers,
                    sensed_only, index)  # fmt: skip
    work = _work(source, config, quiet)
    chosen = work.suite
    with progress_bar("driving", quiet), _sizes_refused(chosen.name):
        driven = replay(chosen.scenarios[index], config)
    with progress_bar("drawing", quiet) as progress:
        written = draw_replay(driven, f"{chosen.name}, scenario {index}", figure, animation, work.y_down, progress)
    write_json(driven.summary(), json_file)
    if not quiet and json_file != STDOUT:
        print(driven.sentence())
        print("wrote", ", ".join(str(path) for path in written))
    if driven.outcome == Outcome.NO_PATH:
        raise typer.Exit(FOUND_NOTHING)


@suite_app.command("make")
def suite_make_command(
    name: Annotated[str, typer.Argument(help=f"One of {', '.join(SUITE_NAMES)}, or {KINDS}.")],
    out: Annotated[Path, typer.Option(help="File to write.")],
    count: CountOption = None,
    seed: SeedOption = 0,
    sensed_only: SensedOnlyOption = False,
    quiet: QuietOption = False,
) -> None:
    """Write a suite to one file, with the recipe and seed that made it."""
    check_file("--out", out)
    if out.exists() and not out.is_file():
        raise InputError(f"--out: {out}; is no regular file, which a suite would replace; name another")
    source = Source(name, None, None, count, seed, sensed_only=sensed_only)
    with progress_bar(f"making {name}", quiet) as progress, options_named(**{"--suite": "NAME"}):
        made = read_suite(source, 0.0, quiet, progress).suite
    save_suite(made, parent_made(out))
    if not quiet:
        print(f"wrote {out}: {len(made.scenarios)} scenarios of {made.name}")


@suite_app.command("show")
def suite_show_command(
    file: Annotated[Path, typer.Argument(help=f"{KINDS[0].upper()}{KINDS[1:]}.")],
    figure: Annotated[Path, typer.Option(help="Picture to write.")] = Path("suite.png"),
    limit: Annotated[int, typer.Option(help="Draw at most so many scenarios.")] = 24,
    quiet: QuietOption = False,
) -> None:
    """Print a suite's recipe and draw its scenarios."""
    check_file("--figure", figure, PICTURES)
    if limit < 1:
        raise InputError(f"--limit: {limit}; must be ≥ 1; draw at least one scenario")
    shown = suite_in(file)
    _draw_sheet(shown, figure, quiet, limit)
    if not quiet:
        print(f"{shown.name}: {len(shown.scenarios)} scenarios")
        print(f"recipe: {json.dumps(shown.recipe)}")
        print(f"wrote {figure}")


@app.command("claims")
def claims_command(
    out: Annotated[Path, typer.Option(help="Folder for the tables and pictures.")] = Path("out"),
    count: Annotated[int, typer.Option(help="Scenarios a map size.")] = 200,
    seed: SeedOption = 0,
    quiet: QuietOption = False,
) -> None:
    """The paper's Table 1 and Figs. 3 and 4, over many maps."""
    from tuning.claims import run_claims

    check_folder("--out", out)
    if count < 1:
        raise InputError(f"--count: {count}; must be ≥ 1; 200 takes a few minutes")
    run_claims(out, count, seed, quiet)


@app.command("demo")
def demo_command(
    out: Annotated[Path, typer.Option(help="Folder for the tuning job and its report.")] = Path("out/demo"),
    seed: SeedOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Tune the extended planner on 20 x 20 maps, in a few minutes."""
    from tuning.demo import run_demo

    check_folder("--out", out)
    run_demo(out, seed, quiet)


def main() -> None:
    """Entry point: a user's mistake becomes one line and exit code 2, Ctrl-C exit code 130."""
    keep_compiled()
    keep_interrupts()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # file names and ω need not be in the terminal's alphabet
            stream.reconfigure(errors="backslashreplace")
    try:
        code = app(prog_name="adwa", standalone_mode=False)
        sys.stdout.flush()
    except InputError as error:
        _fail(str(error))
    except BrokenPipeError:  # the reader of our output has left
        _drop_output()
        sys.exit(FOUND_NOTHING)
    except OSError as error:
        _drop_output()
        _fail(f"{error.filename or 'output'}: {error.strerror}; check the path, its permissions and the free space")
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except Exception as error:
        if not hasattr(error, "format_message"):  # typer's own errors have it: a command or option that is not there
            raise
        _fail(_usage(error))
    sys.exit(code or 0)


def _fail(message: str) -> None:
    for line in message.splitlines():
        print("adwa: " + " ".join(line.split()), file=sys.stderr)
    sys.exit(BAD_INPUT)


def _usage(error: Any) -> str:
    command = error.ctx.command_path if getattr(error, "ctx", None) else "adwa"
    message = error.format_message().rstrip(".").replace("Value error, ", "")
    return f"{message}; see {command} --help"


def _drop_output() -> None:
    """Let what is left in the buffer go nowhere, or the interpreter complains of it at its end."""
    if sys.stdout is sys.__stdout__:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _check_outputs(json_file: Path | None, figure: Path | None = None) -> None:
    if json_file != STDOUT:
        check_file("--json", json_file)
    check_file("--figure", figure, PICTURES)


def _rules(names: list[str] | None) -> tuple[str, ...]:
    for name in names or ():
        if name not in RULE_NAMES:
            raise InputError(f"--rule: {name!r}; the rules are {', '.join(RULE_NAMES)}; choose among them")
    return tuple(dict.fromkeys(names)) if names else RULE_NAMES


def _check_animation(animation: Path | None) -> None:
    check_file("--animation", animation, ANIMATIONS)
    if animation is not None:
        from tuning.animation import check_writer

        check_writer(animation)


def _work(source: Source, config: Preset, quiet: bool) -> Work:
    with progress_bar("making scenarios", quiet) as progress:
        return read_suite(source, reach_of(config.constants.robot), quiet, progress)


@contextmanager
def _sizes_refused(name: str) -> Iterator[None]:
    """Say which map or suite it was that a kernel finds too large."""
    try:
        yield
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{name}: {error}") from error
    except OverflowError as error:
        raise InputError(f"{name}: too long ({error}); squared distances must fit 32-bit integers; crop the map or "
                         "coarsen its resolution") from error


def _weight_rule(text: str | None, weights: Path | None) -> WeightRule | None:
    """That of --weight-rule or of --weights; None: the preset's."""
    if text is not None and weights is not None:
        raise InputError(f"--weights: {weights}; cannot go with --weight-rule; leave out one or the other")
    if weights is not None:
        return load_weight_rule(weights)
    return None if text is None else parse_weight_rule(text)


def _budget(budget: int | None) -> int | None:
    if budget is not None and budget < 1:
        raise InputError(f"--budget: {budget}; must be ≥ 1 expansion; leave it out for as many as there are cells")
    return budget


def _require_radius(radius: float) -> None:
    if not 0 <= radius <= LARGEST_RADIUS:
        raise InputError(f"--robot-radius: {radius}; must be from 0 to {LARGEST_RADIUS:g}; give it in metres")


def _exit_by_status(answers: list[PlannedPath], records: list[dict[str, Any]], listed: bool, map_file: MapFile,
                    robot_radius: float) -> None:
    """Say in a line why a lone query has no path; fail where no query has one."""
    if any(answer.status == Status.FOUND for answer in answers):
        return
    if listed:
        note(f"adwa: none of the {len(answers)} queries has a path; see their status")
        raise typer.Exit(FOUND_NOTHING)
    note(f"adwa: {_reason(answers[0], records[0], map_file, robot_radius)}")
    raise typer.Exit(BAD_INPUT if answers[0].status in (Status.BAD_START, Status.BAD_GOAL) else FOUND_NOTHING)


def _reason(answer: PlannedPath, record: dict[str, Any], map_file: MapFile, robot_radius: float) -> str:
    start, goal = (f"{record[end][0]:g},{record[end][1]:g}" for end in ("start", "goal"))
    if answer.status == Status.BAD_START:
        return f"--start: {start}; {why_blocked(map_file, np.array(answer.start), robot_radius)}"
    if answer.status == Status.BAD_GOAL:
        return f"--goal: {goal}; {why_blocked(map_file, np.array(answer.goal), robot_radius)}"
    if answer.status == Status.BUDGET_EXHAUSTED:
        return f"--budget: used up after {answer.expansions} expansions without reaching the goal; raise it"
    remedies = ["choose another goal", *["a smaller --robot-radius"] * (robot_radius > 0),
                *["--unknown free"] * bool(map_file.unknown.any())]  # fmt: skip
    return f"--goal: {goal} is UNREACHABLE from --start {start}; no free way joins them; {' or '.join(remedies)}"


def _labelled(results: Results, suite: Suite, config: Preset, quiet: bool) -> Results:
    """The results with what is proven of each scenario."""
    from scenarios.feasibility import label

    with progress_bar("proving feasibility", quiet) as progress, _sizes_refused(suite.name):
        labels = label(suite.scenarios, config.constants.robot, float(config.constants.behaviour.dt), progress)
    return replace(results, feasibility=labels)


def _draw_gallery(folder: Path, work: Work, results: Results, config: Preset, quiet: bool) -> None:
    from tuning.gallery import write_gallery

    with progress_bar("looking at failures", quiet) as progress:
        write_gallery(folder, work.suite, results, config, work.y_down, progress=progress)


def _draw_sheet(suite: Suite, path: Path, quiet: bool, limit: int = 24) -> None:
    from scenarios.drawing import contact_sheet

    with progress_bar("drawing", quiet):
        save_figure(lambda: contact_sheet(suite, limit=limit), path)
