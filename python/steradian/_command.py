"""The ``steradian`` command: the same program as the one that cargo builds."""

import sys
from pathlib import Path

from . import _native


def main() -> int:
    """Runs the command line of the process and gives its exit status."""
    sys.stdout.flush()
    sys.stderr.flush()
    return _native.command(["steradian", *sys.argv[1:]], Path(sys.executable))


if __name__ == "__main__":
    sys.exit(main())
