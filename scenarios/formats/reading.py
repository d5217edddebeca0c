"""Reading a user's files, and refusing bad ones in one line: where, what was found, the rule, the remedy."""

import math
import tomllib
from pathlib import Path
from typing import Any

from scenarios.errors import InputError

# Beyond these a length would be infinite or zero in float32.
LARGEST, SMALLEST = 1e30, 1e-30


def bad_input(where: object, found: str, rule: str, remedy: str) -> InputError:
    """The error "where: found; rule; remedy", on one line whatever its parts hold."""
    return InputError(" ".join(f"{where}: {found}; {rule}; {remedy}".split()))


def shown(value: object) -> str:
    """A value as an error message quotes it: its repr, cut at 60 characters."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def read_bytes(path: str | Path, kind: str) -> bytes:
    """The bytes of a file; `kind` says in messages what was expected ("a MovingAI map").

    Raises InputError for a missing file, a folder, a file without permission and a file of 0 bytes.
    """
    path = Path(path)
    if path.is_dir():
        raise bad_input(path, "is a folder", f"{kind} is one file", "name the file inside it")
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise bad_input(path, "no such file", f"{kind} is expected", "check the name and folder") from None
    except (OSError, ValueError) as error:
        raise bad_input(path, f"cannot be read ({error})", f"{kind} must be readable",
                        "check the file and its permissions") from None
    if not content:
        raise bad_input(path, "0 bytes", f"{kind} is not empty", "fetch or write the file again")
    return content


def read_lines(path: str | Path, kind: str) -> list[str]:
    """The lines of a text file without their ends.

    LF and CRLF, a missing last newline and a UTF-8 mark are accepted. Raises InputError as `read_bytes` does,
    and for content that is not text.
    """
    content = read_bytes(path, kind)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        text, place = "\0", error.start
    else:
        place = text.find("\0")
    if "\0" in text:
        raise bad_input(path, f"byte {place} is not text", f"{kind} is a text file",
                        "check that this is the right file, uncompressed")
    lines = [line.removesuffix("\r") for line in text.split("\n")]
    return lines[:-1] if len(lines) > 1 and lines[-1] == "" else lines


def read_toml(path: str | Path, kind: str, remedy: str) -> dict[str, Any]:
    """The tables of a TOML file. Raises InputError as `read_lines` does, and with the line for what is not TOML."""
    text = "".join(f"{line}\n" for line in read_lines(path, kind))
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # of a number too long, the former
        raise bad_input(path, f"not TOML ({error})", f"{kind} is expected", remedy) from None


def number(where: object, value: Any, rule: str, remedy: str) -> float:
    """A finite number from a number or its text; all else, booleans too, is an InputError of these parts."""
    try:
        result = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        result = math.nan
    if not abs(result) <= LARGEST:
        raise bad_input(where, shown(value), rule, remedy)
    return result


def positive_number(where: object, value: Any, remedy: str) -> float:
    """A finite number above zero, or an InputError ending in `remedy`."""
    rule = f"must be a finite number above 0, from {SMALLEST} to {LARGEST}"
    result = number(where, value, rule, remedy)
    if result < SMALLEST:
        raise bad_input(where, shown(value), rule, remedy)
    return result
