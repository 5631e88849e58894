"""What every command does with its result: write the files that were asked for, print text, print warnings.

outputs = {"--out": out, "--json": json_path, "--plot": plot, "--report": report}
result = ...
emit(result, outputs, inputs=data, writers={"--out": write_actuator})
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar

import click

from ..errors import InputError, SolveError, visible
from ..files import write_json
from ..provenance import Provenance, command_line, provenance
from ..result import Result
from .paths import STDOUT, picture_look

if TYPE_CHECKING:
    from ..simulation.check import Difference

#: Options -> files to write; None where an option was not given.
Outputs = Mapping[str, Path | None]
#: Options whose files are pictures, or hold some that go into papers.
_PICTURES = ("--plot", "--plot-shape", "--sobol-plot", "--animate", "--folder")


class Emitted(Protocol):
    """What `emit` takes: a `Result`, or a text that is handed out."""

    def with_provenance(self, provenance: Provenance) -> Self: ...

    def summary(self) -> str: ...


R = TypeVar("R", bound=Emitted)


def say(text: str, *, err: bool = False) -> None:
    """Print lines to stdout, or to stderr; what users named in them is shown as text and does nothing."""
    click.echo("\n".join(map(visible, text.split("\n"))), err=err)


def emit(
    result: R,
    outputs: Outputs,
    *,
    inputs: Iterable[str | Path | None] = (),
    seed: int | None = None,
    writers: Mapping[str, Callable[[R, Path], object]] | None = None,
    shown: Mapping[str, Callable[[R], Any]] | None = None,
    text: str | None = None,
    as_json: bool = False,
    warnings: Iterable[str] | None = None,
) -> R:
    """Write ``result`` to ``outputs``, print its text to stdout and its warnings to stderr, return it.

    The result that is written and returned carries its provenance: version, command line, hashes of those ``inputs``
    that are files, ``seed`` if numbers were drawn at random. ``--json``, ``--plot`` and ``--report`` are written from
    `Result.to_dict`, `Result.figure` and `Result.page`, or from what the option's function in ``shown`` makes of the
    result; ``--out`` by the result's own ``write_csv``. Any other option needs a function in ``writers``, which may
    also replace one of these four: it is called with the result and the path. ``text`` is printed in place of
    `Result.summary`; with ``as_json`` the plain data are. Where ``--json`` is ``-`` the plain data alone are on stdout,
    and the text on stderr. ``warnings`` are those shown, by default ``result.warnings``, if it has any; ``checks`` are
    printed last. Raises SolveError for a check that fails.
    """
    made = result.with_provenance(origin(inputs, seed))
    if any(path for option, path in outputs.items() if option not in ("--out", "--json", "--table")):
        from ..report.axes import load_plainly

        load_plainly()
    for option, path in outputs.items():
        if path is not None:
            with _look_of(option):
                _write(made, option, path, writers or {}, shown or {})
    if as_json and isinstance(made, Result):
        say(json.dumps(plain_data(made), indent=2))
    else:
        say(made.summary() if text is None else text, err=outputs.get("--json") == STDOUT)
    for line in getattr(made, "warnings", ()) if warnings is None else warnings:
        say(f"warning: {line}", err=True)
    if checks := getattr(made, "checks", ()):
        show_check(checks, err=outputs.get("--json") == STDOUT)
    return made


def _write(
    made: Any,
    option: str,
    path: Path,
    writers: Mapping[str, Callable[[Any, Path], object]],
    shown: Mapping[str, Callable[[Any], Any]],
) -> None:
    """Write what one option asks for: see `emit`."""
    if option in writers:
        writers[option](made, path)
        return
    assert isinstance(made, Result), f"{option} needs a writer"
    if option == "--out":
        made.write_csv(path)
    elif option == "--json" and path == STDOUT:
        say(json.dumps(plain_data(made), indent=2))
    elif option == "--json":
        write_json(path, plain_data(made))
    elif option == "--plot":
        from ..report.axes import save

        try:
            drawn = shown.get(option, Result.figure)(made)
        except InputError as error:  # the arguments were right, and the work is done
            raise SolveError(f"{option} {path} is not written: {error}") from error
        save(drawn, path, made.provenance)
    else:
        from ..report.page import write_page

        write_page(shown.get(option, Result.page)(made), path, made.provenance)


def _look_of(option: str) -> AbstractContextManager[None]:
    """Return the context in which an option's file is written: pictures are of the size and style asked for."""
    if option not in _PICTURES:
        return nullcontext()
    from ..report.look import look

    return look(picture_look(click.get_current_context()))


def origin(inputs: Iterable[str | Path | None] = (), seed: int | None = None) -> Provenance:
    """Return the provenance of the running command's result; ``inputs`` that are not files have no hash."""
    call = command_line(click.get_current_context().find_root().obj)
    return provenance(call, [path for path in inputs if path], seed)


def plain_data(result: Result) -> dict[str, Any]:
    """Return ``result`` as plain data, its provenance last."""
    return result.to_dict() | {"provenance": result.provenance.to_dict()}


def show_check(differences: Sequence[Difference], *, err: bool = False) -> None:
    """Print the ``differences`` from other solutions, to stderr with ``err``. Raises SolveError for a large one."""
    from ..report.check import summary
    from ..simulation.check import require_agreement

    say(summary(differences), err=err)
    require_agreement(differences)
