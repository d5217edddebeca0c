"""A job killed at random moments, again and again: `python -m tests.benchmarks.kills 20`.

It must end in the bytes of one that was left alone, and must not drive twice what it had kept.
"""

import random
import sys
import tempfile
import time
from pathlib import Path

from tests.test_tuning.jobs import JOB, pairs_driven, results_of, written
from tests.test_tuning.test_run_job import started, until_blocks
from tuning.job_folder import events_of

EPISODES = 145  # some 60 blocks


def main(kills: int, seed: int = 0) -> None:
    """Run one job alone and one with the kills, and compare."""
    draw = random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        file = written(Path(place), JOB.replace("episodes = 45", f"episodes = {EPISODES}"))
        whole, killed = Path(place) / "whole", Path(place) / "killed"
        _ended(started("run", file, "--out", whole))
        blocks = sum(event["event"] == "block" for event in events_of(whole))
        for kill in range(kills):
            begun = (killed / "job.toml").exists()
            process = started(*(("resume", killed) if begun else ("run", file, "--out", killed)))
            if draw.random() < 0.8:
                until_blocks(killed, round((kill + draw.random()) * blocks / kills), process)
            time.sleep(draw.random() * 0.3)
            process.kill()
            process.communicate()
        _ended(started("resume", killed))
        driven = pairs_driven(events_of(killed))
        print(f"{kills} kills: same bytes {results_of(killed) == results_of(whole)} ({len(results_of(whole))} files); "
              f"{len(driven)} episodes in kept blocks, {len(driven) - len(set(driven))} of them twice; "
              f"{len(pairs_driven(events_of(whole)))} in the job that was left alone")  # fmt: skip


def _ended(process) -> None:
    out, err = process.communicate()
    assert (process.returncode, out, err) == (0, "", ""), err


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
