"""The command `adwa`: plan, evaluate, drive, suite make, suite show, demo.

Exit code 0: done; 1: ran, but found nothing; 2: bad input, said in one line.
"""

import json
import math
import os
import sys
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import jax
import numpy as np
import typer
from rich import box
from rich.console import Console
from rich.table import Table

from adwa_jax.astar import Status
from adwa_jax.grid import Grid
from adwa_jax.presets import PRESETS, Preset
from scenarios.errors import InputError
from scenarios.formats import MapFile, load_map, load_scen
from scenarios.suite import SUITE_NAMES, Suite, load_suite, make_suite, save_suite, suite_from_barn_folder, suite_on_map
from tuning.console import progress_bar, results_table, stderr
from tuning.evaluate import evaluate
from tuning.planning import PlannedPath, as_json, plan_paths, planner_constants, planner_options
from tuning.weights_file import load_weights, parse_weight_rule

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False, no_args_is_help=True,
    help="Plan, drive and judge a mobile robot's improved A* + DWA planner.",
)  # fmt: skip
suite_app = typer.Typer(no_args_is_help=True, help="Write suites of scenarios to a file, and picture them.")
app.add_typer(suite_app, name="suite")

FOUND_NOTHING, BAD_INPUT = 1, 2


class PlannerName(str, Enum):
    """Planners of `adwa plan`."""

    improved = "improved"
    traditional = "traditional"
    dijkstra = "dijkstra"


class ScopeName(str, Enum):
    """Where P of eq. 5 is taken."""

    start = "start"
    node = "node"


class UnknownPolicy(str, Enum):
    """What a map's unknown cells count as."""

    free = "free"
    occupied = "occupied"


MapOption = Annotated[Path | None, typer.Option("--map", help="MovingAI .map, ROS .yaml, BARN .world(.gz) or an image.")]
SuiteOption = Annotated[str | None, typer.Option("--suite", help=f"One of {', '.join(SUITE_NAMES)}.")]
SuiteFileOption = Annotated[Path | None, typer.Option(help="A saved suite, or a folder of BARN .world files.")]
CountOption = Annotated[int, typer.Option(help="How many scenarios.")]
SeedOption = Annotated[int, typer.Option(help="Seed of the scenarios.")]
PresetOption = Annotated[str, typer.Option(help=f"One of {', '.join(PRESETS)}.")]
WeightsOption = Annotated[Path | None, typer.Option(help="TOML of constants that stand in for the preset's.")]
JsonOption = Annotated[Path | None, typer.Option("--json", help="Write the results as JSON to this file; - prints them.")]
UnknownOption = Annotated[UnknownPolicy, typer.Option(help="What a map's unknown cells count as.")]
ResolutionOption = Annotated[float, typer.Option(help="Side of a pixel of a plain image [m].")]
SquaresOption = Annotated[int, typer.Option(help="With --map: unknown static obstacles a scenario.")]
MoversOption = Annotated[int, typer.Option(help="With --map: movers a scenario.")]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


@app.command("plan")
def plan_command(
    map: Annotated[Path, typer.Option(help="MovingAI .map, ROS .yaml, BARN .world(.gz) or an image.")],
    start: Annotated[str | None, typer.Option(help="X,Y in metres.")] = None,
    goal: Annotated[str | None, typer.Option(help="X,Y in metres.")] = None,
    scen: Annotated[Path | None, typer.Option(help="MovingAI .scen: all its queries.")] = None,
    limit: Annotated[int | None, typer.Option(help="Only the first so many queries of the .scen.")] = None,
    planner: PlannerName = PlannerName.improved,
    scope: ScopeName = ScopeName.node,
    weight_rule: Annotated[str | None, typer.Option(help="a,b,c,d: α, β, γ, δ of eq. 5.")] = None,
    robot_radius: Annotated[float, typer.Option(help="Obstacles are inflated by it [m].")] = 0.0,
    budget: Annotated[int | None, typer.Option(help="Expansions a search may take; default: as many as cells.")] = None,
    unknown: UnknownOption = UnknownPolicy.occupied,
    resolution: ResolutionOption = 1.0,
    json_file: JsonOption = None,
    figure: Annotated[Path | None, typer.Option(help="Draw the (first) plan to this picture.")] = None,
    quiet: QuietOption = False,
) -> None:
    """Plan paths on a known map."""
    map_file = load_map(map, resolution)
    grid = _grid(map_file, unknown, quiet)
    queries, expected = _queries(map_file, start, goal, scen, limit)
    _require_length("--robot-radius", robot_radius)
    constants = planner_constants(parse_weight_rule(weight_rule) if weight_rule else None, robot_radius)
    options = planner_options(planner.value, scope.value, _budget(budget))
    with progress_bar("planning", quiet) as progress:
        answers = list(plan_paths(grid, map_file.to_grid_frame(queries), constants, options, progress))
    records = [as_json(answer, map_file.to_world, listed, scen is not None)
               for answer, listed in zip(answers, expected, strict=True)]  # fmt: skip
    _write_json(records, json_file)
    if not quiet and str(json_file) != "-" and any(answer.status == Status.FOUND for answer in answers):
        Console().print(_plans_table(records))
    if figure:
        _draw_plan(figure, grid, map_file, answers[0], planner.value)
    _exit_by_status(answers, records)


@app.command("evaluate")
def evaluate_command(
    suite: SuiteOption = None,
    suite_file: SuiteFileOption = None,
    map: MapOption = None,
    count: CountOption = 100,
    seed: SeedOption = 0,
    preset: PresetOption = "paper",
    weights: WeightsOption = None,
    unknown: UnknownOption = UnknownPolicy.occupied,
    resolution: ResolutionOption = 1.0,
    unknown_obstacles: SquaresOption = 5,
    movers: MoversOption = 5,
    json_file: JsonOption = None,
    out: Annotated[Path | None, typer.Option(help="Folder for results.json, results.csv and a contact sheet.")] = None,
    quiet: QuietOption = False,
) -> None:
    """Drive every scenario of a suite and judge the planner."""
    config = _config(preset, weights)
    chosen = _suite(suite, suite_file, map, count, seed, config, unknown, resolution, unknown_obstacles, movers, quiet)
    with progress_bar(f"evaluating {chosen.name}", quiet) as progress:
        results = evaluate(chosen, config, progress=progress)
    _write_json(results.summary(), json_file)
    if out:
        results.write(out)
        _draw_sheet(chosen, out / "scenarios.png")
    if not quiet and str(json_file) != "-":
        Console().print(results_table(results))
    if not results.reached.any():
        raise typer.Exit(FOUND_NOTHING)


@app.command("drive")
def drive_command(
    suite: SuiteOption = None,
    suite_file: SuiteFileOption = None,
    map: MapOption = None,
    index: Annotated[int, typer.Option(help="Which scenario of the suite, from 0.")] = 0,
    seed: SeedOption = 0,
    preset: PresetOption = "paper",
    weights: WeightsOption = None,
    unknown: UnknownOption = UnknownPolicy.occupied,
    resolution: ResolutionOption = 1.0,
    unknown_obstacles: SquaresOption = 5,
    movers: MoversOption = 5,
    figure: Annotated[Path, typer.Option(help="Picture to write.")] = Path("drive.png"),
    animation: Annotated[Path | None, typer.Option(help="Animation to write: .gif or .mp4.")] = Path("drive.gif"),
    json_file: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Drive one scenario and picture it."""
    from tuning.replay import draw_replay, replay

    config = _config(preset, weights)
    if index < 0:
        raise InputError(f"--index: {index}; must be ≥ 0; the first scenario is 0")
    chosen = _suite(suite, suite_file, map, index + 1, seed, config, unknown, resolution, unknown_obstacles, movers,
                    quiet)
    if index >= len(chosen.scenarios):
        raise InputError(f"--index: {index}; {chosen.name} has {len(chosen.scenarios)} scenarios; choose a lower one")
    with progress_bar("driving", quiet):
        driven = replay(chosen.scenarios[index], config)
        written = draw_replay(driven, f"{chosen.name}, scenario {index}", _parent_made(figure),
                              _parent_made(animation) if animation else None)
    _write_json(driven.summary(), json_file)
    if not quiet and str(json_file) != "-":
        print(driven.sentence())
        print("wrote", ", ".join(str(path) for path in written))


@suite_app.command("make")
def suite_make_command(
    name: Annotated[str, typer.Argument(help=f"One of {', '.join(SUITE_NAMES)}, or a folder of BARN .world files.")],
    out: Annotated[Path, typer.Option(help="File to write.")],
    count: CountOption = 100,
    seed: SeedOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Write a suite to one file, with the recipe and seed that made it."""
    made = suite_from_barn_folder(Path(name)) if Path(name).is_dir() else make_suite(name, seed, count)
    save_suite(made, _parent_made(out))
    if not quiet:
        print(f"wrote {out}: {len(made.scenarios)} scenarios of {made.name}")


@suite_app.command("show")
def suite_show_command(
    file: Annotated[Path, typer.Argument(help="A saved suite, or a folder of BARN .world files.")],
    figure: Annotated[Path, typer.Option(help="Picture to write.")] = Path("suite.png"),
    limit: Annotated[int, typer.Option(help="Draw at most so many scenarios.")] = 24,
    quiet: QuietOption = False,
) -> None:
    """Print a suite's recipe and draw its scenarios."""
    shown = _suite_from_file(file)
    if limit < 1:
        raise InputError(f"--limit: {limit}; must be ≥ 1; draw at least one scenario")
    _draw_sheet(shown, _parent_made(figure), limit)
    if not quiet:
        print(f"{shown.name}: {len(shown.scenarios)} scenarios")
        print(f"recipe: {json.dumps(shown.recipe)}")
        print(f"wrote {figure}")


@app.command("demo")
def demo_command(
    out: Annotated[Path, typer.Option(help="Folder for the tables and pictures.")] = Path("out"),
    count: Annotated[int, typer.Option(help="Scenarios a map size.")] = 200,
    seed: SeedOption = 0,
    quiet: QuietOption = False,
) -> None:
    """The paper's Table 1 and Figs. 3 and 4, over many maps."""
    from tuning.demo import run_demo

    if count < 1:
        raise InputError(f"--count: {count}; must be ≥ 1; the demo uses 200")
    run_demo(out, count, seed, quiet)


def main() -> None:
    """Entry point: an InputError becomes one line and exit code 2, Ctrl-C exit code 130."""
    _use_compile_cache()
    try:
        app()
    except InputError as error:
        _fail(str(error))
    except OSError as error:
        _fail(f"{error.filename}: {error.strerror}; check the path, its permissions and the free space")
    except KeyboardInterrupt:
        sys.exit(130)


def _fail(message: str) -> None:
    print("adwa: " + " ".join(message.split()), file=sys.stderr)
    sys.exit(BAD_INPUT)


def _use_compile_cache() -> None:
    """Compiled programs are kept in JAX_COMPILATION_CACHE_DIR, else in ~/.cache/adwa-jax."""
    if not os.environ.get("JAX_COMPILATION_CACHE_DIR"):
        jax.config.update("jax_compilation_cache_dir", str(Path.home() / ".cache" / "adwa-jax"))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.5)


def _config(preset: str, weights: Path | None) -> Preset:
    if preset not in PRESETS:
        raise InputError(f"--preset: {preset!r}; the presets are {', '.join(PRESETS)}; choose one of them")
    config = PRESETS[preset]()
    return config._replace(constants=load_weights(weights, config.constants)) if weights else config


def _suite(suite: str | None, suite_file: Path | None, map: Path | None, count: int, seed: int, config: Preset,
           unknown: UnknownPolicy, resolution: float, squares: int, movers: int, quiet: bool) -> Suite:
    """The one suite that the options name."""
    given = [option for option in (suite, suite_file, map) if option is not None]
    if len(given) != 1:
        raise InputError(f"--suite, --suite-file, --map: {len(given)} given; exactly one says what to drive; give one")
    if suite is not None:
        return make_suite(suite, seed, count)
    if suite_file is not None:
        return _suite_from_file(suite_file)
    map_file = load_map(map, resolution)  # pyright: ignore[reportArgumentType]
    grid = _grid(map_file, unknown, quiet)
    radius = float(config.constants.robot.radius)
    return suite_on_map(map_file.name, grid, seed, count, squares, movers, radius)


def _suite_from_file(path: Path) -> Suite:
    return suite_from_barn_folder(path) if path.is_dir() else load_suite(path)


def _grid(map_file: MapFile, unknown: UnknownPolicy, quiet: bool) -> Grid:
    if not quiet and map_file.unknown.any():
        share = f"{map_file.unknown_share:.1%} of {map_file.name} is unknown"
        stderr().print(f"{share} and counts as {unknown.value} (--unknown)", highlight=False, soft_wrap=True)
    return map_file.grid(unknown.value)


def _queries(map_file: MapFile, start: str | None, goal: str | None, scen: Path | None,
             limit: int | None) -> tuple[np.ndarray, list[float | None]]:
    """[Q, 2, 2] start and goal of every query [m], world frame, and the length listed for each."""
    if (scen is None) == (start is None and goal is None):
        raise InputError("--start, --goal, --scen: give either --start and --goal, or --scen; add what is missing")
    if scen is None:
        return np.array([[_point("--start", start), _point("--goal", goal)]]), [None]
    if limit is not None and limit < 1:
        raise InputError(f"--limit: {limit}; must be ≥ 1; leave it out for all queries")
    entries = load_scen(scen)[:limit]
    height, width = map_file.occupied.shape
    for entry in entries:
        if (entry.height, entry.width) != (height, width):
            raise InputError(f"{scen}:{entry.line}: width x height {entry.width} x {entry.height}; {map_file.name} has "
                             f"{width} x {height}; name the map this file was made for")
    points = np.array([[entry.start_point, entry.goal_point] for entry in entries], np.float64)
    return points.reshape(-1, 2, 2), [entry.expected for entry in entries]


def _point(option: str, text: str | None) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in (text or "").split(","))
        if math.isfinite(x) and math.isfinite(y):
            return x, y
    except ValueError:
        pass
    raise InputError(f"{option}: {text!r}; must be two numbers X,Y in metres; write for instance {option} 1.5,2.5")


def _budget(budget: int | None) -> int | None:
    if budget is not None and budget < 1:
        raise InputError(f"--budget: {budget}; must be ≥ 1 expansion; leave it out for as many as there are cells")
    return budget


def _require_length(option: str, value: float) -> None:
    if not (math.isfinite(value) and value >= 0):
        raise InputError(f"{option}: {value}; must be a finite number ≥ 0; give it in metres")


def _write_json(content: Any, path: Path | None) -> None:
    if path is None:
        return
    text = _json_text(content) + "\n"
    if str(path) == "-":
        sys.stdout.write(text)
    else:
        _parent_made(path).write_text(text)


def _json_text(content: Any) -> str:
    """A list with one object a line, an object with one field a line: paths stay readable."""
    if isinstance(content, list):
        return "[\n" + ",\n".join(json.dumps(item) for item in content) + "\n]"
    lines = [f" {json.dumps(key)}: {_json_text(value) if _is_rows(value) else json.dumps(value)}"
             for key, value in content.items()]  # fmt: skip
    return "{\n" + ",\n".join(lines) + "\n}"


def _is_rows(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict)


def _parent_made(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _plans_table(records: list[dict[str, Any]], most: int = 20) -> Table:
    counts = {status.name: sum(record["status"] == status.name for record in records) for status in Status}
    title = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    columns = {"status": "status", "length": "length", "expected": "listed", "expansions": "expanded",
               "breaking_points": "turns", "danger_points": "danger", "key_point_length": "key-point"}  # fmt: skip
    shown = {name: heading for name, heading in columns.items() if name in records[0]}
    table.add_column("start", no_wrap=True)
    table.add_column("goal", no_wrap=True)
    for heading in shown.values():
        table.add_column(heading, justify="right", no_wrap=True)
    for record in records[:most]:
        points = [f"{record[end][0]:g},{record[end][1]:g}" for end in ("start", "goal")]
        table.add_row(*points, *(_cell(record[name]) for name in shown))
    if len(records) > most:
        table.caption = f"{len(records) - most} more (--json has them all)"
    return table


def _cell(value: Any) -> str:
    return "–" if value is None else f"{value:.4f}" if isinstance(value, float) else str(value)


def _exit_by_status(answers: list[PlannedPath], records: list[dict[str, Any]]) -> None:
    """Say in a line why a lone query has no path; fail where no query has one."""
    if any(answer.status == Status.FOUND for answer in answers):
        return
    if len(answers) == 1:
        status, record = answers[0].status, records[0]
        print(f"adwa: {_reason(status, record)}", file=sys.stderr)
        raise typer.Exit(BAD_INPUT if status in (Status.BAD_START, Status.BAD_GOAL) else FOUND_NOTHING)
    print(f"adwa: none of the {len(answers)} queries has a path; see their status", file=sys.stderr)
    raise typer.Exit(FOUND_NOTHING)


def _reason(status: Status, record: dict[str, Any]) -> str:
    if status in (Status.BAD_START, Status.BAD_GOAL):
        end = "start" if status == Status.BAD_START else "goal"
        return (f"--{end}: {record[end]}; lies outside the map, in an obstacle, or within --robot-radius of one; "
                "choose a free point or a smaller radius")  # fmt: skip
    if status == Status.BUDGET_EXHAUSTED:
        return f"--budget: used up after {record['expansions']} expansions without reaching the goal; raise it"
    return (f"--goal: {record['goal']} is UNREACHABLE from --start {record['start']}; no free way joins them; "
            "choose another goal, a smaller --robot-radius, or --unknown free")  # fmt: skip


def _draw_plan(figure: Path, grid: Grid, map_file: MapFile, answer: PlannedPath, planner: str) -> None:
    from tuning.figures import plan_figure

    _save(plan_figure(grid, answer, planner, y_down=map_file.y_down), figure)


def _draw_sheet(suite: Suite, path: Path, limit: int = 24) -> None:
    from scenarios.drawing import contact_sheet

    _save(contact_sheet(suite, limit=limit), path)


def _save(figure: Any, path: Path) -> None:
    import matplotlib.pyplot as plt

    try:
        figure.savefig(_parent_made(path), dpi=150)
    except ValueError as error:
        raise InputError(f"{path}: {error}; end the name in .png, .pdf or .svg") from None
    finally:
        plt.close(figure)
