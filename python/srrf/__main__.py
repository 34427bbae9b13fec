"""``python -m srrf``: the program ``srrf``, with the same arguments and exit codes."""

import signal
import sys
import threading

from ._srrf import program


def main() -> None:
    """Runs the program with the arguments of the process."""
    sys.stdout.flush()
    if threading.current_thread() is threading.main_thread():
        # Python only notes Ctrl-C, and would look at it after the program's end.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(program(sys.argv[1:]))


if __name__ == "__main__":
    main()
