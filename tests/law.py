"""The law of bit-identical code, read off the syntax tree: every call whose result depends on the machine, by name.

What is allowed is what IEEE 754 fixes to the bit: + − * / sqrt rint floor, integers, cumulative sums, stable sorts.
"""

import ast
from collections.abc import Iterator
from dataclasses import dataclass


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


TRANSCENDENTAL = _words(
    "sin cos tan arcsin arccos arctan arctan2 asin acos atan atan2 sinh cosh tanh arcsinh arccosh arctanh asinh acosh "
    "atanh exp exp2 expm1 log log2 log10 log1p logaddexp logaddexp2 hypot power pow float_power cbrt sinc i0 erf erfc "
    "gamma lgamma fsum dist sumprod fma angle unwrap"
)
BLAS = _words("dot vdot inner matmul vecdot matvec vecmat tensordot einsum einsum_path kron convolve correlate")
MODULES = _words("linalg fft random polynomial lib")
REDUCTIONS = _words(
    "sum nansum mean nanmean std nanstd var nanvar average prod nanprod trace reduce cov corrcoef polyfit polyval "
    "interp trapezoid gradient percentile quantile histogram"
)
EXACT = _words("pi inf nan sqrt isqrt floor ceil trunc isnan isinf isfinite copysign fabs gcd frexp ldexp")
"""What of `math` IEEE 754 fixes to the bit."""
UNSTABLE = {"argpartition", "partition"}
IMPORTS = _words("math cmath random secrets time datetime statistics os uuid threading multiprocessing scipy")
SEEDED = {"hash": "differs from process to process", "id": "is an address", "pow": "takes the platform's pow"}
SET_METHODS = _words("union intersection difference symmetric_difference copy")
ORDER_FREE = _words("sorted len min max any all set frozenset")
"""What may take a set: the order in which it is iterated does not show in the result."""
ORDERED = _words("list tuple iter enumerate zip map filter next reversed")


@dataclass(frozen=True)
class Breach:
    """Line `line` of a module breaks the law; `code` is the expression, `why` what to do instead."""

    line: int
    code: str
    why: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.code}: {self.why}"


def breaches(source: str) -> list[Breach]:
    """Every breach of the law in a module's source, in order of lines."""
    tree = ast.parse(source)
    sets, ordered = _names_of_sets(tree), _order_free(tree)
    found = [
        Breach(
            getattr(node.iter if isinstance(node, ast.comprehension) else node, "lineno", 0),
            ast.unparse(node).strip(),
            why,
        )
        for node in ast.walk(tree)
        if node not in ordered
        for why in _judge(node, sets)
    ]
    return sorted(found, key=lambda breach: (breach.line, breach.code))


def _judge(node: ast.AST, sets: set[str]) -> Iterator[str]:
    if isinstance(node, ast.Import | ast.ImportFrom):
        yield from _judge_import(node)
    elif isinstance(node, ast.BinOp | ast.AugAssign):
        yield from _judge_operator(node)
    elif isinstance(node, ast.Attribute):
        yield from _judge_attribute(node)
    elif isinstance(node, ast.Call):
        yield from _judge_call(node, sets)
    elif _is_set(getattr(node, "iter", node.value if isinstance(node, ast.Starred) else None), sets):
        yield "a set has no order: sort it"


def _judge_import(node: ast.Import | ast.ImportFrom) -> Iterator[str]:
    if isinstance(node, ast.ImportFrom) and node.module == "math":
        yield from (f"no math.{alias.name} here" for alias in node.names if alias.name not in EXACT)
        return
    names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
    yield from (f"no {name} here" for name in names if name.split(".")[0] in IMPORTS)


def _judge_operator(node: ast.BinOp | ast.AugAssign) -> Iterator[str]:
    if isinstance(node.op, ast.MatMult):
        yield "@ is BLAS: write the sum out"
    if isinstance(node.op, ast.Pow):
        operands = (node.left, node.right) if isinstance(node, ast.BinOp) else (node.target, node.value)
        if not all(isinstance(side, ast.Constant) and isinstance(side.value, int) for side in operands):
            yield "** takes the platform's pow: multiply, or dmath.sqrt"


def _judge_attribute(node: ast.Attribute) -> Iterator[str]:
    library = isinstance(node.value, ast.Name) and node.value.id in {"np", "numpy"}
    if library and node.attr in TRANSCENDENTAL:
        yield "differs by SIMD level and library: use slam.dmath"
    if library and node.attr in BLAS:
        yield "is BLAS: write the sum out"
    if library and node.attr in MODULES:
        yield "is not the same everywhere: small closed forms by hand"
    if library and node.attr in {"float16", "float32", "longdouble", "complex128", "complex64"}:
        yield "float64 only"


def _judge_call(node: ast.Call, sets: set[str]) -> Iterator[str]:
    name = _called(node)
    given = {word.arg: word.value for word in node.keywords}
    if isinstance(node.func, ast.Attribute):
        module = node.func.value.id if isinstance(node.func.value, ast.Name) else ""
        if name in REDUCTIONS and module != "dmath":
            yield "sums in an order of its own: dmath.total, dmath.mean"
        if name in UNSTABLE and not (node.args and _is_text(node.args[0])):
            yield "leaves ties as they fall: argsort(kind='stable')"
        if name == "argsort" and not (isinstance(given.get("kind"), ast.Constant) and _is(given["kind"], "stable")):
            yield "leaves ties as they fall: kind='stable'"
        if name in BLAS and module not in {"np", "numpy"}:
            yield "is BLAS: write the sum out"
        if name == "pop" and not node.args and _is_set(node.func.value, sets):
            yield "a set has no order: sort it"
    elif name == "sum" and not _counts(node):
        yield "compensates since Python 3.12: dmath.ordered_sum"
    elif name in SEEDED:
        yield SEEDED[name]
    elif name in ORDERED and any(_is_set(argument, sets) for argument in node.args):
        yield "a set has no order: sort it"


def _called(node: ast.Call) -> str:
    if isinstance(node.func, ast.Attribute):
        return node.func.attr
    return node.func.id if isinstance(node.func, ast.Name) else ""


def _order_free(tree: ast.AST) -> set[ast.AST]:
    """The loops of generators that go straight into a call to which order does not matter."""
    calls = (n for n in ast.walk(tree) if isinstance(n, ast.Call) and _called(n) in ORDER_FREE and n.args)
    first = (call.args[0] for call in calls)
    return {loop for what in first if isinstance(what, ast.GeneratorExp | ast.ListComp) for loop in what.generators}


def _is(node: ast.expr, value: object) -> bool:
    return isinstance(node, ast.Constant) and node.value == value


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _counts(node: ast.Call) -> bool:
    """Whether a built-in sum can be seen to add integers: of ones, of lengths, of comparisons, of int(…)."""
    what = node.args[0] if node.args else None
    if not isinstance(what, ast.GeneratorExp | ast.ListComp):
        return False
    element = what.elt
    if isinstance(element, ast.Call):
        return _called(element) in {"len", "int"}
    return isinstance(element, ast.Compare) or (isinstance(element, ast.Constant) and isinstance(element.value, int))


def _is_set(node: ast.AST | None, sets: set[str]) -> bool:
    if isinstance(node, ast.Set | ast.SetComp):
        return True
    if isinstance(node, ast.Name):
        return node.id in sets
    if isinstance(node, ast.Call):
        method = isinstance(node.func, ast.Attribute) and _is_set(node.func.value, sets)
        return _called(node) in {"set", "frozenset"} if not method else _called(node) in SET_METHODS
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitOr | ast.BitAnd | ast.Sub | ast.BitXor):
        return _is_set(node.left, sets) or _is_set(node.right, sets)
    return False


def _names_of_sets(tree: ast.AST) -> set[str]:
    """Names that are given a set somewhere in the module, or annotated as one."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and _is_set(node.value, names):
            names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
        annotated = node.annotation if isinstance(node, ast.AnnAssign | ast.arg) else None
        if annotated is not None and ast.unparse(annotated).split("[")[0] in {"set", "frozenset", "AbstractSet"}:
            target = node.target if isinstance(node, ast.AnnAssign) else node
            names.add(target.id if isinstance(target, ast.Name) else getattr(target, "arg", ""))
    return names
