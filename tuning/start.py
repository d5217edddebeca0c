"""Where the command `adwa` begins."""

import sys

INTERRUPTED = 130  # exit code


def main() -> None:
    """Load the commands and run one; Ctrl-C while libraries are loaded is no traceback either."""
    try:
        from tuning.cli import main as command

        command()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
