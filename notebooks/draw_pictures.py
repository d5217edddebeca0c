"""Draws the README's pictures into `pictures/` (`make figures`); the job that some of them show is `make demo`'s."""

from pathlib import Path

from adwa_jax import extended, paper
from scenarios.suite import make_suite
from tuning.demo import run_demo
from tuning.evaluate import evaluate
from tuning.gallery import grouped, sheet
from tuning.outputs import save_figure
from tuning.replay import draw_replay, replay
from tuning.report_figures import front_figure, parallel_figure
from tuning.run_job import open_job
from tuning.stage_figures import decision_figure
from tuning.stages import moment

HERE = Path(__file__).resolve().parent
PICTURES = HERE / "pictures"


def main() -> None:
    """All of them."""
    draw_drive()
    draw_decision()
    draw_job()
    draw_failures()


def draw_drive() -> None:
    """One drive of the extended planner, still and moving."""
    driven = replay(make_suite("paper-25", seed=0, count=4).scenarios[3], extended())
    draw_replay(driven, "extended", PICTURES / "drive.png", PICTURES / "drive.gif")


def draw_decision() -> None:
    """One decision of the paper's planner beside movers."""
    config, scenario = paper(), make_suite("paper-15", seed=0, count=1).scenarios[0]
    driven = replay(scenario, config)
    save_figure(lambda: decision_figure(scenario, moment(driven, config, 80), driven.robot), PICTURES / "decision.png")


def draw_job() -> None:
    """Front and trade-offs of the demo's job."""
    folder = HERE.parent / "out" / "demo"
    run_demo(folder, quiet=True)
    job = open_job(folder / "job_0")
    save_figure(lambda: front_figure(job.findings, job.training), PICTURES / "front.png")
    save_figure(lambda: parallel_figure(job.findings), PICTURES / "parallel.png")


def draw_failures() -> None:
    """Why the paper's planner fails, by cause: the most frequent one."""
    config, suite = paper(), make_suite("paper-15", seed=1, count=64)
    groups = grouped(suite, evaluate(suite, config), config)
    cause = max(groups, key=lambda name: len(groups[name].indices))
    save_figure(lambda: sheet(cause, groups[cause], suite), PICTURES / "failures.png")


if __name__ == "__main__":
    main()
