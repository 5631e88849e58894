"""What the solver process does: fits, runs of ngspice, sweeps, designs. Each is one call of the front door."""

from __future__ import annotations

import io
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import ilg_circuit as ilg

from ..errors import InputError
from ..front.data import sets_of
from ..measurements.film import Film
from ..measurements.said import said_of
from ..provenance import provenance
from ..strip.actuator import Actuator
from ..strip.specimen import Specimen
from ..units import si
from .answers import Answer, answer

#: Called with (done, total), or with nothing.
Report = Callable[..., None]


@dataclass(frozen=True)
class Source:
    """A measured file: its ``path``, its ``name`` for people, and what the user ``said`` of it, as for `ilg.read`."""

    path: Path
    name: str
    said: Mapping[str, Any] = field(default_factory=dict)


def read(source: Source, options: Mapping[str, Any]) -> Any:
    """Return what a file holds, by the ``options`` of `ilg.identify` that are about files.

    A displacement alone is read with the ``drive`` among them. Raises InputError for a file that is not understood.
    """
    onset, scale, drive = (options.get(name) for name in ("onset", "scale", "drive"))
    try:
        return ilg.read(source.path, onset=onset, scale=scale, **source.said)
    except InputError:
        if drive is None:
            raise
    until = None if options.get("until") is None else si(options["until"], "s", "until")
    return sets_of([source.path], onset, said_of(**source.said, scale=scale), None, drive, until)[0]


def fit(
    sources: Sequence[Source],
    strip: Actuator | Specimen | None,
    options: Mapping[str, Any],
    intervals: str = "covariance",
    progress: Report | None = None,
) -> Answer:
    """Return the fit of files together; ``options`` are those of `ilg.identify`."""
    data = [read(each, options) for each in sources]
    given = {name: value for name, value in options.items() if name not in ("scale", "drive")}  # read with these
    if any(isinstance(each, Film) for each in data):
        given.pop("onset", None)
    result = ilg.identify(data, strip, intervals=intervals, progress=progress, **given)
    words = [f"--{name.replace('_', '-')} {shlex.quote(str(value))}" for name, value in options.items()]
    words += [f"--intervals {intervals}"] if intervals != "covariance" else []
    call = " ".join(["ilg-circuit identify", *(shlex.quote(each.name) for each in sources), *words])
    verdict = (
        f"Model {result.model} describes the data; the other tabs now use the fitted strip."
        if result.success
        else "The data do not determine the answer; read the warnings below. The other tabs keep their strip."
    )
    return answer(result, provenance(call, [each.path for each in sources]), result.success, verdict)


def run(strip: Actuator, drive: str, duration: str, tip: str, load: str = "", progress: Report | None = None) -> Any:
    """Return the response of a strip to a drive, solved by ngspice."""
    return ilg.simulate(strip, drive, duration, tip=tip, load=load or None, engine="ngspice", progress=progress)


def sweep(
    strip: Actuator,
    drive: str,
    duration: str,
    vary: Sequence[str],
    outputs: Sequence[str],
    tip: str = "free",
    progress: Report | None = None,
) -> Answer:
    """Return a sweep with its map; ``made`` is its table as CSV."""
    result = ilg.sweep(strip, drive, duration, vary, outputs=outputs, tip=tip, engine="auto", progress=progress)
    words = " ".join(f"--vary {shlex.quote(text)}" for text in vary)
    call = f"ilg-circuit sweep STRIP --drive {shlex.quote(drive)} --duration {shlex.quote(duration)} {words}"
    failed = f"; {result.totals.failed} of them failed" if result.totals.failed else ""
    verdict = f"{result.totals.count} designs solved{failed}."
    table = io.StringIO()
    result.to_dataframe().to_csv(table, index=False)
    return answer(result, provenance(call), not result.totals.failed, verdict, table.getvalue())


def design(
    strip: Actuator,
    drive: str,
    duration: str,
    vary: Sequence[str],
    require: Sequence[str],
    aim: Mapping[str, Any],
    progress: Report | None = None,
) -> Answer:
    """Return the best strip; ``made`` is the strip, None where no requirement is met."""

    def count(number: int = 1) -> None:
        del number
        if progress is not None:
            progress()

    result = ilg.design(strip, drive, duration, vary, require=require, count=count, **aim)
    words = [f"--vary {shlex.quote(text)}" for text in vary] + [f"--require {shlex.quote(text)}" for text in require]
    words += [f"--{name} {value}" for name, value in aim.items()]
    call = " ".join(["ilg-circuit design STRIP", f"--drive {drive} --duration {shlex.quote(duration)}", *words])
    verdict = (
        "A strip that meets all requirements." if result.feasible else "No strip within the ranges meets all of them."
    )
    found = result.design.scenario.actuator if result.design is not None and result.feasible else None
    return answer(result, provenance(call), result.feasible, verdict, found)
