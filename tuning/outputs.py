"""What commands write: JSON and pictures. Their paths are checked before the work starts, not after it."""

import json
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from scenarios.formats.reading import bad_input

PICTURES = (".png", ".pdf", ".svg", ".jpg", ".jpeg")
ANIMATIONS = (".gif", ".mp4")
STDOUT = Path("-")
DPI = 150


def check_file(option: str, path: Path | None, suffixes: tuple[str, ...] = ()) -> None:
    """Raises InputError unless a file could be written to `path`, ending in one of `suffixes` if any are given."""
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise bad_input(option, str(path), f"must end in {' '.join(suffixes)}", "rename it")
    if path.is_dir():
        raise bad_input(option, str(path), "is a folder", "name a file in it")
    if path.exists():
        _require_writable(option, path, path)
    else:
        _check_place(option, path, path.parent)


def check_folder(option: str, path: Path | None) -> None:
    """Raises InputError unless files could be written into the folder `path`, made if need be."""
    if path is not None:
        _check_place(option, path, path)


def write_json(content: Any, path: Path | None) -> None:
    """Write `content` to a file, or to standard output where the path is `-`; nothing where it is None."""
    if path is None:
        return
    text = json_text(content) + "\n"
    if path == STDOUT:
        sys.stdout.write(text)
        return
    try:
        parent_made(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise bad_input("--json", str(path), f"cannot be written ({error.strerror})",
                        "check its folder, the permissions and the free space") from None


def write_whole(path: Path, text: str) -> None:
    """Write a file, or leave the one that was there as it was: never a part of one."""
    unfinished = path.with_name(f".{path.name}.part")
    unfinished.write_text(text, encoding="utf-8")
    os.replace(unfinished, path)


def json_text(content: Any) -> str:
    """A list with one object a line, an object with one field a line: paths stay readable."""
    if isinstance(content, list):
        return "[\n" + ",\n".join(json.dumps(item) for item in content) + "\n]"
    lines = [f" {json.dumps(key)}: {json_text(value) if _is_rows(value) else json.dumps(value)}"
             for key, value in content.items()]  # fmt: skip
    return "{\n" + ",\n".join(lines) + "\n}"


@contextmanager
def names_as_they_are() -> Iterator[None]:
    """Pictures drawn in here may name files with `$`, which is no formula, and with letters that the font lacks."""
    import matplotlib

    with matplotlib.rc_context({"text.parse_math": False}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        yield


def save_figure(draw: Callable[[], Any], path: Path) -> Path:
    """Write the matplotlib figure that `draw` returns to a picture; returns the path."""
    with names_as_they_are():
        draw().savefig(parent_made(path), dpi=DPI)
    return path


def parent_made(path: Path) -> Path:
    """The path, its folder made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _check_place(option: str, path: Path, folder: Path) -> None:
    """Raises InputError, showing `path`, unless `folder` is there or can be made, and be written into."""
    nearest = next(place for place in (folder, *folder.parents) if place.exists())
    if not nearest.is_dir():
        raise bad_input(option, str(path), f"{nearest} is a file", "name a folder that is there or can be made")
    _require_writable(option, path, nearest)


def _require_writable(option: str, path: Path, place: Path) -> None:
    if not os.access(place, os.W_OK):
        raise bad_input(option, str(path), f"{place} cannot be written to", "check its permissions")


def _is_rows(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict)
