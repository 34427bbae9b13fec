"""``python -m srrf``: the program ``srrf``, with the same arguments and exit codes."""

import signal
import sys
import threading

from ._srrf import program


def main() -> None:
    """Runs the program with the arguments of the process."""
    sys.stdout.flush()
    here = threading.current_thread() is threading.main_thread()
    if here and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # Python only notes Ctrl-C, and would look at it after the program's end. Where it is ignored it stays so.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(program(sys.argv[1:]))


if __name__ == "__main__":
    main()
