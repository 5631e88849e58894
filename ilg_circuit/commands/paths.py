"""What all commands have: a check of their paths, and a limit of time where they may take long.

`OutputFile` marks the files that a command writes; none of them may take the place of another one. `Command` checks
that before the work; a command need not know of it.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import IlgWarning, InputError, nearest, visible, written
from ..files import require_writable
from .help import HelpedCommand, group
from .stopping import start_limit

if TYPE_CHECKING:
    from ..report.look import Look

#: The name of a file that means stdout.
STDOUT = Path("-")


class InputFile(click.Path):
    """A file that is read, or a ``folder``."""

    def __init__(self, name: str = "file") -> None:
        super().__init__(path_type=Path)
        self.name = name  # which help shows


FILE, ANY_FOLDER = InputFile(), InputFile("folder")


class OutputFile(click.Path):
    """A file that is written, as ``what``: its name has one of ``suffixes``, or none if it may be ``bare``.

    ``-`` is stdout where it may be (``stdout``).
    """

    def __init__(self, what: str = "", *suffixes: str, bare: bool = True, stdout: bool = False) -> None:
        super().__init__(path_type=Path)
        self.name = "file"  # which help shows
        self.what, self.suffixes, self.bare, self.stdout = what, suffixes, bare, stdout

    def require(self, path: Path, option: str) -> None:
        """Raise InputError for a path that cannot be written, or whose suffix belongs to another kind of file."""
        if path == STDOUT:
            if self.stdout:
                return
            raise InputError(f"{option} does not write to stdout; give the name of a file (--json - does)")
        require_writable(path)
        suffix = path.suffix.lower()
        tells = re.fullmatch(r"\.[a-z]\w*", suffix)  # the end of run_0.5V is not a suffix
        if self.suffixes and suffix not in self.suffixes and (tells or not self.bare):
            *others, last = self.suffixes
            ends = f"{', '.join(others)} or {last}" if others else last
            raise InputError(f"cannot write '{path}': {option} writes {self.what}; end its name in {ends}")


class OutputFolder(OutputFile):
    """A folder that is written; what may be replaced is decided by the command."""

    def require(self, path: Path, option: str) -> None:
        """Raise InputError for what is not a folder, or cannot become one."""
        if path == STDOUT or (path.exists() and not path.is_dir()):
            raise InputError(f"{option} '{path}': give the name of a folder")


TABLE = OutputFile("CSV", ".csv", ".txt", ".dat")
STRIP = OutputFile("TOML", ".toml")
JSON = OutputFile("JSON", ".json", stdout=True)
PAGE = OutputFile("HTML", ".html", ".htm")
PICTURE = OutputFile("a picture", ".png", ".pdf", ".svg", bare=False)
DECK = OutputFile("a SPICE deck", ".cir", ".sp", ".spice", ".net")
MOTION = OutputFile("netCDF", ".nc", ".nc4", ".h5")
SWEEP = OutputFile("netCDF or CSV", ".nc", ".nc4", ".h5", ".csv")
PARAMETERS = OutputFile("a table of parameters", ".tex", ".csv", ".md", bare=False)
LOG = OutputFile("a log", ".log", ".txt")
FOLDER = OutputFolder("a folder")
FOLDER.name = "folder"
ANY = OutputFile()

_FORCE, _LOOK = "ilg_circuit.force", "ilg_circuit.look"


def forced(context: click.Context) -> bool:
    """Return True if --force was given."""
    return bool(context.meta.get(_FORCE))


def forcing(text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the option --force with the help ``text``; `forced` returns True if it was given."""
    return group(
        "Output",
        click.option(
            "--force",
            is_flag=True,
            expose_value=False,
            callback=lambda context, _option, given: context.meta.update({_FORCE: given}),
            help=text,
        ),
    )


#: For commands whose answer may be meant to replace the strip that they began with.
force_option = forcing("Let --out replace the file of the actuator.")


class _Choice(click.Choice[str]):
    """One of several words; the error for a misspelt one names the nearest."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        message = super().get_invalid_choice_message(value, ctx).rstrip(".")
        near = nearest(str(value), map(str, self.choices))
        return f"{message}; perhaps {', '.join(near)}." if near else f"{message}."


class Command(HelpedCommand):
    """A command whose paths are checked before it begins; its errors name options.

    Errors for misspelt choices name the nearest word.
    """

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        for option in self.params:
            if type(option.type) is click.Choice:
                option.type = _Choice(option.type.choices, option.type.case_sensitive)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command. Raises InputError for paths as `require_apart` and `OutputFile.require` do."""
        options = {option.name or "": _named(option) for option in self.params}
        with written({"strip": options.get("actuator", "ACTUATOR"), **options}), _warnings_in_lines():
            return self._invoke(ctx)

    def _invoke(self, ctx: click.Context) -> Any:
        outputs = list(_outputs(ctx))
        require_apart(ctx, outputs)
        for option, path in outputs:
            kind = option.type
            assert isinstance(kind, OutputFile)
            kind.require(path, option.opts[0])
        _take_look(ctx, outputs)
        return super().invoke(ctx)


@contextmanager
def _warnings_in_lines() -> Iterator[None]:
    """Show each `IlgWarning` once, as a line of stderr."""
    shown: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, IlgWarning):
            others(message, category, *place, **more)
        elif str(message) not in shown:
            shown.add(str(message))
            click.echo(f"warning: {visible(str(message))}", err=True)

    with warnings.catch_warnings():
        warnings.simplefilter("always", IlgWarning)
        others, warnings.showwarning = warnings.showwarning, show
        yield


def _take_look(context: click.Context, outputs: list[tuple[click.Parameter, Path]]) -> None:
    """Take ``--size`` and ``--style`` from the options; `picture_look` returns their values. Raises InputError."""
    size, style = (context.params.pop(name, None) for name in ("size", "style"))
    if size is None and style is None:
        return
    drawn = any(option.type is PICTURE or option.name == "animation" for option, _ in outputs)
    if not drawn and "folder" not in context.params:
        raise InputError("--size and --style are for pictures; give --plot with the name of one")
    from ..report.axes import load_plainly
    from ..report.look import chosen

    load_plainly()
    context.meta[_LOOK] = chosen(size, style, ("--size", "--style"))


def picture_look(context: click.Context) -> Look:
    """Return how large the pictures of a command are, and how they look."""
    from ..report.look import Look

    found: Look = context.meta.get(_LOOK, Look())
    return found


class LongCommand(Command):
    """A command that may take long: it has the option ``--time-limit``, whose time begins as it is read."""

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        text = "Stop after this time, such as 30s, with exit code 1."
        limit = click.Option(["--time-limit"], metavar="TIME", expose_value=False, callback=start_limit, help=text)
        self.params.append(limit)


def require_apart(context: click.Context, written: list[tuple[click.Parameter, Path]]) -> None:
    """Raise InputError where a file to be written is one that is read, or another one to be written.

    Files are compared by identity, not by name: through links, and in any spelling that the system accepts.
    The same measured file twice is refused, too.
    """
    read = [(option, path, _identity(path)) for option, path in _read(context) if os.path.isfile(path)]
    made = [(option, path, _identity(path)) for option, path in written]
    for (first, _, one), (second, path, other) in combinations([*read, *made], 2):
        twice = isinstance(first.type, click.Path) and isinstance(second.type, click.Path)
        if one != other or not (twice or isinstance(second.type, OutputFile)):
            continue
        replaceable = first.name == "actuator" and second.type is STRIP
        if (replaceable and forced(context)) or path == STDOUT:
            continue
        way = "give --force to replace it" if replaceable else "give each its own"
        raise InputError(f"{_named(first)} and {_named(second)} name the same file, '{visible(str(path))}'; {way}")


def _outputs(context: click.Context) -> Iterator[tuple[click.Parameter, Path]]:
    for option in context.command.params:
        path = context.params.get(option.name or "")
        if isinstance(option.type, OutputFile) and path is not None:
            yield option, path


def _read(context: click.Context) -> Iterator[tuple[click.Parameter, Path]]:
    """Yield all arguments of a command that may be names of files, with ``file:`` before them or not."""
    for option in context.command.params:
        if isinstance(option.type, OutputFile | click.Choice):
            continue
        given = context.params.get(option.name or "")
        values: Iterable[Any] = given if isinstance(given, tuple) else [given]
        for value in values:
            if isinstance(value, str | Path):
                yield option, Path(str(value).removeprefix("file:"))


def _named(option: click.Parameter) -> str:
    """Return what the help calls an option or an argument."""
    return option.opts[0] if isinstance(option, click.Option) else option.human_readable_name


def _identity(path: Path) -> tuple[int | str, ...]:
    """Return the identity of a file; for one that does not exist yet, its place."""
    try:
        there = os.stat(path)
        return there.st_dev, there.st_ino
    except (OSError, ValueError):
        pass
    try:
        path = path.resolve()
        folder = os.stat(path.parent)
    except (OSError, ValueError, RuntimeError):  # links in a circle, no such folder
        return (str(path),)
    return folder.st_dev, folder.st_ino, path.name.casefold()
