"""``python -m srrf``: the program ``srrf``, with the same arguments and exit codes."""

import sys

from ._srrf import program


def main() -> None:
    """Runs the program with the arguments of the process."""
    sys.stdout.flush()
    sys.exit(program(sys.argv[1:]))


if __name__ == "__main__":
    main()
