"""Recorded pedestrian tracks, rows `frame id x y`, as movers.

Dimension letters: M movers, J track points.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from adwa_jax.scenario import Movers
from scenarios.formats.leaves import tracked_movers
from scenarios.formats.reading import bad_input, positive_number, read_lines, shown

_KIND = "a track file"


def load_tracks(path: str | Path, frames_per_second: float = 25.0,
                largest_gap: float = 3.0) -> list[np.ndarray]:
    """Read rows `frame id x y`, separated by white space; blank lines and `#` lines are skipped.

    Returns one array [J, 3] float64 a track, rows t [s] from the file's first frame, x, y [m], t increasing;
    the tracks are in order of id, then time. Where a person is unseen for more than `largest_gap` sample
    intervals (the median interval between a person's rows) the track is cut in two, as the way between is
    unknown. A person seen in one row only has no motion to replay and is left out.

    Raises InputError naming file and line for rows that are not four finite numbers and for a second row of
    the same frame and id; and where no track is left.
    """
    positive_number("frames_per_second", frames_per_second, "give the rate of the recording's frame numbers")
    positive_number("largest_gap", largest_gap, "give a number of sample intervals, 3 for instance")
    rows = _read_rows(path)
    rows = rows[np.lexsort((rows[:, 0], rows[:, 1]))]
    step, same_person = np.diff(rows[:, 0]), np.diff(rows[:, 1]) == 0
    interval = np.median(step[same_person]) if same_person.any() else 0.0
    cuts = np.flatnonzero(~same_person | (step > largest_gap * interval)) + 1
    times = (rows[:, :1] - rows[:, 0].min()) / frames_per_second
    tracks = np.split(np.concatenate([times, rows[:, 2:]], axis=1), cuts)
    tracks = [track for track in tracks if len(track) >= 2]
    if not tracks:
        raise bad_input(path, "no track of two rows", "a track needs at least two rows of one id",
                        "check the columns")
    return tracks


def movers_from_tracks(tracks: Sequence[np.ndarray], radius: float) -> Movers:
    """Movers (numpy leaves, unpadded in M) that run the tracks once, each absent outside its own times.

    tracks: arrays [J, 3], rows t [s], x, y [m], t increasing; radius: of every mover [m]. Shorter tracks
    repeat their last row up to the longest. Raises InputError for other shapes, numbers that are not finite,
    and times that do not increase in float32.
    """
    positive_number("radius", radius, "give the movers' radius in metres")
    tracks = [_checked(index, track) for index, track in enumerate(tracks)]
    longest = max((len(track) for track in tracks), default=0)
    padded = [np.pad(track, ((0, longest - len(track)), (0, 0)), mode="edge") for track in tracks]
    lengths = np.array([len(track) for track in tracks], np.int32)
    return tracked_movers(np.array(padded, np.float32).reshape(len(tracks), longest, 3), lengths, radius)


def _checked(index: int, track: np.ndarray) -> np.ndarray:
    """The track in float32."""
    where = f"tracks[{index}]"
    rule = "a track is an array [J, 3] of finite numbers, J at least 2, its times increasing"
    with np.errstate(over="ignore"):  # infinite in float32 is refused below
        track = np.asarray(track, np.float32)
    if track.ndim != 2 or track.shape[1] != 3 or len(track) < 2:
        raise bad_input(where, f"array of shape {track.shape}", rule, "give rows t, x, y")
    if not np.isfinite(track).all() or (np.diff(track[:, 0]) <= 0.0).any():
        raise bad_input(where, "a value that is not finite, or a time that does not increase", rule,
                        "mend the rows")
    return track


def _read_rows(path: str | Path) -> np.ndarray:
    """[n, 4] float64: frame, id, x, y, in the file's order."""
    rows: list[list[float]] = []
    first_line: dict[tuple[float, float], int] = {}
    for index, text in enumerate(read_lines(path, _KIND)):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        row = _row(f"{path}:{index + 1}", text)
        earlier = first_line.setdefault((row[0], row[1]), index + 1)
        if earlier != index + 1:
            raise bad_input(f"{path}:{index + 1}", f"frame {row[0]:g} and id {row[1]:g} as in line {earlier}",
                            "one row for each frame and id", "remove one of the two")
        rows.append(row)
    if not rows:
        raise bad_input(path, "no row", f"{_KIND} holds rows 'frame id x y'",
                        "check that this is such a file")
    return np.array(rows)


def _row(where: str, text: str) -> list[float]:
    try:
        row = [float(word) for word in text.split()]
    except ValueError:
        row = []
    if len(row) != 4 or not np.isfinite(row).all():
        raise bad_input(where, shown(text), "a row is four finite numbers: frame id x y",
                        "mend or remove the line")
    return row
