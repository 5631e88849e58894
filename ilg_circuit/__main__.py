"""``python -m ilg_circuit``, and the program `ilg-circuit`: the command line."""

import signal
import sys


def run() -> None:
    """Run the command line of this process."""
    try:
        from .cli import main
        from .commands.stopping import Stopped, leave

        try:
            main()
        except SystemExit as end:
            if isinstance(end.__context__, Stopped):
                leave(end.__context__.exit_code)
            raise
    except KeyboardInterrupt:  # before `main` listens for it, or after its end
        sys.stderr.write("ilg-circuit: interrupted\n")
        sys.exit(130)
    finally:  # nothing is left to interrupt
        signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    run()
