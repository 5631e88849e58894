"""The two ways in which a call can fail; the command line turns them into exit codes 2 and 1."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
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


class UnknownName(InputError):
    """A name that is not known; ``hint`` lists the nearest ones, or all."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(f"{message}; {hint}")
        self.hint = hint


def unknown_name(kind: str, name: str, known: Iterable[str], where: str = "") -> UnknownName:
    """Return the error for a name that is not ``known``: it lists the nearest names, or all.

    ``where`` stands before the name, such as "geometry." before a key.
    """
    names = list(known)
    near = nearest(name, names)
    hint = f"perhaps {', '.join(near)}" if near else f"known are {', '.join(names) or 'none'}"
    return UnknownName(f"unknown {kind} '{where}{name[:40]}'", hint)


def wrong_choice(what: str, value: object, allowed: Iterable[str]) -> InputError:
    """Return the error for ``what`` with a ``value`` that is not ``allowed``: it lists what is, the nearest at last.

    >>> print(wrong_choice("engine", "exat", ["ngspice", "exact"]))
    engine is 'exat'; choose one of ngspice, exact; perhaps exact
    """
    names = list(allowed)
    near = nearest(str(value), names)
    hint = f"; perhaps {', '.join(near)}" if near else ""
    return InputError(f"{what} is '{str(value)[:40]}'; choose one of {', '.join(names)}{hint}")


def nearest(name: str, names: Iterable[str]) -> list[str]:
    """Return the names that one may have been a slip for, the likeliest first."""
    return get_close_matches(name.lower(), list(names), n=4) if len(name) < 100 else []


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
