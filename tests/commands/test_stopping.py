"""Commands that are stopped: by Ctrl-C, by a signal to end, by their time limit, by a reader that has gone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from command import Run, assert_one_line

from ilg_circuit.commands import stopping
from ilg_circuit.commands.progress import ProgressBar
from ilg_circuit.commands.stopping import Stopped, stoppable
from ilg_circuit.files import replacing

LONG = ("simulate", "paper", "--drive", "square:-4V..4V,0.05s", "--duration", "300s", "--samples", "20001")

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="this platform has no such signals")


def send(number: int, after: float) -> None:
    timer = threading.Timer(after, lambda: os.kill(os.getpid(), number))
    timer.daemon = True
    timer.start()


@pytest.mark.parametrize(
    ("name", "code", "message"),
    [("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "terminated"), ("SIGHUP", 129, "terminal closed")],
)
def test_a_signal_ends_a_command_in_one_line(run: Run, name: str, code: int, message: str) -> None:
    number = getattr(signal, name)
    before = signal.getsignal(number)
    send(number, 0.7)
    began = time.monotonic()
    assert_one_line(run(*LONG, "--out", "run.csv", "--plot", "run.png"), message, code=code)
    assert time.monotonic() - began < 0.7 + 1.0
    assert list(Path().iterdir()) == []
    assert signal.getsignal(number) is before


def test_the_time_limit_ends_a_command(run: Run) -> None:
    began = time.monotonic()
    done = run(*LONG, "--out", "run.csv", "--time-limit", "0.5s")
    assert_one_line(done, "stopped by --time-limit after 0.5s; give it more time, or ask for less", code=1)
    assert time.monotonic() - began < 1.5
    assert list(Path().iterdir()) == []
    assert run("show", "paper").code == 0
    assert run("impedance", "paper", "--points", "3", "--time-limit", "60s").code == 0
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


@pytest.mark.parametrize("text", ["0s", "-1s", "nan s", "1e9s", "5", "5V", ""])
def test_a_time_limit_that_is_none(run: Run, text: str) -> None:
    assert_one_line(run("impedance", "paper", "--time-limit", text), "--time-limit")


def test_a_stop_that_is_swallowed_counts_all_the_same() -> None:
    def swallow() -> None:
        with stoppable(), suppress(BaseException):
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Stopped, match="interrupted"):
        swallow()


def test_a_stop_that_python_drops_is_raised_again(capsys: pytest.CaptureFixture[str]) -> None:
    """As in a destructor or in the callback of a weak reference, which loading a module has too."""

    class Dropping:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)

    def work() -> None:
        with stoppable():
            Dropping()
            time.sleep(30)

    began = time.monotonic()
    with pytest.raises(Stopped, match="interrupted"):
        work()
    assert time.monotonic() - began < 0.5
    assert capsys.readouterr().err == ""


def test_an_ignored_signal_stays_ignored() -> None:
    """As a shell has it for a command in the background."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with stoppable():
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_process_that_does_not_end_by_itself_is_ended(tmp_path: Path) -> None:
    """Also where the interrupt is lost in code that cannot pass it on; what is temporary is removed before."""
    code = """
    import signal, time
    from pathlib import Path
    from ilg_circuit.commands.stopping import stoppable
    from ilg_circuit.files import replacing

    with stoppable(), replacing(Path("a.csv")) as temporary:
        temporary.write_text("half")
        while True:
            try:
                signal.raise_signal(signal.SIGINT)
                time.sleep(60)
            except BaseException:
                pass
    """
    began = time.monotonic()
    program = "\n".join(line[4:] for line in code.splitlines())
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=30)
    assert time.monotonic() - began < 5
    assert_one_line(done, "interrupted", code=130)
    assert list(tmp_path.iterdir()) == []


def test_a_command_is_interrupted_while_it_loads(tmp_path: Path) -> None:
    program = subprocess.Popen(
        [sys.executable, "-m", "ilg_circuit", *LONG, "--out", "run.csv"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    time.sleep(0.35)
    program.send_signal(signal.SIGINT)
    out, err = program.communicate(timeout=30)
    assert (program.returncode, out) == (130, "")
    assert err == "ilg-circuit: interrupted\n"
    assert list(tmp_path.iterdir()) == []


def test_a_half_written_file_is_removed_where_it_is_interrupted(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("old")

    def write() -> None:
        with stoppable(), replacing(path) as temporary:
            temporary.write_text("half")
            signal.raise_signal(signal.SIGTERM)

    with pytest.raises(Stopped, match="terminated"):
        write()
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run ``ilg-circuit`` (I) in a shell; what its exit code was is printed last."""
    text = f"set -o pipefail; I() {{ '{sys.executable}' -m ilg_circuit \"$@\"; }}; {command}"
    return subprocess.run(["bash", "-c", text], cwd=folder, capture_output=True, text=True, timeout=60)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this platform has no full device")
@pytest.mark.parametrize(
    ("command", "code", "words"),
    [
        ("I show paper > /dev/full", 2, "No space left on device"),
        ("I show paper | true", 0, ""),
        ("I show --help | true", 0, ""),
        ("I show paper >&-", 0, ""),
        ("mkdir gone; cd gone; rmdir ../gone; I show paper", 2, "the working folder no longer exists"),
    ],
    ids=["full", "reader gone", "reader of the help gone", "closed", "folder gone"],
)
def test_output_that_goes_nowhere(tmp_path: Path, command: str, code: int, words: str) -> None:
    done = shell(command, tmp_path)
    assert done.returncode == code
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == bool(words)


@pytest.mark.parametrize(
    ("work", "after_5", "after_11"),
    [
        (lambda bar: bar(1.0, 8.0), "solving: about 35 s to go\n", ""),
        (lambda bar: bar(3.0, 4.0), "", "solving: about 4 s to go\n"),
        (lambda bar: bar(4.0, 4.0), "", ""),
        (lambda bar: bar.count(20), "", "solving: 60 runs in 11 s, and more to come\n"),
    ],
    ids=["long", "short", "done", "not known"],
)
def test_long_work_says_once_how_long(
    work: Callable[[ProgressBar], None],
    after_5: str,
    after_11: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    clock = 100.0
    monkeypatch.setattr("ilg_circuit.commands.progress.time.monotonic", lambda: clock)
    bar = ProgressBar("run")
    for later, words in ((0.0, ""), (5.0, after_5), (11.0, after_11), (20.0, "")):
        clock = 100.0 + later
        work(bar)
        assert capsys.readouterr().err == words


def test_the_stop_of_a_library_call_is_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """In Python and notebooks nobody's handlers are touched, whatever is imported."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)}
    import ilg_circuit.simulation.response
    import ilg_circuit.study.sweep  # noqa: F401

    assert {number: signal.getsignal(number) for number in before} == before
    assert stopping._PATIENCE < 1.0
