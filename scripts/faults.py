"""The small faults that `mutants.py` makes in a module: one operator, comparison, constant or sign changed."""

from __future__ import annotations

import ast
import copy
import hashlib
import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

_SWAPPED: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult, ast.Mod: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.MatMult: ast.Sub, ast.And: ast.Or, ast.Or: ast.And, ast.Lt: ast.GtE, ast.LtE: ast.Gt,
    ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One fault: where it is, the line of ``code`` there and what ``change`` is made at it.

    It is known by its ``module`` (the path in the repository), the ``function`` with its classes, the change, and as
    which one in its function it is made (``nth``). ``tree`` is a hash of the function's code without the docstring, or
    of the statement of a fault outside of functions. ``site`` is its number in the module, to make it.
    """

    module: str
    function: str
    change: str
    nth: int
    tree: str
    site: int
    line: int
    code: str

    @property
    def key(self) -> tuple[str, str, str, int]:
        """What it is known by, whatever changes around it."""
        return self.module, self.function, self.change, self.nth

    def order(self, seed: int) -> str:
        """Return what mutants are drawn by, a number as good as random."""
        return _hash(seed, *self.key)


def _hash(*parts: object) -> str:
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]


def sites(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the nodes that can be mutated: none in annotations, messages or what only a type checker reads."""
    skipped = {id(part) for node in ast.walk(tree) for part in _unseen(node)}
    stack: list[ast.AST] = [tree]
    while stack:
        node = stack.pop()
        if id(node) in skipped:
            continue
        stack += reversed(list(ast.iter_child_nodes(node)))
        number = isinstance(node, ast.Constant) and isinstance(node.value, (int, float))
        negative = isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not))
        operated = isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign)) and type(node.op) in _SWAPPED
        compared = isinstance(node, ast.Compare) and type(node.ops[0]) in _SWAPPED
        if number or negative or operated or compared:
            yield node


def _unseen(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the children of a node in which no fault can be noticed."""
    if isinstance(node, (ast.FunctionDef, ast.AnnAssign, ast.arg)):
        for annotation in (getattr(node, "annotation", None), getattr(node, "returns", None)):
            if annotation is not None:
                yield annotation
    if isinstance(node, ast.Raise) or (isinstance(node, ast.keyword) and node.arg == "strict"):
        yield node
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        yield from node.decorator_list
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
        yield node
    if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and _is_type(node.value):
        yield node.value


def _is_type(value: ast.AST) -> bool:
    """Tell whether a value is a type under another name, such as ``Run = Callable[...]``."""
    return isinstance(value, ast.Subscript) and isinstance(value.value, ast.Name) and value.value.id[:1].isupper()


def mutate(node: ast.AST) -> ast.AST:
    """Return the node with its fault."""
    if isinstance(node, ast.Constant):
        value = node.value
        assert isinstance(value, (bool, int, float))
        changed = not value if isinstance(value, bool) else value + 1 if isinstance(value, int) else 2 * value or 1.0
        return ast.copy_location(ast.Constant(changed), node)
    if isinstance(node, ast.UnaryOp):
        return node.operand
    if isinstance(node, ast.Compare):
        node.ops[:1] = [_SWAPPED[type(node.ops[0])]()]  # type: ignore[list-item]
    else:
        assert isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign))
        node.op = _SWAPPED[type(node.op)]()  # type: ignore[assignment]
    return node


class _Change(ast.NodeTransformer):
    def __init__(self, target: ast.AST) -> None:
        self.target = target

    def visit(self, node: ast.AST) -> ast.AST:
        return mutate(node) if node is self.target else self.generic_visit(node)


def mutated(source: str, site: int) -> str:
    """Return the source with the fault at the ``site``, its number."""
    tree = ast.parse(source)
    node = list(sites(tree))[site]
    return ast.unparse(ast.fix_missing_locations(_Change(node).visit(tree)))


def mutants_of(module: str, source: str) -> list[Mutant]:
    """Return every fault that can be made in the source of a module."""
    tree = ast.parse(source)
    around = dict(_places(tree, "", None))
    counted: Counter[tuple[str, str]] = Counter()
    found = []
    for site, node in enumerate(sites(tree)):
        function, code = around[node]
        change = f"{ast.unparse(node)} -> {ast.unparse(mutate(copy.deepcopy(node)))}"
        line = getattr(node, "lineno", 0)
        nth = counted[function, change]
        counted[function, change] += 1
        shown = source.splitlines()[line - 1].strip()
        found.append(Mutant(module, function, change, nth, _hash(code), site, line, shown))
    return found


def _places(node: ast.AST, name: str, code: str | None) -> Iterator[tuple[ast.AST, tuple[str, str]]]:
    """Yield each node below one with the innermost function around it, and the code of that function or statement."""
    for child in ast.iter_child_nodes(node):
        inner, text = name, code
        if isinstance(child, ast.FunctionDef):
            plain = copy.deepcopy(child)
            plain.body = plain.body[ast.get_docstring(plain) is not None :]
            inner, text = f"{name}.{child.name}".lstrip("."), ast.unparse(plain)
        elif isinstance(child, ast.ClassDef):
            inner = f"{name}.{child.name}".lstrip(".")
        elif isinstance(child, ast.stmt) and code is None:
            text = ast.unparse(child)
        yield child, (inner, text or "")
        yield from _places(child, inner, text)
