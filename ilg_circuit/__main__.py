"""``python -m ilg_circuit``, and the program `ilg-circuit`: the command line."""

import signal
import sys


def run() -> None:
    """Run the command line of this process."""
    try:
        from .cli import main

        main()
    except KeyboardInterrupt:  # before `main` listens for it, or after its end
        sys.stderr.write("ilg-circuit: interrupted\n")
        sys.exit(130)
    finally:  # nothing is left to interrupt
        signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    run()
