"""Make every small wrong change of a source file, one at a time.

Left alone: docstrings, annotations, decorators, imports, the texts inside f-strings, and
`zip(..., strict=True)`, which no right program can tell from its opposite.
"""

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_COMPARE: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.MatMult: ast.Add,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
}
_SWAPPED = {
    "min": "max", "max": "min", "any": "all", "all": "any", "argmin": "argmax",
    "argmax": "argmin", "minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin",
    "floor": "ceil", "ceil": "floor",
}  # fmt: skip
_LOGIC: dict[type[ast.boolop], type[ast.boolop]] = {ast.And: ast.Or, ast.Or: ast.And}
_JUDGES_ITSELF = (ast.Compare, ast.BoolOp, ast.UnaryOp, ast.Constant)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """Describe one change.

    `function` is empty where exchanging a function's code would not do: outside of every function,
    and within one that another one has already made.
    """

    name: str
    module: str
    path: Path
    function: str
    first_line: int
    last_line: int
    original: ast.Module
    node: ast.AST
    changed: ast.AST

    @property
    def tree(self) -> ast.Module:
        """Return the whole file with the change."""
        return _replaced(self.original, self.node, self.changed)


def mutants_of(path: Path, module: str) -> list[Mutant]:
    """Return every mutant of one file, in order."""
    tree = ast.parse(path.read_text(), str(path))
    found: list[Mutant] = []
    counts: dict[str, int] = {}
    for site in _sites(tree):
        for changed in _changes(site.node):
            name = f"{module.rpartition('.')[2]}.{site.scope}: {_text(site.node)} -> "
            name += _text(changed)
            counts[name] = counts.get(name, 0) + 1
            if counts[name] > 1:
                name += f" #{counts[name]}"
            found.append(
                Mutant(
                    name=name,
                    module=module,
                    path=path,
                    function=site.function if site.function == site.scope else "",
                    first_line=site.statement.lineno,
                    last_line=site.statement.end_lineno or site.statement.lineno,
                    original=tree,
                    node=site.node,
                    changed=changed,
                )
            )
    return found


@dataclass(frozen=True, slots=True)
class _Site:
    """Place one node: its innermost statement, its outermost function, its scope for the name."""

    node: ast.AST
    statement: ast.stmt
    function: str
    scope: str


def _sites(tree: ast.Module) -> Iterator[_Site]:
    for statement in _without_docstring(tree.body):
        yield from _walk(statement, statement, "", "")


def _walk(node: ast.AST, statement: ast.stmt, function: str, scope: str) -> Iterator[_Site]:
    if isinstance(node, ast.stmt):
        statement = node
    yield _Site(node, statement, function, scope or "module")
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        inner = f"{scope}.{node.name}" if scope else node.name
        is_function = isinstance(node, ast.FunctionDef)
        if isinstance(node, ast.FunctionDef):
            for default in (*node.args.defaults, *node.args.kw_defaults):
                if default is not None:
                    yield from _walk(default, statement, function, inner)
        for inside in _without_docstring(node.body):
            yield from _walk(inside, inside, function or (inner if is_function else ""), inner)
        return
    for child in _children(node):
        yield from _walk(child, statement, function, scope)


def _children(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(node, ast.Import | ast.ImportFrom | ast.JoinedStr):
        if isinstance(node, ast.JoinedStr):
            yield from (part.value for part in node.values if isinstance(part, ast.FormattedValue))
        return
    for name, value in ast.iter_fields(node):
        if name == "annotation" or _is_type_alias(node) or _is_strictness(node):
            continue
        values = value if isinstance(value, list) else [value]
        yield from (one for one in values if isinstance(one, ast.AST))


def _is_type_alias(node: ast.AST) -> bool:
    """Tell `Floats = NDArray[...]` and the like: nothing of it is ever computed with."""
    return isinstance(node, ast.Assign) and isinstance(node.value, ast.Subscript)


def _is_strictness(node: ast.AST) -> bool:
    return isinstance(node, ast.keyword) and node.arg == "strict"


def _without_docstring(body: list[ast.stmt]) -> list[ast.stmt]:
    return [
        statement
        for statement in body
        if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant))
    ]


def _changes(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.Compare():
            yield from _compared(node)
        case ast.BinOp() | ast.AugAssign() if type(node.op) in _ARITHMETIC:
            yield _with(node, op=_ARITHMETIC[type(node.op)]())
        case ast.BoolOp():
            yield _with(node, op=_LOGIC[type(node.op)]())
            if len(node.values) > 2:
                yield from (
                    _with(node, values=node.values[:at] + node.values[at + 1 :])
                    for at in range(len(node.values))
                )
        case ast.UnaryOp():
            yield node.operand
        case ast.Constant():
            yield from _constants(node)
        case ast.Name() if node.id in _SWAPPED and isinstance(node.ctx, ast.Load):
            yield _with(node, id=_SWAPPED[node.id])
        case ast.Attribute() if node.attr in _SWAPPED:
            yield _with(node, attr=_SWAPPED[node.attr])
        case ast.Return() if node.value is not None and not _is_none(node.value):
            yield ast.Return(value=ast.Constant(value=None))
        case ast.Expr() if isinstance(node.value, ast.Call):
            yield ast.Pass()
        case ast.If() | ast.IfExp() | ast.While() if not isinstance(node.test, _JUDGES_ITSELF):
            yield _with(node, test=_not(node.test))
        case ast.comprehension():
            for at, test in enumerate(node.ifs):
                if not isinstance(test, _JUDGES_ITSELF):
                    ifs = [*node.ifs]
                    ifs[at] = _not(test)
                    yield _with(node, ifs=ifs)
        case ast.Break():
            yield ast.Continue()
        case ast.Continue():
            yield ast.Break()


def _compared(node: ast.Compare) -> Iterator[ast.AST]:
    for at, operator in enumerate(node.ops):
        for other in _COMPARE[type(operator)]:
            yield _with(node, ops=[*node.ops[:at], other(), *node.ops[at + 1 :]])


def _constants(node: ast.Constant) -> Iterator[ast.AST]:
    value = node.value
    if isinstance(value, bool):
        yield ast.Constant(value=not value)
    elif isinstance(value, int | float):
        yield ast.Constant(value=value + 1)
    elif isinstance(value, str):
        yield ast.Constant(value=f"X{value}")


def _is_none(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def _not(test: ast.expr) -> ast.expr:
    return ast.UnaryOp(op=ast.Not(), operand=test)


def _with(node: ast.AST, **fields: object) -> ast.AST:
    changed = copy.copy(node)
    for name, value in fields.items():
        setattr(changed, name, value)
    return changed


def _text(node: ast.AST) -> str:
    if isinstance(node, ast.If | ast.While):
        return f"if {ast.unparse(node.test)}"
    text = " ".join(ast.unparse(node).split())
    return text if len(text) <= 160 else f"{text[:157]}..."


class _Replace(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self._old = old
        self._new = new

    def visit(self, node: ast.AST) -> ast.AST:
        if node is self._old:
            return ast.copy_location(self._new, node)
        copied = copy.copy(node)  # the original tree serves every mutant
        for name, value in ast.iter_fields(node):
            if isinstance(value, ast.AST):
                setattr(copied, name, self.visit(value))
            elif isinstance(value, list):
                changed = [self.visit(one) if isinstance(one, ast.AST) else one for one in value]
                setattr(copied, name, changed)
        return copied


def _replaced(tree: ast.Module, old: ast.AST, new: ast.AST) -> ast.Module:
    changed = _Replace(old, copy.copy(new)).visit(tree)
    assert isinstance(changed, ast.Module)
    return ast.fix_missing_locations(changed)
