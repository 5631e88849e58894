"""The command `app`: what it refuses, in one line, and where it listens."""

from __future__ import annotations

import socket
from typing import Any

import pytest
from command import Run, assert_one_line

import ilg_circuit as ilg
from ilg_circuit import extras
from ilg_circuit.window import serve as serving

pytest.importorskip("panel", reason="the extra app is not installed")


def test_what_is_refused_is_one_line(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        refused = run("app", "--no-browser", "--port", port)
        assert_one_line(refused, f"--port {port} is in use here; give another one, or leave it out for a free one")
    assert_one_line(run("app", "--port", "80"), "--port is 80; give a number from 1024 to 65535")
    assert_one_line(run("app", "none.csv"), "there is no file 'none.csv'")
    assert_one_line(run("app", "none.toml"), "none.toml")
    find = extras.find_spec
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name == "panel" else find(name))
    assert_one_line(run("app"), "the window needs panel: install with pip install 'ilg-circuit[app]'")


def test_without_a_browser_the_address_is_said_and_served(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from ilg_circuit.window import window

    served: list[Any] = []

    def serve(files: Any, port: int, started: Any) -> None:
        served.append((files, port))
        started()

    monkeypatch.setattr(window, "serve", serve)
    monkeypatch.setattr(serving.webbrowser, "open", lambda _address: False)
    outcome = run("app", "paper")
    assert outcome.code == 0
    at, warning = outcome.err.splitlines()
    assert at == f"window at http://127.0.0.1:{served[0][1]}/; Ctrl-C ends it"
    assert warning.startswith("warning: no browser was found here; open http://127.0.0.1:")
    settings = serving.settings(served[0][1])
    assert settings["address"] == "127.0.0.1"
    assert all(origin.rpartition(":")[0] in ("127.0.0.1", "localhost") for origin in settings["websocket_origin"])
    with pytest.warns(ilg.IlgWarning, match="no browser"):
        ilg.app()


def test_a_taken_port_is_left_to_who_has_it() -> None:
    first = serving.free_port(None)
    with socket.socket() as taken:
        taken.bind((serving.ADDRESS, first))
        taken.listen()
        assert serving.free_port(None) != first
