"""Interrupting an import: compiled modules are loaded whole, and the interrupt comes after them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from ilg_circuit.extras import whole

#: A module as compiled ones are: an interrupt of its import becomes an ImportError.
COMPILED = """
import os, signal, time
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.05)
except BaseException:
    raise ImportError("multiarray failed to import") from None
"""
#: A fit whose import of pandas, by lmfit, is interrupted; then the same fit again.
FIT = """
import os, signal, sys
import numpy as np
import ilg_circuit as ilg

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "pandas._libs.tslibs":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder())
t = np.linspace(0, 60, 61)
fit = lambda: ilg.identify(time=t, voltage=t * 0 + 4, current=4 / 600 + 0.2 * np.exp(-t / 7), model="rc", onset=0.0)
try:
    fit()
except KeyboardInterrupt:
    print("interrupted", "lmfit" in sys.modules)
print(fit()["dc_resistance"].value)
"""

posix = pytest.mark.skipif(os.name == "nt", reason="there is no SIGINT to one process on Windows")


@posix
def test_a_module_is_loaded_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "seemingly_compiled.py").write_text(COMPILED)
    monkeypatch.syspath_prepend(tmp_path)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), whole():
            import seemingly_compiled  # type: ignore[import-not-found]  # noqa: F401
        assert "seemingly_compiled" in sys.modules
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        sys.modules.pop("seemingly_compiled", None)
        signal.signal(signal.SIGINT, before)


@posix
def test_handlers_of_others_stay() -> None:
    def mine(*_: object) -> None: ...

    before = signal.signal(signal.SIGINT, mine)
    try:
        with whole():
            assert signal.getsignal(signal.SIGINT) is mine
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_load_as_usual() -> None:
    entered: list[bool] = []

    def load() -> None:
        with whole():
            entered.append(True)

    thread = threading.Thread(target=load)
    thread.start()
    thread.join()
    assert entered == [True]


@posix
def test_a_fit_that_is_interrupted_while_it_loads_can_be_made_again() -> None:
    pytest.importorskip("pandas")
    done = subprocess.run([sys.executable, "-c", FIT], capture_output=True, text=True, timeout=60)
    said = done.stdout.split()
    assert said[:2] == ["interrupted", "True"], done.stderr
    assert float(said[2]) == pytest.approx(600, rel=0.01)
