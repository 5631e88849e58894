"""Text from users is text: in terminals, pictures and pages it does nothing, and the surroundings change nothing."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from command import Run, assert_one_line
from hypothesis import given
from hypothesis import strategies as st

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import one_line, visible
from ilg_circuit.report.axes import new_figure
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.file import dumps, loads

FAST = ("--drive", "step:4V", "--duration", "10s", "--samples", "5", "--engine", "exact")
NAMES = {
    "formula": "cost $\\foo$ {",
    "half a formula": "$x_{",
    "escapes": "\x1b]0;PWN\x07\x1b[31mred\x1b[2J\x9b1m\u202edetrever\nwarning: forged",
    "page": "</pre><script>document.title='PWN'</script><img src=x onerror=alert(1)>",
    "far letters": "\u65e5\u672c \N{PILE OF POO}",
    "template": "{{ 7*7 }} {% raw %} ${HOME} `id`",
}


def acting(text: str) -> list[str]:
    return [c for c in text if not c.isprintable() and c != "\n"]


@pytest.mark.usefixtures("drafts")
@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_name_is_drawn_and_printed_as_it_is_written(run: Run, name: str) -> None:
    Path("strip.toml").write_text(dumps(PAPER).replace('"paper"', _toml(name)), encoding="utf-8")
    done = run("simulate", "strip.toml", *FAST, "--plot", "plot.svg", "--report", "report.html")
    assert done.code == 0, done.err
    assert visible(name) in done.out
    assert not acting(done.out + done.err)
    assert all(line.startswith("warning: gravity") for line in done.err.splitlines())
    page = Path("report.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "<img src=x" not in page
    assert_one_line(run("simulate", name, *FAST), "no actuator")
    assert_one_line(run("simulate", "paper", *FAST, "--engine", name))


def _toml(text: str) -> str:
    return '"' + "".join(c if c.isalnum() and c.isascii() else f"\\U{ord(c):08X}" for c in text) + '"'


@pytest.mark.parametrize("name", ["a$\\foo$.csv", "b\x1b[2J\n$.csv"])
def test_a_files_name_and_titles_are_text(run: Run, name: str) -> None:
    t = np.arange(0.0, 5.0, 0.1)
    current = np.where(t < 1, 0.0, 0.006 + 0.2 * np.exp(-(t - 1) / 6.8))
    rows = "\n".join(f"{a:.3f},{4 if a >= 1 else 0},{b!r},1" for a, b in zip(t.tolist(), current.tolist(), strict=True))
    Path(name).write_text(f"time_s,voltage_V,current_A,$\\odd\x1b[2J\n{rows}\n", encoding="utf-8")
    done = run("identify", name, "--model", "rc", "--plot", "fit.png", "--report", "fit.html")
    assert done.code in (0, 1), done.err
    assert Path("fit.png").stat().st_size > 10_000
    assert visible(name) in done.out
    assert not acting(done.out + done.err)
    done = run("simulate", "paper", "--drive", f"file:{name}", *FAST[2:], "--plot", "run.png")
    assert done.code == 0, done.err
    Path(name).write_text("time_s,voltage_V,\x1b[2Jcurrent_A\n1,2,\x1b[2J\n", encoding="utf-8")
    assert_one_line(run("identify", name), "\\x1b[2J")


def test_figures_of_python_users_are_words_in_any_style() -> None:
    with mpl.rc_context({"text.usetex": True}):
        strip = replace(PAPER, name="100% & $\\foo$")
        figure = simulate(strip, PiecewiseLinear.step(4.0), np.linspace(0, 1, 3), engine="exact").figure()
        figure.draw_without_rendering()
    other, (panel,) = new_figure(1, [1.0])
    panel.set_xscale("log")
    panel.set_xlim(1e-3, 1.0)
    panel.set_yticks([0.5], ["$\\foo$"])
    other.draw_without_rendering()
    assert any(label.get_parse_math() for label in panel.get_xticklabels())  # powers of ten
    assert not any(label.get_parse_math() for label in panel.get_yticklabels())


@given(st.text(max_size=40))
def test_names_stay_what_they_were_shown_as(name: str) -> None:
    strip = Actuator(PAPER.geometry, PAPER.material, name=name)
    assert strip.name == visible(name) == visible(strip.name)
    assert loads(dumps(strip)) == strip
    assert not acting(one_line(name))


def test_what_is_too_long_is_cut(run: Run) -> None:
    assert_one_line(run("show", "x" * 100_000))
    assert len(one_line("x" * 100_000)) < 2100
    Path("long.toml").write_text(dumps(PAPER).replace("paper", "p" * 300))
    assert_one_line(run("show", "long.toml"), "200 characters")


def test_the_surroundings_change_nothing(tmp_path: Path) -> None:
    """Settings of matplotlib, ngspice, Python's streams and the linear algebra: the same files to the last bit."""
    odd = tmp_path / "odd"
    odd.mkdir()
    (odd / "matplotlibrc").write_text("text.usetex: True\nlines.linewidth: 9\nfont.size: 30\n")
    for start in ("spinit", ".spiceinit"):
        (odd / start).write_text(f"set trtol=1\noption reltol=0.1\nshell touch {odd / 'commanded'}\n")
    surroundings = {
        "MPLBACKEND": "bogus", "MPLCONFIGDIR": "/proc/none", "HOME": str(odd), "SPICE_SCRIPTS": str(odd),
        "SPICE_LIB_DIR": str(odd), "PYTHONIOENCODING": "ascii", "LC_ALL": "C", "OMP_NUM_THREADS": "2", "COLUMNS": "20",
    }  # fmt: skip
    plain = tmp_path / "plain"
    plain.mkdir()
    for folder, extra in ((plain, {}), (odd, surroundings)):
        code = "import sys; from ilg_circuit.cli import main; main(sys.argv[1:])"
        call = ("simulate", "paper", *FAST[:6], "--out", "run.csv", "--plot", "run.png", "--json", "run.json")
        done = subprocess.run(
            [sys.executable, "-c", code, *call], cwd=folder, env=os.environ | extra, capture_output=True, timeout=60
        )
        assert done.returncode == 0, done.stderr
        (folder / "out.txt").write_bytes(done.stdout + done.stderr)
    for name in ("run.csv", "run.png", "run.json", "out.txt"):
        assert (plain / name).read_bytes() == (odd / name).read_bytes(), name
    assert not (odd / "commanded").exists()


@pytest.mark.parametrize(("extra", "used"), [({}, {1}), ({"OPENBLAS_NUM_THREADS": "2"}, {2})])
def test_linear_algebra_has_one_thread_unless_the_surroundings_say_otherwise(
    extra: dict[str, str], used: set[int]
) -> None:
    """Threads that wait for each other take many times the processor time on a busy machine."""
    code = (
        "import sys\nfrom ilg_circuit.__main__ import run\n"
        "sys.argv[1:] = ['simulate', 'paper', '--drive', 'step:4V', '--duration', '1s']\n"
        "try:\n    run()\nexcept SystemExit:\n    pass\n"
        "from threadpoolctl import ThreadpoolController\n"
        "print({t.num_threads for t in ThreadpoolController().select(user_api='blas').lib_controllers})"
    )
    plain = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", code], env=plain | extra, capture_output=True, text=True, timeout=60)
    found = done.stdout.splitlines()[-1]
    assert found == str({min(n, os.cpu_count() or 1) for n in used}), done.stderr
