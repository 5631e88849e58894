"""The result of fitting many files, each individually."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from ..fit.estimate import Estimate
from ..result import Column, Result


@dataclass(frozen=True)
class FileFit:
    """The fit of one file of a batch, or the error that it ended in.

    Attributes
    ----------
    path : str
        The file.
    exit_code : int
        Exit code of the command ``identify`` for this file alone: 0 if the fit is good.
    content : mapping or None
        What ``fit.json`` holds: the ``to_dict`` of the file's `Identification`.
    error : str
        The error in one line, empty if there is none.
    folder : Path or None
        The folder with the fit, if one was written.
    resumed : bool
        True if an earlier run wrote it.
    """

    path: str
    exit_code: int = 0
    content: Mapping[str, Any] | None = field(default=None, repr=False)
    error: str = ""
    folder: Path | None = None
    resumed: bool = False

    @property
    def model(self) -> str:
        """Name of the electrical model, empty without a fit."""
        return str(self.content["model"]) if self.content else ""

    @cached_property
    def parameters(self) -> dict[str, Estimate]:
        """The estimates by name."""
        found = self.content["parameters"] if self.content else {}
        return {name: Estimate.from_dict(entry) for name, entry in found.items()}

    @property
    def misfit(self) -> float | None:
        """Largest rms of the residuals of a quantity, relative to its size."""
        rows = self.content["records"] if self.content else []
        return max((row["rms_joint"] / row["peak"] for row in rows), default=None)

    @property
    def warnings(self) -> Sequence[str]:
        """The warnings of its fit."""
        return list(self.content["warnings"]) if self.content else []

    @property
    def outcome(self) -> str:
        """The outcome for the file in one line."""
        if self.content is None:
            return f"failed: {self.error}"
        how = "fitted" if self.exit_code == 0 else "no success"
        return f"{how}: model {self.model}, misfit {self.misfit or 0.0:.2%}{', by an earlier run' * self.resumed}"


@dataclass(frozen=True, repr=False, eq=False)
class Batch(Result):
    """The individual fits of many files, as `ilg_circuit.identify_each` returns them.

    Attributes
    ----------
    files : tuple of FileFit
        The fits in the order of the files.
    folder : Path or None
        The folder that holds them, if they were written.
    exit_code : int
        The worst exit code of all files.
    """

    presenter: ClassVar[str] = "batch"

    files: tuple[FileFit, ...]
    folder: Path | None = None

    @property
    def exit_code(self) -> int:
        """Exit code of the worst file: 2 if one could not be read, 1 if one was fitted without success."""
        return max((file.exit_code for file in self.files), default=0)

    def __len__(self) -> int:
        return len(self.files)

    def __iter__(self) -> Iterator[FileFit]:
        yield from self.files

    def __getitem__(self, name: str) -> FileFit:
        """Return the fit of a file by its path, or its name. Raises InputError for one that is not there."""
        from ..errors import unknown_name

        for file in self.files:
            if name in (file.path, Path(file.path).name):
                return file
        raise unknown_name("file", str(name), [file.path for file in self.files])

    @property
    def names(self) -> list[str]:
        """Names of the parameters of all files, the most frequent first."""
        count: dict[str, int] = {}
        for file in self.files:
            for name in file.parameters:
                count[name] = count.get(name, 0) + 1
        return sorted(count, key=lambda name: -count[name])

    def estimates(self, name: str) -> list[Estimate | None]:
        """Return the estimate of a parameter from every file.

        Parameters
        ----------
        name : str
            Name of the parameter, such as capacitance.

        Returns
        -------
        list of Estimate or None
            The estimates in the order of the files, None where a file has none.
        """
        found = [file.parameters.get(name) for file in self.files]
        return [e and e.quoted for e in found]

    def table(self) -> tuple[Column, ...]:
        """Return one row per file: outcome, model, parameters with errors and 95 % intervals, misfit, error."""
        columns = [
            Column("file", [file.path for file in self.files], over=True),
            Column("exit_code", [file.exit_code for file in self.files], ""),
            Column("model", [file.model for file in self.files]),
        ]
        for name in self.names:
            found = self.estimates(name)
            unit = next(e.unit for e in found if e is not None)
            ends = [(e and e.interval) or (None, None) for e in found]
            parts: dict[str, list[float | None]] = {
                "": [None if e is None else e.value for e in found],
                "_stderr": [None if e is None else e.stderr for e in found],
                "_low": [low for low, _ in ends],
                "_high": [high for _, high in ends],
            }
            columns += [Column(name + part, _floats(values), unit) for part, values in parts.items()]
        return (
            *columns,
            Column("misfit", _floats([file.misfit for file in self.files]), ""),
            Column("warnings", [len(file.warnings) for file in self.files], ""),
            Column("error", [file.error for file in self.files]),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the files with their parameters, ready for JSON."""
        return {
            "exit_code": self.exit_code,
            "files": [
                {
                    "file": file.path,
                    "exit_code": file.exit_code,
                    "model": file.model or None,
                    "parameters": {name: e.to_dict() for name, e in file.parameters.items()},
                    "misfit": file.misfit,
                    "warnings": list(file.warnings),
                    "error": file.error or None,
                    "folder": str(file.folder) if file.folder else None,
                    "resumed": file.resumed,
                }
                for file in self.files
            ],
        }


def _floats(values: Sequence[float | None]) -> list[float]:
    return [float("nan") if x is None else float(x) for x in values]
