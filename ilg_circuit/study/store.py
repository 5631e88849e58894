"""Finished tasks on disk, so that a sweep that was interrupted goes on where it was.

Each lies beside the sweep's file in a folder of the spec's key, so the tasks of another spec are never taken
for its own, and is put there whole.
"""

from __future__ import annotations

import json
import shutil
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import replacing
from .evaluate import Evaluation
from .outputs import choose_outputs
from .spec import SweepSpec


class Store:
    """The finished tasks of one spec whose answer goes to ``out``."""

    def __init__(self, out: Path, spec: SweepSpec) -> None:
        self._spec = spec
        self.parent = out.with_name(out.name + ".part")
        self.folder = self.parent / spec.key[:16]
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"cannot make the folder '{self.folder}': {error.strerror or error}") from None

    def _path(self, number: int) -> Path:
        return self.folder / f"{number:06d}.npz"

    def finished(self) -> set[int]:
        """Numbers of the tasks that are there."""
        names = {path.name for path in self.folder.glob("*.npz")}
        return {k for k in range(self._spec.task_count) if self._path(k).name in names}

    def write(self, number: int, result: Evaluation) -> None:
        """Put a task's result there."""
        arrays: dict[str, Any] = {f"waveform_{name}": values for name, values in result.waveforms.items()}
        failures = json.dumps(sorted(result.failures.items()))
        with replacing(self._path(number)) as temporary, temporary.open("wb") as file:
            arrays |= {"values": result.values, "errors": result.errors, "failures": np.array(failures)}
            np.savez(file, **arrays)

    def read(self, number: int) -> Evaluation:
        """A task's result. Raises InputError for a file that something else has damaged."""
        path = self._path(number)
        try:
            with np.load(path) as file:
                waveforms = {n.removeprefix("waveform_"): file[n] for n in file.files if n.startswith("waveform_")}
                failures = {int(k): str(reason) for k, reason in json.loads(str(file["failures"]))}
                values, errors = file["values"], file["errors"]
        except (OSError, KeyError, ValueError, zipfile.BadZipFile):
            with suppress(OSError):
                path.unlink()
            raise InputError(f"'{path}' was damaged and has been removed; start again to solve what it held") from None
        return Evaluation(choose_outputs(self._spec.outputs), values, errors, failures, self._spec.times, waveforms)

    def remove(self) -> None:
        """Clear away, with the parent folder unless another spec has tasks in it."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self.remove_if_empty()

    def remove_if_empty(self) -> None:
        """Clear away what holds nothing."""
        for folder in (self.folder, self.parent):
            with suppress(OSError):
                folder.rmdir()
