"""The files of a sweep: its finished tasks, the netCDF file made of them, and the sweep's totals.

Finished tasks, from which an interrupted sweep is resumed, lie beside the sweep's file in a folder named after the
specification's key, so that tasks of different sweeps are never mixed. Each file is written whole or not at all; the
netCDF file is written task by task, so that it may exceed the memory.
"""

from __future__ import annotations

import json
import math
import platform
import re
import shutil
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, MissingLibraryError, SolveError, argument
from ..files import locked, replacing, writing_netcdf
from ..provenance import Provenance
from ..strip.file import dumps
from ..strip.validity import LARGEST_DEFLECTION
from .evaluate import Evaluation
from .outputs import OUTPUTS, WAVEFORMS, choose_outputs
from .parameters import varied_parameter
from .spec import SweepSpec

if TYPE_CHECKING:
    from xarray import Dataset

#: Dimension of designs that are not a grid.
DESIGN = "design"


class Store:
    """Finished tasks of one sweep, whose result goes to ``out``; they are this process' own within `held`."""

    def __init__(self, out: Path, spec: SweepSpec) -> None:
        self._spec, self._out = spec, out
        real = out.resolve()  # through a link
        self.parent = real.with_name(real.name + ".part")
        self.folder = self.parent / spec.key[:16]

    @contextmanager
    def held(self) -> Iterator[None]:
        """Make the folder and hold it. Raises InputError where that is impossible, or another process holds it."""
        other = argument("out")
        taken = f"another sweep is being written to '{self._out}'; wait until it is done, or choose another {other}"
        try:
            with locked(self.parent / "lock", taken):
                try:
                    self.folder.mkdir(exist_ok=True)
                except OSError as error:
                    reason = error.strerror or error
                    raise InputError(f"cannot make the folder '{self.folder}': {reason}") from None
                try:
                    yield
                finally:
                    with suppress(OSError):
                        self.folder.rmdir()  # a failed start, such as a wrong address, leaves nothing behind
        finally:
            with suppress(OSError):
                self.parent.rmdir()

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
        """Remove the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)


@dataclass
class SweepTotals:
    """Totals over ``count`` designs, gathered task by task.

    ``bent``: designs beyond the small-deflection limit, if the relative deflection is an output; ``lowest`` and
    ``highest``: output -> (value, number of the design); ``reasons``: reason of failure,
    numbers left out -> its count and an example.
    """

    count: int
    failed: int = 0
    bent: int = 0
    worst_error: float = 0.0
    reasons: dict[str, tuple[int, str]] = field(default_factory=dict)
    first_failure: tuple[int, str] | None = None
    lowest: dict[str, tuple[float, int]] = field(default_factory=dict)
    highest: dict[str, tuple[float, int]] = field(default_factory=dict)

    def add(self, start: int, result: Evaluation) -> None:
        """Add the results of the designs from ``start`` on."""
        self.failed += len(result.failures)
        for reason in result.failures.values():
            kind = re.sub(r"\d[\d.e+-]*", "#", reason)
            times, example = self.reasons.get(kind, (0, reason))
            self.reasons[kind] = times + 1, example
        if result.failures and self.first_failure is None:
            number = min(result.failures)
            self.first_failure = start + number, result.failures[number]
        self.worst_error = max(self.worst_error, float(np.nanmax(result.errors, initial=0.0)))
        for j, output in enumerate(result.outputs):
            values = result.values[:, j]
            if np.isnan(values).all():
                continue
            if output.name == "relative_deflection":
                self.bent += int((values > LARGEST_DEFLECTION).sum())
            for ends, find, chosen in ((self.lowest, np.nanargmin, min), (self.highest, np.nanargmax, max)):
                number = int(find(values))
                end = float(values[number]), start + number
                ends[output.name] = chosen(ends.get(output.name, end), end, key=itemgetter(0))


def write_dataset(path: Path, spec: SweepSpec, store: Store, provenance: Provenance) -> SweepTotals:
    """Write the file, whole or not at all, from the store, which must hold all tasks; return the totals.

    Raises SolveError when every design failed.
    """
    import h5py

    plan = spec.plan
    totals = SweepTotals(plan.count)
    text = h5py.string_dtype()
    with writing_netcdf(path) as file:
        dimensions = plan.names if plan.grid else (DESIGN,)
        file.dimensions = dict(zip(dimensions, plan.shape, strict=True))
        if spec.waveforms:
            file.dimensions["time"] = len(spec.times)

        def create(name: str, over: tuple[str, ...], unit: str, meaning: str, kind: Any = "f8") -> Any:
            variable = file.create_variable(name, over, dtype=kind)
            variable.attrs.update({"units": unit or "1", "long_name": meaning})
            if over[0] == DESIGN and name not in plan.names:
                variable.attrs["coordinates"] = " ".join(plan.names)
            return variable

        for name, column in plan.columns.items():
            item = varied_parameter(name)
            over = (name,) if plan.grid else (DESIGN,)
            variable = create(name, over, item.unit, item.meaning, text if item.words else "f8")
            variable[:] = column.astype(object) if item.words else column
        for name in spec.outputs:
            create(name, dimensions, OUTPUTS[name].unit, OUTPUTS[name].meaning)
        create("error", dimensions, "", "estimated error of the worst waveform over its maximum")
        create("failure", dimensions, "", "why a design failed; empty where it did not", text)
        if spec.waveforms:
            create("time", ("time",), "s", "time")[:] = spec.times
        for name in spec.waveforms:
            create(name, (*dimensions, "time"), WAVEFORMS[name], name)
        file.attrs.update(_attributes(spec, provenance))
        for number in range(spec.task_count):
            start, stop = spec.bounds(number)
            result = store.read(number)
            totals.add(start, result)
            failure = np.array([result.failures.get(k, "") for k in range(stop - start)], dtype=object)
            flat: dict[str, NDArray[Any]] = {n: result.values[:, j] for j, n in enumerate(spec.outputs)}
            flat |= {"error": result.errors, "failure": failure} | result.waveforms
            for box, inside in boxes(plan.shape, start, stop):
                shape = tuple(s.stop - s.start for s in box)
                for name, values in flat.items():
                    part = values[inside.start - start : inside.stop - start]
                    file[name][box] = part.reshape(shape + values.shape[1:])
        if totals.first_failure and totals.failed == totals.count:
            number, reason = totals.first_failure
            raise SolveError(f"all {totals.count} designs failed, design {number} because: {reason}")
    return totals


def table(spec: SweepSpec, data: Dataset) -> dict[str, NDArray[Any]]:
    """Return a sweep as columns, a design a row: what is varied, outputs, error and failure; units in the headers."""
    outputs = {name: OUTPUTS[name].unit for name in spec.outputs} | {"error": "", "failure": ""}
    columns = {
        name: (varied_parameter(name).unit, column) for name, column in spec.plan.designs(0, spec.plan.count).items()
    }
    columns |= {name: (unit, data[name].values.ravel()) for name, unit in outputs.items()}
    return {f"{name}_{unit}" if unit else name: column for name, (unit, column) in columns.items()}


def boxes(shape: tuple[int, ...], start: int, stop: int) -> Iterator[tuple[tuple[slice, ...], slice]]:
    """Yield the blocks of an array of ``shape`` filled by its elements ``start`` to ``stop`` (last axis fastest).

    Each block comes with the slice of its elements.
    """
    sizes = [math.prod(shape[axis + 1 :]) for axis in range(len(shape))]  # elements for each step along an axis
    while start < stop:
        axis = next(k for k, size in enumerate(sizes) if start % size == 0 and start + size <= stop)
        index = [int(k) for k in np.unravel_index(start, shape)]
        steps = min((stop - start) // sizes[axis], shape[axis] - index[axis])
        before = (slice(k, k + 1) for k in index[:axis])
        after = (slice(0, length) for length in shape[axis + 1 :])
        end = start + steps * sizes[axis]
        yield (*before, slice(index[axis], index[axis] + steps), *after), slice(start, end)
        start = end


def read_sweep(path: str | Path) -> Dataset:
    """Open the sweep in a file, of any version, as an xarray Dataset. Raises InputError where it is not a sweep."""
    import xarray

    try:
        data = xarray.open_dataset(Path(path), engine="h5netcdf")
    except FileNotFoundError:
        raise InputError(f"cannot read '{path}': there is no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read '{path}' as a sweep: {' '.join(str(error).split())[:120]}") from None
    if "failure" not in data:
        data.close()
        raise InputError(f"'{path}' is a netCDF file, but not one of a sweep")
    return data


def _attributes(spec: SweepSpec, provenance: Provenance) -> dict[str, Any]:
    import scipy

    template = spec.template
    solver = {} if spec.engine == "exact" else {"ngspice_version": _ngspice_version()}
    return {
        "Conventions": "CF-1.11",
        "title": f"{spec.plan.text}: {template.actuator.name}, {template.drive_text}",
        "source": f"ilg_circuit {provenance.version}",
        "command": provenance.call,
        "provenance": json.dumps(provenance.to_dict()),
        "actuator": dumps(template.actuator),
        "drive": template.drive_text,
        "duration_s": template.duration,
        "tip": template.tip,
        "beam": template.usual_beam,
        **{f"load_{name}": value for name, value in asdict(template.load).items()},
        "designs": spec.plan.text,
        "engine": spec.engine,
        "accuracy": spec.accuracy,
        "python_version": platform.python_version(),
        "numpy_version": np.__version__,
        "scipy_version": scipy.__version__,
        **solver,
    }


def _ngspice_version() -> str:
    from ..solve.ngspice import session

    try:
        return session().version
    except MissingLibraryError:  # it was solved elsewhere
        return "not on the machine that wrote this file"
