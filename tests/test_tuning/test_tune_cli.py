"""What `adwa tune` tells of a job."""

import pytest
from typer.testing import CliRunner

from tests.test_tuning.jobs import JOB, written
from tuning import cli
from tuning.tune_cli import status_lines

BEST = {"objectives": {"success": 0.75}, "violation": 0.0, "constants": {"clearance": 0.3}}
GENERATION = {"event": "generation", "generation": 4, "spent": 500, "best": BEST}
BLOCK = {"event": "block", "episodes": 100, "seconds": 10.0}


def test_the_status_is_how_far_the_best_and_the_time_left():
    """500 of 1000 episodes are left, at 10 a second."""
    assert status_lines("office", 1000, [BLOCK, GENERATION], "17") == [
        "office: process 17 works on it; generation 4, 500 of at most 1000 episodes (50%)",
        "best first objective: success 0.75",
        "by clearance = 0.3",
        "10 episodes a second; at most 0:00:50 left for the search",
    ]


@pytest.mark.parametrize("event", [{"event": "generation"}, {"event": "generation", "best": BEST}, {"event": "block"},
                                   {"event": "block", "episodes": "?", "seconds": 1.0}])
def test_a_line_of_the_log_without_its_facts_tells_nothing(event):
    events = [BLOCK, GENERATION]
    assert status_lines("office", 1000, [*events, event], None) == status_lines("office", 1000, events, None)


def test_a_best_without_its_facts_is_left_out():
    lines = status_lines("office", 1000, [GENERATION | {"best": {"objectives": {}}}], None)
    assert lines == ["office: stopped; generation 4, 500 of at most 1000 episodes (50%)"]


def test_a_check_tells_what_may_not_be_meant(tmp_path):
    file = written(tmp_path, JOB.replace("high = 0.5", "high = 0.03"))
    result = CliRunner().invoke(cli.app, ["tune", "check", str(file)])
    assert result.exit_code == 0
    first, last = result.stdout.splitlines()
    assert first.startswith(f"{file}: parameters.clearance: the default, 0.")
    assert last == f"{file}: 5 training scenarios, 3 held-out scenarios, 2 parameters, 4 objectives"
