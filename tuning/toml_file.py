"""A TOML file, or one line that says what is wrong with it."""

import tomllib
from pathlib import Path

from scenarios.formats.reading import bad_input


def read_toml(path: Path, rule: str, remedy: str) -> dict[str, object]:
    """Its content, else InputError. rule: what such a file is; remedy: what to do where it is not TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise bad_input(path, f"cannot be read ({error.strerror})", rule, "name an existing one") from None
    except (ValueError, RecursionError) as error:
        raise bad_input(path, f"not TOML ({error})", rule, remedy) from None
