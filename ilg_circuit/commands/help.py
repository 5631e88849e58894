"""Formats the help of every command: what it does, two examples, its options in named groups.

    @click.command(cls=Command, examples=("show paper", "show strip.toml --voltage 4V"))
    @group("Input", argument("actuator", STRIP_HELP))
    @group("Model", click.option("--voltage", metavar="VOLTAGE", help="Largest voltage."))
    def show(...): ...

An option that is in no group stands with ``--help`` under General. `tests/commands/test_cli_help.py` runs over all
commands.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any, TypeVar

import click

C = TypeVar("C", bound=Callable[..., Any])

#: The group of options that are in no other.
GENERAL = "General"


class Argument(click.Argument):
    """An argument with a line of help, as options have one."""

    def __init__(self, *declared: Any, text: str = "", **settings: Any) -> None:
        super().__init__(*declared, **settings)
        self.text = text

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:
        """Return the argument's name in the usage line and its help."""
        return self.make_metavar(ctx), self.text


def argument(name: str, text: str, **settings: Any) -> Callable[[C], C]:
    """Return a decorator that adds an argument with the help ``text``."""
    return click.argument(name, cls=Argument, text=text, **settings)


def group(title: str, *options: Callable[..., Any]) -> Callable[[C], C]:
    """Return a decorator that adds ``options``, in this order, to the group ``title`` of the help."""

    def decorate(command: C) -> C:
        before = len(getattr(command, "__click_params__", ()))
        decorated: C = reduce(lambda inner, option: option(inner), reversed(options), command)
        for added in getattr(decorated, "__click_params__", ())[before:]:
            vars(added).setdefault("group", title)
        return decorated

    return decorate


class HelpedCommand(click.Command):
    """A command whose help has examples and groups of options.

    Parameters
    ----------
    examples
        Command lines without the program's name.
    tables
        What stands below the options: rows of two columns by title.
    """

    def __init__(
        self,
        *arguments: Any,
        examples: tuple[str, ...] = (),
        tables: Mapping[str, Sequence[tuple[str, str]]] | None = None,
        **settings: Any,
    ) -> None:
        super().__init__(*arguments, **settings)
        self.examples, self.tables = examples, dict(tables or {})

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what the command does, then its examples; a long one goes on in the next line, as a shell allows."""
        super().format_help_text(ctx, formatter)
        if self.examples:
            with formatter.section("Examples"):
                for example in self.examples:
                    for line in _wrapped(f"ilg-circuit {example}", formatter.width - formatter.current_indent):
                        formatter.write(f"{'':{formatter.current_indent}}{line}\n")

    def format_arguments(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write nothing: arguments stand in their groups."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write arguments and options, one section a group, in the order in which the groups were named."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for option in self.get_params(ctx):
            record = option.get_help_record(ctx)
            if record is not None:
                groups.setdefault(getattr(option, "group", GENERAL), []).append(record)
        general = {GENERAL: groups.pop(GENERAL, [])}
        for title, records in (groups | general | self.tables).items():
            with formatter.section(title):
                formatter.write_dl(records, col_max=26)


def _wrapped(line: str, width: int) -> list[str]:
    """Return a command line as lines of at most ``width`` where options allow it."""
    lines = [""]
    for part in re.split(r" (?=--)", line):
        joined = f"{lines[-1]} {part}".lstrip() if len(lines) == 1 else f"{lines[-1]} {part}"
        if lines[-1] and len(joined) > width - 2:
            lines[-1] += " \\"
            lines.append(f"    {part}")
        else:
            lines[-1] = joined
    return lines
