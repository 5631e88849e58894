"""What is released: links that work on PyPI, extras, the papers to cite."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
import tomllib
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
absolute = runpy.run_path(str(ROOT / "scripts" / "pypi_readme.py"))["absolute"]


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        ("[a](docs/x.md#y)", "[a](R:/blob/v1/docs/x.md#y)"),
        ("![a](./docs/x.svg)", "![a](R:/raw/v1/docs/x.svg)"),
        ('![a](x.PNG "title")', '![a](R:/raw/v1/x.PNG "title")'),
        ("[![a](b.gif)](docs/b.md)", "[![a](R:/raw/v1/b.gif)](R:/blob/v1/docs/b.md)"),
        ("[`code`](a.py)", "[`code`](R:/blob/v1/a.py)"),
        ('<img src="docs/z.gif" width=3>', '<img src="R:/raw/v1/docs/z.gif" width=3>'),
        ("[name]: docs/r.md", "[name]: R:/blob/v1/docs/r.md"),
        *(
            (same, same)
            for same in ("[a](https://x.y)", "[a](#here)", "[a](mailto:a@b)", "`[a](b)`", "```\n[a](b)\n```")
        ),
    ],
)
def test_links_are_absolute_on_pypi(written: str, shown: str) -> None:
    assert absolute(f"{written}\n", "R:", "v1") == f"{shown}\n"


def test_no_link_of_the_readme_is_relative_on_pypi() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    prose = re.sub(r"```.*?```|`[^`\n]*`", "", absolute(text, "https://r.invalid", "v1"), flags=re.DOTALL)
    targets = re.findall(r"\]\(([^)\s]+)\)|(?:src|href)=\"([^\"]+)\"", prose)
    assert len(targets) > 10
    for target in (a or b for a, b in targets):
        assert re.match(r"https?://|#|mailto:", target), target


def test_the_extra_all_has_whatever_a_user_may_want() -> None:
    extras = PROJECT["optional-dependencies"]
    (everything,) = extras["all"]
    named = set(re.fullmatch(r"ilg-circuit\[(.*)\]", everything)[1].split(","))
    assert named == set(extras) - {"all", "bench", "dev", "docs", "peers"}


def test_constraints_are_those_of_the_requirements_and_every_version_has_hashes() -> None:
    check = [sys.executable, str(ROOT / "scripts" / "make_constraints.py"), "--check"]
    done = subprocess.run(check, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "")
    for path in (ROOT / "constraints").glob("*.txt"):
        entries = re.split(r"\n(?=\S)", re.sub(r"^#.*\n", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE))
        assert all(re.match(r"[\w.\[\]-]+==\S+.*\\\n +--hash=sha256:\w{64}", entry) for entry in entries)
        named = {re.match(r"[\w.-]+", entry)[0].lower() for entry in entries}
        needed = {re.match(r"[\w.-]+", text)[0].lower() for text in PROJECT["dependencies"]}
        assert needed | {"hatchling", "editables"} <= named


def test_where_pinned_versions_cannot_be_had_the_newest_are_installed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    install = runpy.run_path(str(ROOT / "scripts" / "install.py"))
    steps: list[list[str]] = []

    def pip(command: list[str], **how: object) -> subprocess.CompletedProcess[str]:
        steps.append(command[command.index("install") + 1 :])
        hashed = "--require-hashes" in command
        said = "WARNING: slow\nERROR: Could not find a version\nERROR: No matching distribution found for numpy==9"
        return subprocess.CompletedProcess(command, failing and hashed, "", said if hashed else "")

    monkeypatch.setattr(subprocess, "run", pip)
    failing = False
    assert install["main"](["dev.txt"]) == 0
    assert [step[0] for step in steps] == ["--require-hashes", "--no-deps"]
    assert capsys.readouterr().out == ""
    failing = True
    assert install["main"](["dev.txt"]) == 0
    pinned = ["--require-hashes", "-r", str(ROOT / "constraints" / "dev.txt"), "--no-compile"]
    assert steps[2:] == [pinned, ["--no-compile", "-e", ".[dev]"]]
    (line,) = capsys.readouterr().out.splitlines()
    assert line == (
        "Not the versions of constraints/dev.txt (No matching distribution found for numpy==9): "
        "the newest that fit are installed"
    )


def test_a_wheel_carries_the_library_with_licences_and_says_which_glibc_it_needs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Debian's packages as they are laid out; libgomp1's documents are those of gcc-12-base."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    debian = import_module("debian_packages")
    asked: list[str] = []

    def run(*command: str, check: bool = True, cwd: Path | None = None) -> str:
        if "download" in command:
            asked.extend(names := command[command.index("download") + 1 :])
            for name in names:
                (cwd / f"{name}_1_amd64.deb").write_text(name)
        if "-x" in command:
            name, root = Path(command[2]).read_text(), Path(command[3])
            docs, libraries = root / "usr/share/doc", root / "usr/lib/x86_64-linux-gnu"
            for folder in (docs, libraries):
                folder.mkdir(parents=True, exist_ok=True)
            if name == "libgomp1":
                (libraries / "libgomp.so.1").write_bytes(b"\0GLIBC_2.9\0GLIBC_2.17\0")
                with suppress(FileExistsError):
                    (docs / name).symlink_to("gcc-12-base")
                return ""
            if name == "libngspice0":
                (libraries / "libngspice.so.0").write_bytes(b"\0GLIBC_2.2.5\0GLIBC_2.35\0")
            (docs / name).mkdir(exist_ok=True)
            (docs / name / "copyright").write_text(f"{name}: see /usr/share/common-licenses/GPL-3.")
        return "libngspice0\n39.3\nngspice 39.3" if "--show" in command else ""

    monkeypatch.setattr(debian, "run", run)
    assert debian.carry(tmp_path / "carried") == (2, 35)
    assert asked == ["libngspice0", "libgomp1", "gcc-12-base"]
    names = {path.name for path in (tmp_path / "carried").iterdir()}
    libraries, licences = {"libngspice.so.0", "libgomp.so.1"}, {"libngspice0.copyright.txt", "libgomp1.copyright.txt"}
    assert libraries | licences | {"made_from.txt"} <= names
    assert (tmp_path / "carried" / "libgomp1.copyright.txt").read_text().startswith("gcc-12-base: ")
    assert "libngspice0 39.3 (source ngspice 39.3), sha256 " in (tmp_path / "carried" / "made_from.txt").read_text()
