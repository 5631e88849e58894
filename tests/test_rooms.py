"""The rooms of the package: who may import whom, how many modules stand at the top, how long a module may be."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import ilg_circuit

PACKAGE = Path(ilg_circuit.__file__).parent

#: From the ground up: a room imports rooms of lower floors only. Modules at the top level are the ground floor "".
FLOORS = (
    ("",),
    ("fit",),
    ("strip",),
    ("circuit",),
    ("solve", "measurements"),
    ("simulation",),
    ("identification",),
    ("control", "hyperelastic", "study"),
    ("oscillators",),
    ("arms",),
    ("report", "browser", "kits"),
    ("front",),
    ("reproduce",),
    ("window",),
    ("commands",),
)
LEVEL = {room: level for level, floor in enumerate(FLOORS) for room in floor}

#: Modules of the top level that stand above all rooms: the ways in.
ENTRIES = ("__init__", "__main__", "cli")
#: The base class of results reaches `report` when a result is shown: the one exception.
LAZY = {("result", "report")}


def modules() -> Iterator[tuple[str, Path]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        yield ".".join(path.relative_to(PACKAGE).with_suffix("").parts), path


def room_of(name: str) -> str:
    room, _, rest = name.partition(".")
    return room if rest else ""


def imports(name: str, path: Path) -> Iterator[tuple[str, int]]:
    """What a module imports of the package, as (module or package below `ilg_circuit`, line)."""
    package = name.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = package[: len(package) - node.level + 1]
            target = [*base, *(node.module.split(".") if node.module else [])]
            yield from ((".".join([*target, alias.name]), node.lineno) for alias in node.names)


def target_room(target: str) -> str:
    first = target.split(".")[0]
    return first if first in LEVEL else ""


@pytest.mark.parametrize(("name", "path"), list(modules()), ids=[name for name, _ in modules()])
def test_imports_go_down(name: str, path: Path) -> None:
    if name in ENTRIES:
        return
    here = room_of(name)
    for target, line in imports(name, path):
        room = target_room(target)
        if room != here and (name, room) not in LAZY:
            assert LEVEL[room] < LEVEL[here], f"{name}, line {line}: {here or 'the ground floor'} imports {target}"


def test_every_room_has_its_floor_and_its_first_page() -> None:
    rooms = {p.name for p in PACKAGE.iterdir() if p.is_dir() and (p / "__init__.py").exists()}
    assert rooms == set(LEVEL) - {""}
    for room in rooms:
        page = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text(encoding="utf-8"))) or ""
        assert all(word in page for word in ("In:", "Out:", "May import:")), room


def test_at_most_a_dozen_modules_at_the_top() -> None:
    assert len(list(PACKAGE.glob("*.py"))) <= 12


@pytest.mark.parametrize(("name", "path"), list(modules()), ids=[name for name, _ in modules()])
def test_no_module_over_400_lines(name: str, path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400
