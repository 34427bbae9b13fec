"""Children that hear signals."""

import signal


def heard():
    """In the child: Ctrl-C is heard, also where a shell started these tests in the background, with the signal ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def ended(child, seconds):
    try:
        return child.communicate(timeout=seconds)[0]
    finally:
        child.kill()
