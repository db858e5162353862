"""The program `psidpd`, as the command line has it."""

import os
import signal
import sys

from ._psidpd import main as program


def main():
    """Runs the program with the arguments of this process, and exits with its code."""
    # Python would keep signals until it is asked; the program has its own ways with them.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    name = sys.argv[0]
    if not os.access(name, os.X_OK) or name.endswith(".py"):
        name = os.path.join(os.path.dirname(sys.executable), "psidpd")
    sys.exit(program(name, ["psidpd", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
