"""The command line. Exit codes: 0 done, 2 the input is wrong, 1 the solve failed; errors are one line."""

from __future__ import annotations

import sys
from importlib import import_module

import click

from . import __version__
from .commands import COMMANDS
from .commands.emit import say
from .errors import IlgError, one_line


class _Commands(click.Group):
    """The commands of the package `commands`, each imported when it is called; until then its help stands for it."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name, command, rest = super().resolve_command(ctx, args)
        if name is not None:
            command = getattr(import_module(f"{__package__}.commands.{name}"), name)
        return name, command, rest


@click.group(
    cls=_Commands,
    commands=[click.Command(name, help=text) for name, text in COMMANDS.items()],
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100, "show_default": True},
)
@click.version_option(__version__, prog_name="ilg-circuit")
def cli() -> None:
    """Ionic-liquid-gel strips as circuits: simulate them, fit them to measurements, hand out netlists.

    ACTUATOR is a TOML file or a preset (paper). Quantities carry units: --drive step:4V --duration 300s.
    """


def main(arguments: list[str] | None = None) -> None:
    """Entry point: every failure that is ours ends in one line on stderr and the exit code."""
    try:
        status = cli.main(args=arguments, prog_name="ilg-circuit", standalone_mode=False, obj=arguments)
    except click.exceptions.NoArgsIsHelpError as error:  # called without a command: the help is the answer
        say(error.format_message())
        sys.exit(2)
    except click.ClickException as error:
        _fail(error.format_message(), 2)
    except click.Abort:
        _fail("interrupted", 1)
    except IlgError as error:
        _fail(str(error), error.exit_code)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of a pipe has gone; nothing is wrong here
        sys.exit(0)
    except MemoryError:
        _fail("not enough memory for this many samples; ask for fewer", 1)
    sys.exit(status if isinstance(status, int) else 0)


def _fail(message: str, status: int) -> None:
    say(one_line(f"ilg-circuit: {message}"), err=True)
    sys.exit(status)
