"""The two ways in which a call can fail; the command line turns them into exit codes 2 and 1."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches

#: No message is longer, whatever was given.
_LONGEST = 2000


class IlgError(Exception):
    """Base of every error that this package raises on purpose. The message is one line for the user."""

    exit_code = 1

    def __init__(self, message: str = "") -> None:
        super().__init__(one_line(message))


class InputError(IlgError, ValueError):
    """The input is wrong: the message says what was given, what is allowed and what to do."""

    exit_code = 2


class SolveError(IlgError, RuntimeError):
    """A circuit or a motion could not be solved, or not to the accuracy asked for."""


class MissingLibraryError(SolveError):
    """The ngspice shared library was not found; the input of the user cannot be used without it."""

    exit_code = 2


#: Argument -> how users write it, while a command runs.
_WRITTEN: ContextVar[Mapping[str, str] | None] = ContextVar("written", default=None)


class Argument(str):
    """The name of an argument as messages show it; ``name`` is what Python calls it."""

    name: str


def argument(name: str, value: object = None) -> Argument:
    """Return how users write an argument, with a ``value`` if any: as in Python, or as an option of a running command.

    >>> print(argument("model"), argument("model", "rc"))
    model model='rc'
    >>> with written({"model": "--model"}):
    ...     print(argument("model"), argument("model", "rc"))
    --model --model rc
    """
    option = (_WRITTEN.get() or {}).get(name)
    if value is None:
        found = Argument(option or name)
    else:
        found = Argument(f"{option} {value}" if option else f"{name}={value!r}")
    found.name = name
    return found


@contextmanager
def written(options: Mapping[str, str]) -> Iterator[None]:
    """Have `argument` show names as ``options`` does, while this context lasts."""
    token = _WRITTEN.set(options)
    try:
        yield
    finally:
        _WRITTEN.reset(token)


def unknown_name(kind: str, name: str, known: Iterable[str]) -> InputError:
    """Return the error for a name that is not ``known``: it lists the nearest names, or all."""
    names = list(known)
    near = get_close_matches(name, names, n=4)
    hint = f"perhaps {', '.join(near)}" if near else f"known are {', '.join(names) or 'none'}"
    return InputError(f"unknown {kind} '{name[:40]}'; {hint}")


def first_line(error: Exception) -> str:
    """Return the first line of what any exception says, or its type where it says nothing.

    >>> first_line(OSError("no such file\\nlooked in /usr/lib"))
    'no such file'
    >>> first_line(KeyError())
    'KeyError'
    """
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


def visible(text: str) -> str:
    """Return one line of text in which all that a terminal would act on, and not show, is written as its code.

    >>> print(visible(chr(27) + "[31mred"))
    \\x1b[31mred
    """
    if text.isprintable():
        return text
    # a name that is not UTF-8 has half a surrogate pair in place of each such byte
    codes = {c: f"\\x{ord(c) & 0xFF:02x}" if "\udc80" <= c <= "\udcff" else ascii(c)[1:-1] for c in set(text)}
    return "".join(c if c.isprintable() or unicodedata.category(c) == "Zs" else codes[c] for c in text)


def one_line(message: str) -> str:
    """Return a message as one line that a terminal shows, the middle of a very long one left out."""
    line = visible(" ".join(message.split()))
    half = _LONGEST // 2
    return line if len(line) <= _LONGEST else f"{line[:half]} ... {line[-half:]}"
