"""The doctor tells versions and library, and fails where something is broken."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ilg_circuit import __version__
from ilg_circuit.commands import doctor
from ilg_circuit.errors import MissingLibraryError, SolveError
from ilg_circuit.simulation.response import simulate


def test_report() -> None:
    lines = list(doctor.examine())
    assert lines[0].startswith(f"ilg-circuit {__version__}, Python 3.")
    assert "numpy 2" in lines[1] or "numpy 1" in lines[1]
    assert "missing" not in lines[1]
    assert Path(lines[2].removeprefix("ngspice library: ")).name.startswith(("libngspice", "ngspice"))
    assert lines[3].removeprefix("ngspice version: ").isdigit()
    assert "EC (4)" in lines[4]


def test_without_ngspice_the_exact_engine_is_checked_and_the_last_line_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("ilg_circuit.solve.library.candidates", lambda: iter(()))
    monkeypatch.setattr("ilg_circuit.solve.library.install_command", lambda: "brew install libngspice")
    report = doctor.examine()
    lines = [next(report) for _ in range(4)]
    with pytest.raises(MissingLibraryError, match=r"nonlinear strips need ngspice; .* install it by: brew install lib"):
        next(report)
    assert lines[2] == "ngspice library: none; linear strips are solved by the exact engine"
    assert lines[3].startswith("self-check: 4 V step")


def test_a_wrong_answer_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(*arguments: object, **how: object):
        response = simulate(*arguments, **how)
        return response.with_waveforms(current=response.current * (1 + 1e-5))

    monkeypatch.setattr("ilg_circuit.simulation.response.simulate", wrong)
    with pytest.raises(SolveError, match="self-check failed"):
        list(doctor.examine())


def test_not_a_number_is_an_error_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(*arguments: object, **how: object):
        response = simulate(*arguments, **how)
        return response.with_waveforms(current=np.full_like(response.current, np.nan))

    monkeypatch.setattr("ilg_circuit.simulation.response.simulate", wrong)
    with pytest.raises(SolveError, match="self-check failed"):
        list(doctor.examine())


def test_missing_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "PACKAGES", ("no-such-package",))
    examine: Callable[[], object] = doctor.examine
    lines = examine()
    next(lines)
    assert next(lines) == "no-such-package missing"
