"""Many files, each fitted individually, on all cores; finished fits are not repeated."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from .. import __version__
from ..errors import IlgError, InputError, argument, first_line, spelling, written
from ..extras import require_study
from ..files import MARKER, Log, locked, marked, outdated_by_failure, remove_leftovers, require_writable, write_json
from ..fit.intervals import require_method
from ..identification.batch import Batch, FileFit
from ..measurements.said import said_of
from ..provenance import digest, provenance
from ..report.folder import FILES, save_folder
from ..strip.actuator import Actuator
from ..strip.file import dumps
from ..strip.models import electrical_model
from ..strip.specimen import Specimen
from ..study.workers import KILLED, GivenPool, local_pool, solve_on, tried
from .data import onset_of
from .each_file import values_of
from .fits import fit_engine, identify
from .given import Given, Strip, quantity
from .strips import KEYS, measured_strip

#: Name of the table of a batch in its folder, and of the file that locks the folder.
TABLE, _LOCK = "table.csv", "lock"


@dataclass(frozen=True)
class FileTask:
    """One file to fit: ``options`` of `identify`, the ``folder`` for its fit (None: nothing is written).

    ``spelling`` is the style of arguments' names in messages, also in another process.
    """

    path: Path
    strip: Actuator | Specimen | None
    options: Mapping[str, Any]
    folder: Path | None = None
    call: str = ""
    force: bool = False
    key: str = field(default="", compare=False)
    spelling: Mapping[str, str] = field(default_factory=spelling, compare=False)


def identify_each(
    paths: Iterable[str | Path],
    strip: Strip | Specimen | None = None,
    *,
    folder: str | Path | None = None,
    jobs: int | None = None,
    log: str | Path | None = None,
    progress: Callable[[int, int], object] | None = None,
    done: Callable[[FileFit], object] | None = None,
    known: Mapping[str, FileFit] | None = None,
    call: str = "",
    force: bool = False,
    **options: Any,
) -> Batch:
    """Return the individual fits of many files; a file that fails is a row with its reason, and the others go on.

    Parameters
    ----------
    paths : iterable of str or Path
        Files of records and spectra.
    strip : Actuator, Specimen, str or Path, optional
        The strip of all files, see `identify`.
    folder : str or Path, optional
        Where each fit is left as a folder, and a table of all: a file that was fitted there before, with the same
        content and options, is not fitted again. Without it nothing is written.
    jobs : int, optional
        Number of processes (default: one per core).
    log : str or Path, optional
        File to which one line per file is appended: time, file, outcome.
    progress : callable, optional
        Function that is called with (done, total) files.
    done : callable, optional
        Function that is called with each `FileFit` when it is ready.
    known : mapping of str to FileFit, optional
        Path -> a finished row, which is not fitted again.
    call : str
        Call that is written into the fits' provenance.
    force : bool
        True to write into a folder that was not made by a fit, and to replace any fit in it.
    **options : Any
        ``model``, ``engine``, ``onset``, ``columns``, ``length`` and all others of `identify`.

    Returns
    -------
    Batch
        One row per file, in the order of ``paths``; ``exit_code`` is the worst of all files. See `ilg.results`.

    Raises
    ------
    InputError
        An option is wrong for all files, a file is given twice, or the folder is not to be written to.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> from pathlib import Path
    >>> import ilg_circuit as ilg
    >>> t = np.arange(-5.0, 60.0, 0.5)
    >>> with tempfile.TemporaryDirectory() as place:
    ...     for k, ohm in enumerate((20, 25)):
    ...         i = np.where(t < 0, 0.0, 4 / 600 + 4 / ohm * np.exp(-t / 7)) + 1e-4 * np.sin(1e3 * t)
    ...         table = np.column_stack([t, np.where(t < 0, 0.0, 4.0), i])
    ...         header = "time_s,voltage_V,current_A"
    ...         np.savetxt(Path(place) / f"{k}.csv", table, delimiter=",", header=header, comments="")
    ...     files = sorted(Path(place).glob("*.csv"))
    ...     batch = ilg.identify_each(files, model="rc", engine="exact", onset="first-level", jobs=1)
    >>> [round(e.value) for e in batch.estimates("dynamic_resistance")], batch.exit_code
    ([20, 25], 0)
    """
    if jobs is not None and not 1 <= jobs <= 1024:
        raise InputError(f"{jobs} jobs: give 1 to 1024")
    if jobs is not None and jobs > 1:
        require_study()
    if isinstance(paths, str | Path):
        raise InputError(f"paths is one text, '{str(paths)[:60]}'; give a list, such as sorted(Path().glob('*.csv'))")
    files = [Path(path) for path in paths]
    root = None if folder is None else Path(folder)
    tasks = _tasks(files, strip, root, options, call, force)
    standing = known or {}
    found = {number: standing[str(path)] for number, path in enumerate(files) if str(path) in standing}
    tell, count = Log(log) if log is not None else None, len(found)

    def save(number: int, result: FileFit) -> None:
        nonlocal count
        found[number], count = result, count + 1
        if tell:
            tell(result.path, result.outcome)
        if done:
            done(result)
        if progress:
            progress(count, len(files))

    with _held(root, force=force) if root is not None else nullcontext():
        for number, task in enumerate(tasks):
            if number not in found and (kept := _kept(task)) is not None:
                save(number, kept)
        left = [number for number in range(len(files)) if number not in found]
        _fit(left, tasks, jobs, save)
        batch = Batch(tuple(found[number] for number in range(len(files))), root, provenance=provenance(call, files))
        if root is not None:
            batch.write_csv(root / TABLE)
    return batch


def fit_file(task: FileTask) -> FileFit:
    """Return the fit of one file, written to its folder, or the error that it ended in."""
    path = str(task.path)
    try:
        with written(task.spelling):
            with outdated_by_failure(task.folder):
                fit = identify(task.path, task.strip, **task.options)
            fit = replace(fit, provenance=provenance(task.call or fit.provenance.call, [task.path], fit.seed))
            content = fit.to_dict()
            if task.folder is not None:
                from ..report.axes import load_plainly

                load_plainly()
                save_folder(fit, task.folder, force=task.force, key=task.key)
    except IlgError as error:
        return FileFit(path, error.exit_code, error=str(error))
    except OSError as error:
        return FileFit(path, 2, error=f"cannot read or write '{error.filename}': {error.strerror or error}")
    except Exception as error:  # one file of many must not end the others
        return FileFit(path, 1, error=f"{type(error).__name__}: {first_line(error)}")
    return FileFit(path, 0 if fit.success else 1, content, folder=task.folder)


def folder_of_all(files: Sequence[Path]) -> Path:
    """Return the folder for the fits of files: each.fit beside them, or in the working folder.

    The working folder is used if the files are in several folders, or in one that is not writable.
    """
    from os import W_OK, X_OK, access

    places = {file.parent.resolve() for file in files}
    alone = files[0].parent if len(places) == 1 else Path()
    return (alone if access(alone, W_OK | X_OK) else Path()) / "each.fit"


def labels(files: Sequence[Path]) -> list[str]:
    """Return a name for each file's folder: its stem, with suffix, then with its folder, where others have the same."""
    ways = (
        lambda file: file.stem,
        lambda file: file.name,
        lambda file: f"{file.resolve().parent.name}-{file.name}",
        lambda file: "-".join(file.resolve().parts[1:]),
    )
    chosen = [0] * len(files)
    while True:
        found = [ways[way](file) for way, file in zip(chosen, files, strict=True)]
        low = [name.casefold() for name in found]
        twice = [k for k, name in enumerate(low) if low.count(name) > 1 or name in (TABLE, _LOCK, MARKER)]
        if not any(chosen[k] < len(ways) - 1 for k in twice):
            return found
        for k in twice:
            chosen[k] = min(chosen[k] + 1, len(ways) - 1)


def checked(
    strip: Strip | Specimen | None, options: Mapping[str, Any]
) -> tuple[Actuator | Specimen | None, dict[str, Any]]:
    """Return the strip, and the other options. Raises InputError for options that are wrong for any file."""
    rest = dict(options)
    base = measured_strip(strip, **{key: rest.pop(key, None) for key in KEYS})
    if (model := rest.get("model", "auto")) != "auto":
        electrical_model(model)
    rest["engine"] = fit_engine(rest.get("engine"), model)
    require_method(rest.get("intervals", "covariance"))
    said_of(rest.get("columns", ()), rest.get("units", ()), rest.get("part"), rest.get("cycle"))
    units = {"until": "s", "electrode_resistance": "ohm", "displacement_delay": "s", "bias": "V"}
    for name, unit in units.items():
        given = rest.get(name)
        for value in given.values() if isinstance(given, Mapping) else [given]:
            if isinstance(value, str) and value != "fit":
                quantity(value, unit, name)
    onset = rest.get("onset")
    for stated in onset.values() if isinstance(onset, Mapping) else [onset]:
        onset_of(stated)
    return base, rest


def _tasks(
    files: Sequence[Path],
    strip: Strip | Specimen | None,
    root: Path | None,
    options: Mapping[str, Any],
    call: str,
    force: bool,
) -> list[FileTask]:
    """Return the tasks for all files. Raises InputError for what is wrong regardless of their content."""
    if not files:
        raise InputError("no files were given; give paths of measured files")
    real = [file.resolve() for file in files]
    if len(set(real)) < len(real):
        again = next(file for k, file in enumerate(files) if real[k] in real[:k])
        raise InputError(f"'{again}' is given twice; give each file once")
    base, rest = checked(strip, options)
    by_file: dict[str, Sequence[Given | None]] = {}
    for name in ("onset", "bias", "drive"):
        if isinstance(rest.get(name), Mapping):
            by_file[name] = values_of(rest.pop(name), files, name)
    what = "" if base is None else base.to_toml() if isinstance(base, Specimen) else dumps(base)
    names = labels(files) if root is not None else [""] * len(files)
    tasks = []
    for k, (path, name) in enumerate(zip(files, names, strict=True)):
        own = rest | {key: values[k] for key, values in by_file.items() if values[k] is not None}
        place = root / name if root is not None else None
        task = FileTask(path, base, own, place, call, force)
        tasks.append(replace(task, key=_key(task, what)) if place is not None else task)
    return tasks


def _key(task: FileTask, strip: str) -> str:
    """Return a key that identifies a fit: version, content of the file, strip and options."""
    with suppress(OSError):
        parts = [__version__, digest(task.path), strip, sorted(task.options.items())]
        return hashlib.sha256(json.dumps(parts, default=str).encode()).hexdigest()
    return ""


def _kept(task: FileTask) -> FileFit | None:
    """Return the fit that an earlier run left in a task's folder; None where there is none of this file and options."""
    if task.folder is None or not task.key or marked(task.folder).get("key") != task.key:
        return None
    try:
        content = json.loads((task.folder / FILES[1]).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not all((task.folder / name).is_file() for name in FILES):
        return None
    return FileFit(str(task.path), 0 if content["success"] else 1, content, folder=task.folder, resumed=True)


@contextmanager
def _held(root: Path, *, force: bool) -> Iterator[None]:
    """Hold the folder of a batch, made if absent. Raises InputError for a folder that does not hold fits."""
    other = f"another {argument('folder')}"
    if root.is_dir():
        if any(root.iterdir()) and not (root / MARKER).exists() and not force:
            raise InputError(f"'{root}' was not made by a fit; give {argument('force')} to write into it, or {other}")
    else:
        require_writable(root)
    with locked(root / _LOCK, f"another run writes to '{root}'; wait for its end, or give {other}"):
        if not (root / MARKER).exists():
            write_json(root / MARKER, {"made_by": __version__, "files": [TABLE]})
        remove_leftovers(root)
        try:
            yield
        finally:
            remove_leftovers(root)


def _fit(
    numbers: Sequence[int], tasks: Sequence[FileTask], jobs: int | None, save: Callable[[int, FileFit], None]
) -> None:
    """Fit the tasks with these indices on ``jobs`` processes, or in this one."""
    possible = find_spec("loky") is not None and len(numbers) > 1
    pool = local_pool(len(numbers), jobs, fit_file) if possible else None
    if pool is None:
        for number in numbers:
            save(number, fit_file(tasks[number]))
        return
    with closing(pool):
        solve_on(pool, numbers, tasks.__getitem__, save, _alone)


def _alone(pool: GivenPool, task: FileTask) -> FileFit:
    """Fit a file whose worker was killed again, alone."""
    found = tried(pool, task)
    return found if found is not None else FileFit(str(task.path), 1, error=KILLED)
