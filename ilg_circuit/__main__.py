"""``python -m ilg_circuit``, and the program `ilg-circuit`: the command line."""

import sys


def run() -> None:
    """Run the command line of this process."""
    try:
        from .cli import main

        main()
    except KeyboardInterrupt:  # before `main` listens for it, or after its end
        sys.stderr.write("ilg-circuit: interrupted\n")
        sys.exit(130)


if __name__ == "__main__":
    run()
