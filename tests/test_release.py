"""What is released: links that work on PyPI, extras, the papers to cite."""

from __future__ import annotations

import re
import runpy
import tomllib
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
    assert named == set(extras) - {"all", "bench", "dev", "peers"}
