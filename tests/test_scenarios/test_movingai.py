"""MovingAI maps and scenario files, good and bad."""

from math import sqrt

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.formats import load_map, load_movingai_map, load_scen
from scenarios.formats.movingai import fixed_decimals, length_tolerance

HEADER = "type octile\nheight 2\nwidth 4\nmap\n"
ROWS = ".GS@\nOTW.\n"


def written(tmp_path, content, name="m.map"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def scen(tmp_path, *entries, version="version 1"):
    return written(tmp_path, "\n".join((version, *entries)) + "\n", "m.map.scen")


def refusal(loader, path):
    with pytest.raises(InputError) as caught:
        loader(path)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message.split("; ")) == 3, "found; rule; remedy"
    assert message.startswith(str(path))
    return message.removeprefix(str(path))


@pytest.mark.parametrize("content", [
    HEADER + ROWS, (HEADER + ROWS).replace("\n", "\r\n"), (HEADER + ROWS).rstrip("\n"), HEADER + ROWS + "\n  \n",
    (HEADER + ROWS).replace("\n", "\r\n").rstrip(), "\ufeff" + HEADER + ROWS],
    ids=["lf", "crlf", "no final newline", "blank lines after", "crlf, no final newline", "byte order mark"])
def test_map_rows_stay_in_file_order_with_y_down(tmp_path, content):
    read = load_movingai_map(written(tmp_path, content))
    np.testing.assert_array_equal(read.occupied, [[False, False, False, True], [True, True, True, False]])
    assert not read.unknown.any()
    assert (read.resolution, read.origin, read.yaw, read.y_down) == (1.0, (0.0, 0.0), 0.0, True)


@pytest.mark.parametrize(("content", "where", "found"), [
    (HEADER + ".GS@\n", ":5", "ends after 1 rows; line 2 promises height 2"),
    (HEADER + ".GS@\nOT\n", ":6", "row of 2 characters; line 3 promises width 4"),
    (HEADER + ".GS@.\nOTW.\n", ":5", "row of 5 characters"),
    (HEADER + ROWS + "....\n", ":7", "'....'; line 2 promises height 2"),
    (HEADER + ".GS@\nO#W.\n", ":6", "character '#' in column 2"),
    (HEADER.replace("octile", "tile") + ROWS, ":1", "'type tile'"),
    (HEADER.replace("type octile\n", "") + ROWS, ":1", "'height 2'"),
    (HEADER.replace("height 2", "height 2.0") + ROWS, ":2", "height '2.0'"),
    (HEADER.replace("height 2", "height 0") + ROWS, ":2", "height '0'; must be a whole number, at least 1"),
    (HEADER.replace("width 4", "width -4") + ROWS, ":3", "width '-4'"),
    (HEADER.replace("width 4", "width") + ROWS, ":3", "'width'"),
    (HEADER.replace("map\n", "") + ROWS, ":4", "'.GS@'"),
    ("type octile\n", ":1", "the file ends before 'height'"),
    ("\n", ":1", "''"), ("\ufeff", ":1", "''"),
    ("", "", "0 bytes"), (b"\x89PNG\r\n\x1a\n\0\0", "", "byte 0 is not text"), (HEADER + "..\0.\n", "", "byte "),
])
def test_a_broken_map_is_refused_with_line_and_value(tmp_path, content, where, found):
    message = refusal(load_movingai_map, written(tmp_path, content))
    assert message.startswith(f"{where}: ")
    assert found in message


@pytest.mark.parametrize("loader", [load_movingai_map, load_scen])
def test_a_missing_file_and_a_folder_are_refused(tmp_path, loader):
    assert "no such file" in refusal(loader, tmp_path / "none.map")
    assert "is a folder" in refusal(loader, tmp_path)


def test_scen_entries_hold_cells_and_base_names(tmp_path):
    entry, = load_scen(scen(tmp_path, "3\told/folder/m.map\t4\t2\t0\t1\t3\t0\t3.41421"))
    assert (entry.line, entry.bucket, entry.map_name, entry.width, entry.height) == (2, 3, "m.map", 4, 2)
    assert (entry.start, entry.goal, entry.expected) == ((0, 1), (3, 0), 3.41421)
    assert (entry.start_point, entry.goal_point) == ((0.5, 1.5), (3.5, 0.5))
    assert not entry.expected_unreachable


def test_scen_columns_may_be_parted_by_spaces_and_version_be_1_0(tmp_path):
    path = scen(tmp_path, "3 maps/m.map 4 2 0 1 3 0 3.41", "", version="version 1.0")
    assert load_scen(path)[0].goal == (3, 0)


def test_map_names_with_spaces_are_read_where_tabs_part_the_columns(tmp_path):
    windows = "C:\\maps\\my map.map"
    assert load_scen(scen(tmp_path, f"0\t{windows}\t4\t2\t0\t0\t1\t0\t1"))[0].map_name == "my map.map"


def test_listed_length_0_means_unreachable_only_where_start_and_goal_differ(tmp_path):
    apart, same = load_scen(scen(tmp_path, "0\tm\t4\t2\t0\t0\t1\t0\t0", "0\tm\t4\t2\t1\t0\t1\t0\t0"))
    assert (apart.expected, apart.expected_unreachable) == (None, True)
    assert (same.expected, same.expected_unreachable) == (0.0, False)


@pytest.mark.parametrize(("entry", "found"), [
    ("0\tm\t4\t2\t0\t0\t1\t0", "8 columns"),
    ("0\tm\t4\t2\t0\t0\t1\t0\t1\t1", "10 columns"),
    ("0 my map 4 2 0 0 1 0 1", "10 columns"),
    ("x\tm\t4\t2\t0\t0\t1\t0\t1", "bucket 'x'"),
    ("0\tm\t0\t2\t0\t0\t1\t0\t1", "width '0'"),
    ("0\tm\t4\t2\t0.5\t0\t1\t0\t1", "start x '0.5'"),
    ("0\tm\t4\t2\t4\t0\t1\t0\t1", "start x '4'; must be a whole number, from 0 to 3"),
    ("0\tm\t4\t2\t0\t-1\t1\t0\t1", "start y '-1'"),
    ("0\tm\t4\t2\t0\t0\t1\t2\t1", "goal y '2'; must be a whole number, from 0 to 1"),
    ("0\tm\t4\t2\t0\t0\t1\t0\tnan", "length 'nan'"),
    ("0\tm\t4\t2\t0\t0\t1\t0\t-1", "length '-1'"),
    ("0\tm\t4\t2\t0\t0\t1\t0\tfar", "length 'far'"),
])
def test_a_broken_scen_entry_is_refused_with_line_and_value(tmp_path, entry, found):
    message = refusal(load_scen, scen(tmp_path, "0\tm\t4\t2\t0\t0\t1\t0\t1", entry))
    assert message.startswith(":3: ")
    assert found in message


def test_a_scen_of_another_version_or_without_entries_is_refused(tmp_path):
    assert "'version 2'" in refusal(load_scen, scen(tmp_path, "", version="version 2"))
    assert "no scenario" in refusal(load_scen, scen(tmp_path))


@pytest.mark.parametrize(("lengths", "decimals"), [
    (["160.53", "2.00"], 2), (["2.41421356", "10.00000000"], 8),
    (["1.41421", "12.8284"], None), (["1", "2"], None), (["3", "3.5"], None), (["1.5e+06"], None)])
def test_decimals_are_fixed_where_every_length_has_as_many(lengths, decimals):
    assert fixed_decimals(lengths) == decimals


@pytest.mark.parametrize(("length", "decimals", "half_digit"), [
    (160.53, 2, 0.005), (2.41421356, 8, 5e-9), (1.41421, None, 5e-6), (12.8284, None, 5e-5), (70.71, None, 5e-5),
    (2307.97, None, 5e-3), (3.0, None, 5e-6), (0.0, None, 5e-6), (1048580.0, None, 5.0)])
def test_tolerance_is_half_the_last_printed_digit(length, decimals, half_digit):
    assert length_tolerance(length, decimals) == pytest.approx(half_digit + 1e-5, rel=1e-12)


def test_tolerances_of_an_entry_come_from_its_whole_file(tmp_path):
    stripped = load_scen(scen(tmp_path, "0\tm\t4\t2\t0\t0\t1\t0\t12.5", "0\tm\t4\t2\t0\t0\t1\t0\t12.8284"))
    fixed = load_scen(scen(tmp_path, "0\tm\t4\t2\t0\t0\t1\t0\t12.50", "0\tm\t4\t2\t0\t0\t1\t0\t12.83"))
    assert [entry.tolerance for entry in stripped] == pytest.approx([6e-5, 6e-5])
    assert [entry.tolerance for entry in fixed] == pytest.approx([0.00501, 0.00501])


@pytest.mark.realdata
def test_every_real_map_is_read_and_its_scenarios_lie_on_it(data_folder):
    folder = data_folder / "movingai"
    maps = {path: load_map(path) for path in sorted(folder.glob("*/*.map"))}
    assert len(maps) >= 30
    assert not any(read.grid().occupied.all() for read in maps.values())
    for path in sorted(folder.glob("*/*.scen")):
        for entry in load_scen(path):
            shape = maps[path.parent / entry.map_name].occupied.shape
            assert shape == (entry.height, entry.width), (path, entry)


@pytest.mark.realdata
def test_real_lengths_are_sums_of_straight_and_diagonal_steps_within_their_tolerance(data_folder):
    for path in sorted((data_folder / "movingai").glob("*/*.scen")):
        for entry in load_scen(path)[::17]:
            diagonal = np.arange(int((entry.expected or 0.0) / sqrt(2)) + 2)
            straight = np.rint((entry.expected or 0.0) - diagonal * sqrt(2))
            miss = np.abs(straight + diagonal * sqrt(2) - (entry.expected or 0.0))[straight >= 0].min()
            assert miss <= entry.tolerance, (path, entry)


@pytest.mark.realdata
def test_dao_scenarios_listed_as_unreachable_are_told_from_short_ones(data_folder):
    entries = load_scen(data_folder / "movingai" / "dao" / "lak203d.map.scen")
    unreachable = [entry for entry in entries if entry.expected_unreachable]
    assert 0 < len(unreachable) < len(entries)
    assert all(entry.expected is None and entry.start != entry.goal for entry in unreachable)
