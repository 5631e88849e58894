"""What tests of the command line share: the outcome of a call, and what every refusal looks like."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


Run = Callable[..., Outcome]

#: A simulation as it is usually asked for.
SIMULATE = ("simulate", "paper", "--drive", "step:4V", "--duration", "100s")


def assert_one_line(outcome: Outcome | subprocess.CompletedProcess[str], *hints: str, code: int = 2) -> None:
    """The way every refusal looks: exit code, one line on stderr, nothing on stdout, no traceback."""
    returned, out, err = (
        (outcome.code, outcome.out, outcome.err)
        if isinstance(outcome, Outcome)
        else (outcome.returncode, outcome.stdout, outcome.stderr)
    )
    assert returned == code, err
    assert out == ""
    assert len(err.splitlines()) == 1, err
    assert err.startswith("ilg-circuit: ")
    for hint in hints:
        assert hint in err


def columns(path: Path) -> dict[str, np.ndarray]:
    header, *rows = path.read_text().splitlines()
    values = np.array([[float(cell) if cell else np.nan for cell in row.split(",")] for row in rows])
    return dict(zip(header.split(","), values.T, strict=True))
