"""Reads the pages: their blocks of code, the files that they are given, their links."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
README = ROOT / "README.md"
#: Pages that are written, not built.
PAGES = [README, *sorted(p for p in DOCS.rglob("*.md") if not {"_build", "gallery"} & set(p.parts))]

_BLOCK = re.compile(
    r"^```(?:\{code-block\} )?(?P<language>\w+)\n(?::caption: (?P<file>\S+)\n\n?)?(?P<code>.*?)^```$", re.M | re.S
)
_GIVEN = re.compile(r"^% given: (.*)$", re.MULTILINE)
_LINK = re.compile(r"(?<!`)!?\[[^\]\n]*(?:\n[^\]\n]*)?\]\(([^)\s]+)\)")
_FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_SPAN = re.compile(r"``.+?``|`[^`\n]+`")


@dataclass(frozen=True)
class Block:
    """A block of code: its language, its text, and the file that its caption names."""

    language: str
    code: str
    file: str = ""

    @property
    def lines(self) -> list[str]:
        """The commands of a shell's block, each on one line."""
        joined = self.code.replace("\\\n", " ")
        return [part.strip() for line in joined.splitlines() for part in line.split("&&") if part.strip()]


def name(page: Path) -> str:
    """A page's path below the root, for a test's name."""
    return page.relative_to(ROOT).as_posix()


def blocks(page: Path) -> list[Block]:
    """The blocks of code on a page."""
    text = page.read_text(encoding="utf-8")
    return [Block(m["language"], m["code"], m["file"] or "") for m in _BLOCK.finditer(text)]


def given(page: Path) -> list[str]:
    """The files that are there before a page's first command."""
    if page == README:
        return ["step.csv"]
    return [file for line in _GIVEN.findall(page.read_text(encoding="utf-8")) for file in line.split()]


def links(page: Path) -> list[str]:
    """Where a page's links and pictures lead to, code left out."""
    return _LINK.findall(_SPAN.sub("", _FENCE.sub("", page.read_text(encoding="utf-8"))))
