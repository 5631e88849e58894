"""Finished tasks on disk, from which an interrupted sweep is resumed.

They lie beside the sweep's file in a folder named after the specification's key, so that tasks of different sweeps
are never mixed. Each file is written whole or not at all.
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
    """Finished tasks of one sweep, whose result goes to ``out``. Raises InputError where its folder cannot be made."""

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
        """Return the numbers of the finished tasks."""
        names = {path.name for path in self.folder.glob("*.npz")}
        return {k for k in range(self._spec.task_count) if self._path(k).name in names}

    def write(self, number: int, result: Evaluation) -> None:
        """Write a task's result. Raises InputError where that is impossible."""
        arrays: dict[str, Any] = {f"waveform_{name}": values for name, values in result.waveforms.items()}
        failures = json.dumps(sorted(result.failures.items()))
        with replacing(self._path(number)) as temporary, temporary.open("wb") as file:
            arrays |= {"values": result.values, "errors": result.errors, "failures": np.array(failures)}
            np.savez(file, **arrays)

    def read(self, number: int) -> Evaluation:
        """Read a task's result. Raises InputError for a damaged file, which is removed."""
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
        """Remove the folder, and its parent unless another sweep has tasks in it."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self.remove_if_empty()

    def remove_if_empty(self) -> None:
        """Remove empty folders."""
        for folder in (self.folder, self.parent):
            with suppress(OSError):
                folder.rmdir()
