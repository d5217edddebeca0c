import numpy as np
import pytest

from adwa_jax.episode import Outcome
from tuning.objectives import Constraint, Goals, Statistic
from tuning.racing import clearly_out, raced

REACHED, STUCK = int(Outcome.REACHED), int(Outcome.STUCK)
LENGTH, TURNS = Statistic("length_ratio", "min"), Statistic("breaking_points", "min")
SUCCESS = Statistic("success", "max")
TWO = Goals((LENGTH, TURNS))


def columns(length, turns=None, reached=True):
    """Of candidates by scenarios."""
    length = np.asarray(length, np.float64)
    turns = length if turns is None else np.broadcast_to(np.asarray(turns, np.float64), length.shape)
    outcome = np.where(np.broadcast_to(reached, length.shape), REACHED, STUCK).astype(np.int32)
    return {"outcome": outcome, "length_ratio": length, "breaking_points": turns}


def judge_of(table, calls=None):
    def judge(rows, start, stop):
        if calls is not None:
            calls.append((rows.tolist(), start, stop))
        return {name: values[rows, start:stop] for name, values in table.items()}

    return judge


ALTERNATING = np.tile([0.0, 1.0], 8)  # of 16 scenarios; half are hard for everyone


def test_a_paired_difference_is_clear_where_the_two_samples_overlap():
    """Worse by 0.1 on every scenario, while scenarios differ by 1: pairs say so at once, unpaired means never would."""
    easy, hard = ALTERNATING, ALTERNATING + 0.1
    np.testing.assert_array_equal(clearly_out(TWO, columns([easy, hard]), 2), [False, True])


def test_a_difference_within_the_noise_is_not_clear():
    """Differences 0 and 0.2 in turn: mean 0.1, standard error 0.1/√15 = 0.0258, and 3.87 of them. Student's 99 % point
    of 15 degrees of freedom is 2.60, that of 99 % over a hundred rivals 4.88.
    """
    worse = ALTERNATING + np.tile([0.0, 0.2], 8)
    np.testing.assert_array_equal(clearly_out(TWO, columns([ALTERNATING, worse]), 2), [False, True])
    crowd = columns(np.stack([worse, *[ALTERNATING] * 100]))
    assert not clearly_out(TWO, crowd, 1)[0]


def test_what_is_better_or_the_same_in_any_objective_stays():
    worse, better, same = ALTERNATING + 1.0, ALTERNATING - 1.0, ALTERNATING
    table = columns([ALTERNATING, worse, worse], [ALTERNATING, better, same])
    np.testing.assert_array_equal(clearly_out(TWO, table, 3), [False, False, False])


def test_one_that_solves_nothing_is_out_and_one_of_few_solutions_is_not():
    few = np.arange(16) < 7
    table = columns(np.stack([ALTERNATING] * 3), reached=np.stack([np.ones(16, bool), few, np.zeros(16, bool)]))
    np.testing.assert_array_equal(clearly_out(TWO, table, 3), [False, False, True])
    np.testing.assert_array_equal(clearly_out(Goals((SUCCESS, LENGTH)), table, 3), [False, False, True])


def test_only_scenarios_that_were_solved_count_for_a_length():
    """Where the second fails its length is nonsense, 99: it is equal where it reaches, so not clearly worse."""
    reached = np.stack([np.ones(16, bool), np.arange(16) % 4 > 0])
    length = np.stack([np.ones(16), np.where(reached[1], 1.0, 99.0)])
    np.testing.assert_array_equal(clearly_out(Goals((LENGTH,)), columns(length, reached=reached), 2), [False, False])


def test_a_clear_violation_is_out_and_a_possible_one_stays():
    """Success ≥ 0.9. Of 16: 8 reached, which is 0.4 too few with standard error 0.5/√15 = 0.129, 3.1 of them, and
    Student's 99.5 % point, of two rivals, is 2.95; 13 reached, which is 0.0875 too few with 0.101.
    """
    goals = Goals((LENGTH, TURNS), (Constraint(SUCCESS, 0.9),))
    reached = np.arange(16)[None, :] < np.array([[8], [13], [16]])
    table = columns([ALTERNATING, ALTERNATING, ALTERNATING], reached=reached)
    np.testing.assert_array_equal(clearly_out(goals, table, 3), [True, False, False])


def test_what_may_violate_a_constraint_beats_nobody_that_may_keep_it():
    """The first is shorter, but reached 13 of 16 where 90 % is asked for; the second reached all."""
    goals = Goals((LENGTH, TURNS), (Constraint(SUCCESS, 0.9),))
    reached = np.arange(16)[None, :] < np.array([[13], [16]])
    length = np.stack([ALTERNATING, ALTERNATING + 1.0])
    assert not clearly_out(goals, columns(length, reached=reached), 2)[1]
    assert clearly_out(TWO, columns(length, reached=reached), 2)[1]


def test_the_worst_share_of_a_measure_is_told_apart_too():
    """The worst quarter: of 64, 16 values of 3 against 16 of 2; all others are alike or better."""
    goals = Goals((Statistic("length_ratio", "min", worst_share=0.25),))
    tail = np.arange(64) % 4 == 0
    wiggle = 0.01 * (np.arange(64) % 7)
    table = columns(np.stack([np.where(tail, 2.0, 1.0) + wiggle, np.where(tail, 3.0, 0.5) + wiggle]))
    np.testing.assert_array_equal(clearly_out(goals, table, 2), [False, True])


def test_shares_of_the_scenarios_double_and_the_beaten_see_no_more():
    lengths = np.tile(ALTERNATING, 5)[None, :72] + np.array([[0.0], [1.0], [0.0]])
    turns = np.tile(ALTERNATING, 5)[None, :72] + np.array([[0.0], [1.0], [-1.0]])
    calls = []
    result = raced(TWO, 3, 72, 16, judge_of(columns(lengths, turns), calls))
    assert calls == [([0, 1, 2], 0, 16), ([0, 2], 16, 32), ([0, 2], 32, 64), ([0, 2], 64, 72)]
    np.testing.assert_array_equal(result.counted.sum(axis=1), [72, 16, 72])
    np.testing.assert_array_equal(result.columns["length_ratio"], np.where(result.counted, lengths, 0.0))
    assert result.columns["outcome"].dtype == np.int32


def test_candidates_judged_before_can_beat_and_are_not_judged_again():
    table, calls = columns(np.tile(ALTERNATING, 4)[None] + 1.0), []
    result = raced(TWO, 1, 64, 16, judge_of(table, calls), rivals=columns(np.tile(ALTERNATING, 4)[None]))
    assert calls == [([0], 0, 16)]
    assert result.counted.sum() == 16


def test_a_race_over_fewer_scenarios_than_its_first_share_judges_all():
    result = raced(TWO, 2, 10, 16, judge_of(columns(np.ones((2, 10)))))
    assert result.counted.all()


def noisy(seed, candidates=24, scenarios=256):
    """Means of two objectives, and columns with noise that all share, and noise of each candidate's own."""
    random = np.random.default_rng(seed)
    along, behind = random.uniform(size=(2, candidates))
    means = np.stack([along, 1.0 - along], axis=1) + np.where(np.arange(candidates) < 8, 0.0, behind)[:, None]
    common = random.normal(size=(1, scenarios, 2))
    own = random.normal(scale=0.5, size=(candidates, scenarios, 2))
    drawn = means[:, None] + common + own
    return means, columns(drawn[..., 0], drawn[..., 1])


def dominated(means):
    return np.array([np.any(np.all(means < mean, axis=1)) for mean in means])


def test_members_of_the_true_front_are_kept_and_most_others_dropped_early():
    kept_all, driven = [], []
    for seed in range(100):
        means, table = noisy(seed)
        counted = raced(TWO, 24, 256, 16, judge_of(table)).counted
        front = ~dominated(means)
        kept_all.append(counted[front].all())
        driven.append(counted[~front].mean())
    assert np.mean(kept_all) >= 0.95
    assert np.mean(driven) < 0.5


def test_a_race_is_the_same_each_time():
    first, second = (raced(TWO, 24, 256, 16, judge_of(noisy(3)[1])) for _ in range(2))
    np.testing.assert_array_equal(first.counted, second.counted)


@pytest.mark.parametrize("success", [0.5, 0.9])
def test_rates_of_equals_are_rarely_called_different(success):
    random, goals = np.random.default_rng(0), Goals((SUCCESS,))
    wrong = [clearly_out(goals, columns(np.ones((2, 32)), reached=random.uniform(size=(2, 32)) < success), 2).any()
             for _ in range(400)]  # fmt: skip
    assert np.mean(wrong) <= 0.04  # 1 % each way, and the coarseness of a rate
