"""``python -m ilg_circuit``: the command line."""

from .cli import main

main()
