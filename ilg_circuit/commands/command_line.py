"""The line that was typed, for a report that says how it was made."""

from __future__ import annotations

import shlex
import sys


def command_line() -> str:
    """The present command, quoted for a shell."""
    return shlex.join(["ilg-circuit", *sys.argv[1:]])
