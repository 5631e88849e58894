"""Provenance: which version made a result, from which inputs, by which call and seed."""

from __future__ import annotations

import hashlib
import os
import shlex
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import __version__
from .errors import visible


@dataclass(frozen=True)
class Provenance:
    """Where a result comes from: ``version`` of the package, ``call``, ``inputs`` (name -> SHA-256), ``seed``.

    ``call`` is the command line or the Python call; ``seed`` is None where nothing was drawn at random.
    """

    version: str = __version__
    call: str = ""
    inputs: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return all entries, ready for JSON and TOML, without unknown ones."""
        known = {"version": self.version, "call": self.call, "inputs": dict(self.inputs), "seed": self.seed}
        return {name: value for name, value in known.items() if value not in ("", {}, None)}

    def lines(self) -> list[str]:
        """Return one line for each item, for the head of a netlist or the comment of a file."""
        lines = [f"written by ilg_circuit {self.version}"]
        lines += [f"call: {self.call}"] if self.call else []
        lines += [f"input: {name}, SHA-256 {digest}" for name, digest in self.inputs.items()]
        return [*lines, f"seed: {self.seed}"] if self.seed is not None else lines


def provenance(call: str = "", inputs: Iterable[str | Path] = (), seed: int | None = None) -> Provenance:
    """Return the provenance of a result of ``call`` and files; a source that is not a file (a preset) has no hash."""
    digests = {visible(str(path)): digest(path) for path in inputs if os.path.isfile(path)}
    return Provenance(call=visible(call), inputs=digests, seed=seed)


def digest(path: str | Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def command_line(arguments: Iterable[str] | None = None) -> str:
    """Return the command with ``arguments`` (default: this process's), quoted for a shell."""
    return shlex.join(["ilg-circuit", *(sys.argv[1:] if arguments is None else arguments)])
