"""Serves the window to browsers of this machine, and to no other machine."""

from __future__ import annotations

import asyncio
import socket
import webbrowser
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError, argument, warn
from ..extras import require_app

#: The only address: other machines do not reach it.
ADDRESS = "127.0.0.1"
#: Ports that are tried where none was asked for.
_PORTS = range(5050, 5070)
#: Largest message from a browser [bytes]: a file of the largest size that is read, as base64.
_LARGEST = 420_000_000
#: A window that was closed is forgotten after this time, looked after as often [ms].
_FORGOTTEN, _LOOK = 5_000, 3_000


def app(
    *files: str | Path,
    port: int | None = None,
    browser: bool = True,
    ready: Callable[[str], object] | None = None,
) -> None:
    """Serve a window with sliders in which strips are fitted, moved, swept, designed and exported, until interrupted.

    It is for browsers of this machine only; nothing is fetched from any other. Every window, a tab of the browser, has
    its own strip, files and solver process.

    Parameters
    ----------
    *files : str or Path
        Files that a window begins with: measurements, and the TOML file of a strip or a preset's name.
    port : int, optional
        Port of this machine (default: a free one).
    browser : bool
        True to open the window in the browser.
    ready : callable, optional
        Function that is called with the address of the window once it is served (default: it is printed).

    Raises
    ------
    InputError
        A file is neither a measurement nor a strip, the port is in use, or a notebook calls this.
    MissingLibraryError
        Panel is not installed; it comes with the extra ``app``.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> ilg.app("paper", port=70000)
    Traceback (most recent call last):
    ...
    ilg_circuit.errors.InputError: port is 70000; give a number from 1024 to 65535, or leave it out for a free one
    """
    if port is not None and not 1024 <= port <= 65535:
        raise InputError(
            f"{argument('port')} is {port}; give a number from 1024 to 65535, or leave it out for a free one"
        )
    require_app()
    if _in_a_loop():
        raise InputError("a notebook cannot serve a window beside its cells; run ilg-circuit app in a terminal")
    require_openable(files)
    chosen = free_port(port)
    from .window import serve

    address = f"http://{ADDRESS}:{chosen}/"

    def started() -> None:
        (ready or _print)(address)
        if browser and not webbrowser.open(address):
            warn(f"no browser was found here; open {address} yourself, in one on this machine")

    serve(files, chosen, started)


def require_openable(files: Sequence[str | Path]) -> None:
    """Raise InputError for a file that no window can begin with."""
    from .session import Session

    session = Session()
    try:
        for path in files:
            session.open(path)
    finally:
        session.close()


def free_port(port: int | None) -> int:
    """Return ``port`` where it is free, else raise InputError; a free one of `_PORTS`, or any, for None."""
    for each in _PORTS if port is None else (port,):
        with socket.socket() as tried:
            try:
                tried.bind((ADDRESS, each))
            except OSError:
                continue
            return each
    if port is not None:
        raise InputError(f"{argument('port')} {port} is in use here; give another one, or leave it out for a free one")
    with socket.socket() as tried:
        tried.bind((ADDRESS, 0))
        return int(tried.getsockname()[1])


def _in_a_loop() -> bool:
    """Return True where an event loop runs already, as in a notebook."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def _print(address: str) -> None:
    print(f"{address}  (Ctrl-C ends it)")


def settings(port: int) -> dict[str, Any]:
    """Return the settings of the server."""
    return {
        "address": ADDRESS,
        "port": port,
        "websocket_origin": [f"{ADDRESS}:{port}", f"localhost:{port}"],
        "websocket_max_message_size": _LARGEST,
        "unused_session_lifetime_milliseconds": _FORGOTTEN,
        "check_unused_sessions_milliseconds": _LOOK,
    }
