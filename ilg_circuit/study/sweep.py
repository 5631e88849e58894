"""Sweeps: `sweep` solves the designs of a grid, a sample or a list into one netCDF file, in parallel and resumably."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, Executor
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, ClassVar

from ..circuit.load import Hung
from ..drive import Drive, drive_findings
from ..errors import InputError, SolveError, checked
from ..extras import require_study
from ..files import Log, require_writable, write_csv
from ..findings import Finding, Warned
from ..provenance import Provenance
from ..result import Column, Result
from ..solve.library import chosen_engine
from ..strip.actuator import Actuator
from ..strip.layered import thickness_findings
from ..strip.validity import deflection_warnings
from .dataset import Store, SweepTotals, read_sweep, table, write_dataset
from .evaluate import STUDY_ACCURACY, Evaluation, Progress
from .outputs import names_of
from .parameters import scenario_template
from .plan import Vary, range_texts
from .spec import SweepSpec, solve_task, sweep_spec
from .workers import GivenPool, cluster_pool, local_pool, solve_on

if TYPE_CHECKING:
    from xarray import Dataset


@dataclass(frozen=True, repr=False, eq=False)
class SweepResult(Result, Warned):
    """The outputs of many designs of a strip, as `ilg_circuit.sweep` returns them.

    Attributes
    ----------
    spec : SweepSpec
        What was solved: the strip, the varied parameters, the outputs.
    totals : SweepTotals
        Number of designs and of failures, lowest and highest value of each output.
    path : Path or None
        The file, None for a result kept in memory.
    resumed : int
        Number of designs that an earlier run had solved.
    leftover : Path or None
        A folder with finished tasks of another sweep into the same file.
    warnings : tuple of str
        Findings as sentences.
    """

    presenter: ClassVar[str] = "sweep"

    spec: SweepSpec
    totals: SweepTotals
    path: Path | None = None
    resumed: int = 0
    leftover: Path | None = None
    data: Dataset | None = field(default=None, repr=False)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings on the drive's file, on a thickness varied without layers, on designs beyond small deflection."""
        texts = deflection_warnings(self.totals.bent)
        template, columns = self.spec.template, self.spec.plan.columns
        told = drive_findings(template.parsed_drive())
        told += tuple(Finding("assumption-fails", values={"text": text}) for text in texts)
        numbers = {name: column for name, column in columns.items() if column.dtype.kind == "f"}
        return told + thickness_findings(template.actuator, numbers)

    def to_xarray(self) -> Dataset:
        """Return the designs and their outputs with units; from a file it is opened and not loaded yet."""
        if self.data is not None:
            return self.data
        assert self.path is not None
        return read_sweep(self.path)

    def table(self) -> tuple[Column, ...]:
        """Return parameters, outputs, estimated error and failure, a row a design; waveforms are in `to_xarray`."""
        with self.to_xarray() as data:
            kept = data.drop_dims("time", errors="ignore")
            frame = kept.to_dataframe(dim_order=list(kept.dims)).reset_index()
            units = {str(name): str(variable.attrs.get("units", "1")) for name, variable in kept.variables.items()}
        words = {str(name) for name in frame if frame[name].dtype.kind not in "fiu"}
        named = {str(name): None if str(name) in words else units.get(str(name), "") for name in frame}
        columns = {name: frame[name].to_numpy() for name in named}
        return tuple(Column(name, columns[name], "" if unit == "1" else unit) for name, unit in named.items())

    def to_dict(self) -> dict[str, Any]:
        """Return the totals as JSON-ready values, SI units; ``lowest`` and ``highest`` name the design's number."""
        totals = self.totals
        lowest, highest = (
            {name: {"value": value, "design": number} for name, (value, number) in ends.items()}
            for ends in (totals.lowest, totals.highest)
        )
        return {
            "designs": self.spec.plan.text,
            "count": totals.count,
            "failed": totals.failed,
            "resumed": self.resumed,
            "estimated_error": totals.worst_error,
            "lowest": lowest,
            "highest": highest,
            "warnings": list(self.warnings),
        }


@checked
def sweep(
    strip: str | Path | Actuator,
    drive: str | Drive,
    duration: str | float,
    vary: Vary = (),
    *,
    tip: str = "free",
    beam: str | None = None,
    load: Hung = None,
    random: int | None = None,
    method: str | None = None,
    seed: int | None = None,
    designs: str | Path | None = None,
    outputs: str | Sequence[str] | None = None,
    waveforms: str | Sequence[str] | None = None,
    samples: int | None = None,
    engine: str | None = None,
    accuracy: float = STUDY_ACCURACY,
    out: str | Path | None = None,
    jobs: int | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    log: str | Path | None = None,
    provenance: Provenance | None = None,
) -> SweepResult:
    """Return the outputs of many designs of a strip: a grid, a random sample or a list of varied values.

    Parameters
    ----------
    strip : Actuator, str or Path
        Strip that is varied: an object, the path of a TOML file or a preset's name.
    drive : str or Drive
        A text such as "step:4V", whose values can be varied too, or a drive.
    duration : float or str
        Duration of each run [s].
    vary : mapping or iterable of str
        ``{"thickness": ("0.2 mm", "1 mm", 9)}`` or texts such as "thickness=0.2mm:1mm:9": low, high and a number of
        points. Several names make a grid. Names are the keys of a strip's file (length, free_length, width, thickness,
        load_position, youngs_modulus, density, dc_resistivity, dynamic_resistivity, permittivity and so on);
        voltage, period, duty, frequency or rate of the drive; load_mass, load_stiffness, load_damping; orientation.
    tip : {"free", "clamped"}
        Whether the tip moves.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".
    random : int, optional
        Number of random designs within the ranges, in place of a grid.
    method : {"lhs", "sobol", "uniform"}, optional
        How random designs are drawn (default: Latin hypercube).
    seed : int, optional
        Seed of random designs (default 0).
    designs : str or Path, optional
        CSV file with one design a row, in place of ``vary``.
    outputs : str or sequence of str, optional
        Names of the outputs, such as ["displacement_final", "energy"]; all are listed under Notes (default: all but
        the blocked forces, which need a second run, and the voltage).
    waveforms : str or sequence of str, optional
        Waveforms to keep, such as "displacement"; they are in ``to_xarray()``.
    samples : int, optional
        Samples of each waveform (default 601).
    engine : {"ngspice", "exact", "auto"}, optional
        Solver; auto is exact for linear circuits and ngspice for others (default: ngspice; without its library exact,
        with a warning).
    accuracy : float
        Largest error allowed for ngspice, relative to the maximum of each waveform.
    out : str or Path, optional
        The netCDF file; an interrupted sweep into it goes on where it was. Without it the result stays in memory.
    jobs : int, optional
        Number of processes (default: one per core).
    cluster : str, optional
        Workers of a dask cluster: "tcp://HOST:PORT", or "local:4".
    executor : concurrent.futures.Executor, optional
        An executor of your own, whose workers solve the designs.
    progress : callable, optional
        Function that is called with (done, total) designs.
    log : str or Path, optional
        File to which one line per design is appended: time, number, outcome.
    provenance : Provenance, optional
        Origin that is written into the file.

    Returns
    -------
    SweepResult
        ``to_dataframe()`` has one row a design; ``to_xarray()`` has the grid, with units. See `ilg.results`.

    Raises
    ------
    InputError
        A name, a range or an option is not understood, or the file cannot be written.
    SolveError
        Every design fails.

    Notes
    -----
    Outputs of a run. L_F is the place of the load (the tip by default); "the motion" is the displacement, or the force
    if the tip is clamped:

    ===================  =  ==================================================================
    displacement_final   m  displacement of L_F at the end
    displacement_peak    m  largest displacement of L_F, with its sign
    displacement_rms     m  root mean square displacement of L_F
    relative_deflection  1  largest displacement over L_F; the model holds up to 0.2
    time_of_peak         s  time at which the motion is largest
    overshoot            1  how far the motion exceeds its final value, relative to that value
    time_of_90           s  time at which the motion first reaches 90 % of its final value
    settling_time        s  time from which the motion stays within 2 % of its final value
    force_final          N  force on load or clamp at the end
    force_peak           N  largest force on load or clamp, with its sign
    force_rms            N  root mean square force on load or clamp
    force_blocked        N  force at the end with L_F clamped
    force_blocked_peak   N  largest force with L_F clamped
    voltage_final        V  voltage at the end
    voltage_peak         V  largest voltage, with its sign
    current_final        A  current at the end
    current_peak         A  largest current, with its sign
    current_rms          A  root mean square current
    charge_final         C  charge at the end
    charge_peak          C  largest charge, with its sign
    charge_rms           C  root mean square charge
    energy               J  energy delivered by the source
    ===================  =  ==================================================================

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> ranges = {"thickness": ("0.4 mm", "0.6 mm", 3)}
    >>> found = ilg.sweep("paper", "step:4V", "300 s", ranges, engine="exact", jobs=1)
    >>> found.to_xarray().displacement_final.shape
    (3,)
    """
    require_study(cluster=cluster is not None)
    template = scenario_template(strip, drive, duration, tip=tip, beam=beam, load=load)
    engine = chosen_engine(engine, linear=template.actuator.material.model.linear)
    spec = sweep_spec(
        template,
        range_texts(vary),
        random=random,
        method=method,
        seed=seed,
        designs=designs,
        outputs=names_of(outputs),
        waveforms=names_of(waveforms),
        samples=samples,
        engine=engine,
        accuracy=accuracy,
    )
    made_by = provenance or Provenance(seed=seed)
    how: dict[str, Any] = {"jobs": jobs, "cluster": cluster, "executor": executor, "progress": progress, "log": log}
    return solve_sweep(spec, out, **how, provenance=made_by)


def solve_sweep(
    spec: SweepSpec,
    out: str | Path | None = None,
    *,
    jobs: int | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    log: str | Path | None = None,
    provenance: Provenance | None = None,
) -> SweepResult:
    """Solve ``spec`` into the netCDF file ``out`` (a CSV file where its name ends so), or in memory without one.

    Solved by ``jobs`` processes (default: one a core; this one alone for a single task, or where processes cannot share
    locks), on a dask ``cluster`` (see `workers`), or on an ``executor`` like those of `concurrent.futures`; the result
    is the same. Finished tasks are kept beside ``out`` until all are, so that an interrupted sweep is resumed.
    ``progress(done, total)`` counts designs, first called before any is solved. Raises InputError where the file cannot
    be written, SolveError where every design fails.
    """
    if out is None:
        with TemporaryDirectory() as folder:
            where: dict[str, Any] = {"jobs": jobs, "cluster": cluster, "executor": executor}
            where |= {"progress": progress, "log": log, "provenance": provenance}
            result = solve_sweep(spec, Path(folder) / "sweep.nc", **where)
            with result.to_xarray() as data:
                return replace(result, path=None, leftover=None, data=data.load())
    path = Path(out)
    require_writable(path)
    as_csv = path.suffix.lower() == ".csv"
    if as_csv and spec.waveforms:
        raise InputError(f"'{path}' is a table, a design a row, without room for waveforms; end its name in .nc")
    if sum(x is not None for x in (jobs, cluster, executor)) > 1:
        raise InputError("give one of jobs, cluster and executor")
    if jobs is not None and not 1 <= jobs <= 1024:
        raise InputError(f"{jobs} jobs: give 1 to 1024")
    made_by, tell = provenance or Provenance(), None if log is None else Log(log)
    store = Store(path, spec)
    with store.held():
        finished = store.finished()
        missing = [k for k in range(spec.task_count) if k not in finished]
        resumed = spec.plan.count - sum(stop - start for start, stop in map(spec.bounds, missing))
        with _pool(len(missing), jobs, cluster, executor) if missing else nullcontext() as pool:
            _solve(spec, missing, resumed, store, pool, progress or (lambda done, total: None), tell)
        kept: Dataset | None = None
        try:
            if as_csv:
                made = store.folder / "sweep.nc"
                totals = write_dataset(made, spec, store, made_by)
                with read_sweep(made) as opened:
                    kept = opened.load()
                write_csv(path, table(spec, kept))
            else:
                totals = write_dataset(path, spec, store, made_by)
        except SolveError:  # nothing is worth keeping where every design failed
            store.remove()
            raise
        store.remove()
    leftover = store.parent if store.parent.exists() else None
    return SweepResult(spec, totals, path, resumed, leftover, kept, provenance=made_by)


def _solve(
    spec: SweepSpec,
    missing: list[int],
    done: int,
    store: Store,
    pool: GivenPool | None,
    progress: Progress,
    log: Log | None,
) -> None:
    """Solve the ``missing`` tasks into the store, without a ``pool`` in this process; ``done`` designs are solved."""
    total = spec.plan.count
    progress(done, total)

    def save(number: int, result: Evaluation) -> None:
        nonlocal done
        store.write(number, result)
        if log:
            start = spec.bounds(number)[0]
            for k in range(len(result.values)):
                log(f"design {start + k}", f"failed: {result.failures[k]}" if k in result.failures else "solved")
        done += len(result.values)
        progress(done, total)

    if pool:
        solve_on(pool, missing, spec.task, save)
        return
    for number in missing:
        save(number, solve_task(spec.task(number), lambda solved, _: progress(done + solved, total)))


def _pool(
    tasks: int, jobs: int | None, cluster: str | None, executor: Executor | None
) -> AbstractContextManager[GivenPool | None]:
    """Return the workers for so many tasks, None where this process is enough or others are impossible."""
    if cluster is not None:
        return cluster_pool(cluster)
    if executor is not None:
        width = int(getattr(executor, "_max_workers", 1))
        return nullcontext(GivenPool(executor, lambda: width, (BrokenExecutor,)))
    pool = local_pool(tasks, jobs)
    return closing(pool) if pool else nullcontext()
