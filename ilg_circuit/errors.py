"""The two ways in which a call can fail; the command line turns them into exit codes 2 and 1."""

from __future__ import annotations

import os
import re
import shlex
import sys
import unicodedata
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches
from functools import lru_cache, wraps
from inspect import Parameter, signature
from numbers import Integral, Real
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

#: Longest message [characters].
_LONGEST = 2000


class IlgError(Exception):
    """Base of every error that this package raises on purpose. The message is one line for the user."""

    exit_code = 1

    def __init__(self, message: str = "") -> None:
        super().__init__(one_line(message))


class IlgWarning(UserWarning):
    """A value is allowed and unlikely. Python shows it as a warning, a command as a line of stderr."""


class InputError(IlgError, ValueError):
    """The error for wrong input; its message says what was given, what is allowed and what to do."""

    exit_code = 2


class SolveError(IlgError, RuntimeError):
    """A circuit or a motion could not be solved, or not to the accuracy asked for."""


class NotDetermined(SolveError):
    """Data do not determine all parameters of a fit; ``labels`` are those of which that is known."""

    def __init__(self, message: str, labels: Sequence[str]) -> None:
        super().__init__(message)
        self.labels = tuple(labels)


class StoppedEarlyError(SolveError):
    """ngspice ended a transient before its last time."""


class MissingLibraryError(SolveError):
    """The ngspice shared library was not found; the input of the user cannot be used without it."""

    exit_code = 2


class UnknownName(InputError):
    """A name that is not known; ``hint`` lists the nearest ones, or all."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(f"{message}; {hint}")
        self.hint = hint


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
        found = Argument(f"{option} {_in_shell(str(value))}" if option else f"{name}={value!r}")
    found.name = name
    return found


def _in_shell(text: str) -> str:
    """Return a value as a shell takes it: in quotes where a character has a meaning there."""
    return shlex.quote(text) if re.search(r"[\s<>|&;()$`*?\"'\\#]", text) else text


def spelling() -> Mapping[str, str]:
    """Return how `argument` shows names now, for `written` in another process."""
    return _WRITTEN.get() or {}


@contextmanager
def written(options: Mapping[str, str]) -> Iterator[None]:
    """Have `argument` show names as ``options`` does, while this context lasts."""
    token = _WRITTEN.set(options)
    try:
        yield
    finally:
        _WRITTEN.reset(token)


def warn(message: str) -> None:
    """Issue an `IlgWarning` that points to the line outside this package from which the call came."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "ilg_circuit":
        level, frame = level + 1, frame.f_back
    warnings.warn(one_line(message), IlgWarning, stacklevel=level)


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
    """Return the first line of an exception's message, or its type if the message is empty.

    >>> first_line(OSError("no such file\\nlooked in /usr/lib"))
    'no such file'
    >>> first_line(KeyError())
    'KeyError'
    """
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


def visible(text: str) -> str:
    """Return one line of text in which every control character is written as its code.

    >>> print(visible(chr(27) + "[31mred"))
    \\x1b[31mred
    """
    if text.isprintable():
        return text
    # a name that is not UTF-8 has half a surrogate pair in place of each such byte
    codes = {c: f"\\x{ord(c) & 0xFF:02x}" if "\udc80" <= c <= "\udcff" else ascii(c)[1:-1] for c in set(text)}
    return "".join(c if c.isprintable() or unicodedata.category(c) == "Zs" else codes[c] for c in text)


def one_line(message: str) -> str:
    """Return a message as one printable line; the middle of a very long message is left out."""
    line = visible(" ".join(message.split()))
    half = _LONGEST // 2
    return line if len(line) <= _LONGEST else f"{line[:half]} ... {line[-half:]}"


def _is_texts(value: object) -> bool:
    parts = value if isinstance(value, list | tuple) else ()
    return isinstance(value, Iterable) and all(isinstance(part, str) for part in parts)


#: Part of an annotation -> a function that recognises its values, and its name in messages.
_KINDS: dict[str, tuple[Callable[[object], bool], str]] = {
    "int": (lambda value: isinstance(value, Integral) and not isinstance(value, bool), "a whole number"),
    "float": (lambda value: isinstance(value, Real) and not isinstance(value, bool), "a number"),
    "bool": (lambda value: value is True or value is False or type(value).__name__ == "bool", "True or False"),
    "str": (lambda value: isinstance(value, str), "a text"),
    "Path": (lambda value: isinstance(value, os.PathLike), "a path"),
    "None": (lambda value: value is None, "None"),
    "Iterable[str]": (_is_texts, "texts"),
    "Sequence[str]": (_is_texts, "texts"),
    "Mapping[str, str]": (lambda value: isinstance(value, Mapping), "a mapping"),
    "Mapping[str, float]": (lambda value: isinstance(value, Mapping), "a mapping"),
    "Mapping[str, str | float]": (lambda value: isinstance(value, Mapping), "a mapping"),
    "Callable[..., Any]": (callable, "a function"),
}


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that raises InputError, in one line, for arguments of a wrong type or an unknown name.

    Arguments whose annotation consists of parts in `_KINDS` are checked; the function itself reads all others.
    """

    @wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> R:
        known = _parameters(function)
        if not any(parameter.kind is Parameter.VAR_KEYWORD for parameter in known.values()):
            for name in named:
                if name not in known:
                    raise unknown_name(f"argument of {function.__name__}", name, known)
        places = [name for name, p in known.items() if p.kind is Parameter.POSITIONAL_OR_KEYWORD]
        values = dict(zip(places, given, strict=False)) if Parameter.VAR_POSITIONAL not in _sorts(known) else {}
        if len(given) > len(places) and Parameter.VAR_POSITIONAL not in _sorts(known):
            raise InputError(
                f"{function.__name__} takes {len(places)} arguments by their place, and {len(given)} are given; name "
                "the others"
            )
        for name in values.keys() & named.keys():
            raise InputError(f"{argument(name)} is given twice, by its place and by its name; leave one out")
        missing = [
            name
            for name, p in known.items()
            if p.default is Parameter.empty and name in places and name not in values and name not in named
        ]
        if missing:
            raise InputError(f"{argument(missing[0])} is missing; {function.__name__} needs it")
        for name, value in (values | named).items():
            parts = _parts(str(known[name].annotation)) if name in known else ()
            if parts and not any(_KINDS[part][0](value) for part in parts):
                kinds = [_KINDS[part][1] for part in parts if part != "None"]
                wanted = " or ".join(dict.fromkeys(kinds))
                shown = " ".join(repr(value).split())[:40]
                raise InputError(f"{argument(name)} is {type(value).__name__} {shown}; give {wanted}")
        return function(*given, **named)

    return call


@lru_cache(maxsize=64)
def _parameters(function: Callable[..., object]) -> Mapping[str, Parameter]:
    return signature(function).parameters


def _sorts(known: Mapping[str, Parameter]) -> set[object]:
    return {parameter.kind for parameter in known.values()}


@lru_cache(maxsize=256)
def _parts(annotation: str) -> tuple[str, ...]:
    """Return the parts of an annotation such as ``float | None``, an empty tuple if one of them is unknown."""
    found, depth, part = [], 0, ""
    for letter in f"{annotation}|":
        depth += (letter == "[") - (letter == "]")
        if letter == "|" and not depth:
            found.append(part.strip())
            part = ""
        else:
            part += letter
    return tuple(found) if all(part in _KINDS for part in found) else ()
