"""Evaluations on disk: what is read back, what is not trusted."""

import numpy as np
import pytest
import zarr

from adwa_jax.presets import paper
from scenarios.errors import InputError
from tests.test_tuning.worlds import mixed_suite, part_of
from tuning.evaluate import evaluate
from tuning.store import FIGURES, Store, as_evaluations, read_store

VALUES = np.array([[0.1, 2.0], [0.3, 4.0], [0.5, 6.0]])
NAMES = [f"world-{index}" for index in range(70)]  # two tiles, of 64 and of 6
COLUMNS = {name: np.random.default_rng(1).integers(0, 2, (3, 70)).astype(kind) for name, kind in FIGURES.items()}


@pytest.fixture
def store(tmp_path):
    """Two candidates are done, of the third the second tile."""
    made = Store(tmp_path / "some.zarr", ("clearance", "lookahead"), NAMES)
    assert not made.admit(0, VALUES, np.array([0, 1, 1])).any()
    made.write(np.array([0, 1]), slice(0, 2), VALUES[:2], {name: column[:2] for name, column in COLUMNS.items()})
    made.write(np.array([2]), slice(1, 2), VALUES[2:], {name: column[2:, 64:] for name, column in COLUMNS.items()})
    return made


def opened(store):
    return Store(store.path, ("clearance", "lookahead"), NAMES)


def test_figures_are_the_engines_columns_with_their_types():
    results = evaluate(part_of(mixed_suite(), [5]), paper())
    found = {**results.measures, "outcome": results.outcome}
    assert {name: column.dtype for name, column in found.items()} == {
        name: np.dtype(kind) for name, kind in FIGURES.items()}  # fmt: skip


def test_what_was_written_is_read_back(store):
    again = opened(store)
    assert again.admit(0, VALUES, np.array([0, 1, 1])).tolist() == [[True, True], [True, True], [False, True]]
    for name, column in again.read(np.array([0, 1]), slice(0, 2)).items():
        assert column.dtype == FIGURES[name]
        np.testing.assert_array_equal(column, COLUMNS[name][:2])
    found = as_evaluations(store.path)
    assert found.complete.tolist() == [True, True, False]
    assert found.done[2].tolist() == [False] * 64 + [True] * 6
    np.testing.assert_array_equal(found.values, VALUES)


def test_tiles_of_other_constants_are_not_done(store):
    changed = VALUES + np.array([[0.0], [1e-9], [0.0]])
    done = opened(store).admit(0, changed, np.array([0, 1, 1]))
    assert done.tolist() == [[True, True], [False, False], [False, True]]


def flipped(content):
    """One bit is another."""
    return content[:-1] + bytes([content[-1] ^ 1])


@pytest.mark.parametrize(("file", "lost", "damage"), [
    (file, lost, damage)
    for file, lost in (("figures/c/1/0/0", [(1, 0)]), ("done/c/1/0", [(1, 0), (1, 1)]))
    for damage in (lambda content: content[:-3], lambda content: b"", lambda content: None)
] + [("figures/c/1/0/0", [(1, 0)], flipped)])  # fmt: skip
def test_what_is_damaged_is_not_done_and_nothing_else_is_lost(store, file, lost, damage):
    path = store.path / file
    content = damage(path.read_bytes())
    path.unlink() if content is None else path.write_bytes(content)
    done = opened(store).admit(0, VALUES, np.array([0, 1, 1]))
    expected = np.array([[True, True], [True, True], [False, True]])
    expected[tuple(zip(*lost, strict=True))] = False
    assert done.tolist() == expected.tolist()
    found, _ = read_store(store.path)
    assert found.done[:, [0, 69]].tolist() == expected.tolist()


def test_another_jobs_store_is_refused(store):
    with pytest.raises(InputError, match="of other parameters, scenarios or figures"):
        Store(store.path, ("clearance",), NAMES)


@pytest.mark.parametrize("damage", [lambda path: path.write_text("{"), lambda path: path.unlink()])
def test_a_damaged_description_is_one_line(store, damage):
    damage(store.path / "zarr.json")
    with pytest.raises(InputError, match=r"damaged \(.*\); .*; remove it, and resume the job"):
        opened(store)


def test_what_a_killed_process_left_unfinished_is_removed(store):
    rubbish = store.path / "figures" / "c" / "0.abc.partial"
    rubbish.write_bytes(b"half")
    opened(store)
    assert not rubbish.exists()


def test_a_store_half_made_when_its_process_died_is_made_anew(tmp_path, monkeypatch):
    create = zarr.Group.create_array

    def dies_at_the_third(group, name, **how):
        if name == "values":
            raise SystemExit
        return create(group, name, **how)

    path = tmp_path / "some.zarr"
    with monkeypatch.context() as dying:
        dying.setattr(zarr.Group, "create_array", dies_at_the_third)
        with pytest.raises(SystemExit):
            Store(path, ("clearance", "lookahead"), NAMES)
    made = Store(path, ("clearance", "lookahead"), NAMES)
    assert not made.admit(0, VALUES, np.array([0, 1, 1])).any()
    assert [place.name for place in tmp_path.iterdir()] == ["some.zarr"]
