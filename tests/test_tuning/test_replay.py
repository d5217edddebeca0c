import json

import numpy as np
import pytest

from adwa_jax.episode import Outcome
from adwa_jax.presets import paper
from tests.test_tuning.worlds import brief, mixed_suite, part_of
from tuning.evaluate import evaluate
from tuning.replay import replay

SUITE = mixed_suite()
NAMES = ("small", "walled", "brief", "detour")


@pytest.fixture(scope="module")
def evaluated():
    return {name: evaluate(part_of(SUITE, [SUITE.names.index(name)]), paper()).scenario(0) for name in NAMES}


@pytest.fixture(scope="module")
def replayed():
    return {name: replay(SUITE.scenarios[SUITE.names.index(name)], paper()) for name in NAMES}


@pytest.mark.parametrize("name", NAMES)
def test_a_replay_tells_what_the_evaluation_found(evaluated, replayed, name):
    told, found = replayed[name].summary(), evaluated[name]
    assert told["outcome"] == found["outcome"]
    for measure in set(found) - {"name", "outcome"}:
        assert told[measure] == found[measure], measure


def test_the_driven_path_leads_from_the_start_to_where_the_episode_ended(replayed):
    for name in NAMES:
        driven = replayed[name]
        path = np.array(driven.summary()["driven_path"])
        assert len(path) == 1 + round(float(driven.episode.measures.time) / 0.1)
        assert path[0] == pytest.approx(driven.scenario.start[:2], abs=1e-4)
        length = np.hypot(*np.diff(path, axis=0).T).sum()
        assert length == pytest.approx(float(driven.episode.measures.length), abs=1e-2)


def test_a_time_limit_that_is_no_whole_number_of_steps_ends_the_episode(replayed):
    """0.25 s are 2.5 steps of 0.1 s: rounded in float32, as the episode does, whatever double precision would say."""
    driven = replay(brief(SUITE.scenarios[4], 0.25), paper())
    assert driven.outcome == Outcome.TIMEOUT
    assert int(driven.trace.length) in (2, 3)


def test_summaries_are_json_without_nan(replayed):
    for driven in replayed.values():
        json.loads(json.dumps(driven.summary(), allow_nan=False))


def test_the_sentence_says_how_it_ended(replayed):
    assert replayed["brief"].sentence().startswith("TIMEOUT after 0.3 s and ")
    assert replayed["walled"].sentence().startswith("NO_PATH after 0.0 s and 0.00 m")
