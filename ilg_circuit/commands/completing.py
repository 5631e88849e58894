"""What a shell completes beside commands, options and their choices: strips, electrical models, examples."""

from __future__ import annotations

import click
from click.shell_completion import CompletionItem


def strips(_context: click.Context, _option: click.Parameter, begun: str) -> list[CompletionItem]:
    """Return the preset, and any file."""
    return [*_plain(["paper"], begun), CompletionItem(begun, type="file")]


def models(_context: click.Context, _option: click.Parameter, begun: str) -> list[CompletionItem]:
    """Return the names of electrical models."""
    from ..strip.models import model_names

    return _plain(["auto", *model_names()], begun)


def example_names(context: click.Context, _option: click.Parameter, begun: str) -> list[CompletionItem]:
    """Return the names of examples that are not given yet."""
    from ..front.examples import titles

    return _plain([name for name in titles() if name not in (context.params.get("names") or ())], begun)


def _plain(words: list[str], begun: str) -> list[CompletionItem]:
    return [CompletionItem(word) for word in words if word.startswith(begun)]
