"""``python -m ilg_circuit``, and the program `ilg-circuit`: the command line."""

import gc
import os
import signal
import sys

#: New objects after which the collector looks for unused cycles; by default of Python 700, or 2,000.
_NEW_OBJECTS = 50_000


def run() -> None:
    """Run the command line of this process, with one thread of linear algebra unless the surroundings say otherwise.

    Matrices here are small: threads wait for each other in loops, which takes several times as long on a busy machine.
    Objects in cycles are few, and the collector goes over all imported modules: it is called less often, and leaves to
    the system what is there at the end.
    """
    gc.set_threshold(_NEW_OBJECTS, *gc.get_threshold()[1:])
    for library in ("OPENBLAS", "MKL"):  # read when numpy and scipy are imported
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
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
        gc.freeze()
        signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    run()
