"""The command line. Exit codes: 0 done, 2 the input is wrong, 1 the solve failed, 130 interrupted; errors: one line."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from io import TextIOWrapper
from typing import Any, NoReturn, cast

import click

from . import __version__
from .commands import COMMANDS
from .commands.emit import say
from .commands.stopping import Stopped, drop_output, stoppable
from .errors import IlgError, one_line


class _ReaderGone(BaseException):
    """The reader of what is printed has gone: nothing is wrong here, though click would say so by exit code 1."""


@contextmanager
def _while_read() -> Iterator[None]:
    try:
        yield
        if sys.stdout:
            sys.stdout.flush()
    except BrokenPipeError:
        raise _ReaderGone from None


class _Commands(click.Group):
    """The commands of the package `commands`, each imported when it is called; lists need its help only."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name, command, rest = super().resolve_command(ctx, args)
        if name is not None:
            command = getattr(import_module(f"{__package__}.commands.{name}"), name)
        return name, command, rest

    def make_context(self, *arguments: Any, **settings: Any) -> click.Context:
        with _while_read():
            return super().make_context(*arguments, **settings)

    def invoke(self, ctx: click.Context) -> Any:
        with _while_read():
            return super().invoke(ctx)


@click.group(
    cls=_Commands,
    commands=[click.Command(name, help=text) for name, text in COMMANDS.items()],
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100, "show_default": True},
)
@click.version_option(__version__, prog_name="ilg-circuit")
def cli() -> None:
    """Ionic-liquid-gel strips as circuits: simulate them, fit them to measurements, write netlists.

    ACTUATOR is a TOML file or a preset (paper). Quantities carry units: --drive step:4V --duration 300s.
    """


def main(arguments: list[str] | None = None) -> None:
    """Entry point: every failure that is ours ends in one line on stderr and the exit code."""
    with suppress(AttributeError):  # what stdout cannot encode is written as escapes, as on stderr
        cast(TextIOWrapper, sys.stdout).reconfigure(errors="backslashreplace")
    try:
        os.getcwd()
    except OSError:
        _fail("the working folder no longer exists; change to one that does", 2)
    try:
        with stoppable():
            status = cli.main(args=arguments, prog_name="ilg-circuit", standalone_mode=False, obj=arguments)
    except Stopped as stop:
        _fail(stop.message, stop.exit_code)
    except _ReaderGone:
        drop_output()
        sys.exit(0)
    except click.exceptions.NoArgsIsHelpError as error:  # called without a command: the help is the answer
        say(error.format_message())
        sys.exit(2)
    except click.ClickException as error:
        _fail(error.format_message(), 2)
    except click.Abort:
        _fail("interrupted", 130)
    except IlgError as error:
        _fail(str(error), error.exit_code)
    except OSError as error:
        drop_output()
        what = f"'{error.filename}'" if error.filename else "a file, or to print"
        _fail(f"cannot read or write {what}: {error.strerror or error}", 2)
    except MemoryError:
        _fail("not enough memory for this many samples; ask for fewer", 1)
    sys.exit(status if isinstance(status, int) else 0)


def _fail(message: str, status: int) -> NoReturn:
    with suppress(OSError):
        say(one_line(f"ilg-circuit: {message}"), err=True)
    sys.exit(status)
