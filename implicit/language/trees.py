"""Expression trees: walking, rebuilding and packing them without letting sympy evaluate them.

sympy simplifies Min, Max and Abs when they are built, which takes minutes for a solid of a hundred parts. Everything
here visits each distinct subexpression once, without recursion, and builds nodes above a Min, Max or Abs unevaluated.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

import sympy
from sympy.core.operations import AssocOp

Packed: TypeAlias = tuple[tuple[object, tuple[int, ...]], ...]

x, y, z = sympy.symbols("x y z", real=True)

_BRANCHING = (sympy.Min, sympy.Max, sympy.Abs)


def postorder(expression: sympy.Basic) -> list[sympy.Basic]:
    """Every distinct subexpression, arguments before what they are used in; the expression itself is last."""
    order: dict[sympy.Basic, None] = {}
    stack = [(expression, False)]
    while stack:
        node, ready = stack.pop()
        if node in order:
            continue
        if ready or not node.args:
            order[node] = None
        else:
            stack.append((node, True))
            stack.extend((argument, False) for argument in reversed(node.args) if argument not in order)
    return list(order)


def build(kind: Any, *arguments: sympy.Expr) -> sympy.Expr:
    """The node `kind(*arguments)`, unevaluated: the structure is kept as it is given."""
    if issubclass(kind, sympy.Min | sympy.Max):
        distinct = tuple(dict.fromkeys(arguments))
        if len(distinct) == 1:
            return distinct[0]
        node = sympy.Expr.__new__(kind, *distinct)  # the class's own constructor sorts, slowly
        node._argset = frozenset(distinct)
        return node
    if issubclass(kind, AssocOp):
        return kind._from_args(arguments)
    return kind(*arguments, evaluate=False)


def is_branching(expression: sympy.Expr) -> bool:
    """Whether a Min, Max or Abs of something other than a constant occurs in the expression."""
    return any(isinstance(node, _BRANCHING) and node.free_symbols for node in postorder(expression))


def difference(left: sympy.Expr, right: sympy.Expr) -> sympy.Expr:
    """The difference of two expressions, built unevaluated where a Min, Max or Abs occurs, as `is_branching` says."""
    if right == 0:
        return left
    minus = build(sympy.Mul, sympy.S.NegativeOne, right) if is_branching(right) else -right
    return build(sympy.Add, left, minus) if is_branching(left) or is_branching(minus) else left + minus


def substitute(expression: sympy.Expr, values: Mapping[sympy.Symbol, sympy.Expr]) -> sympy.Expr:
    """The expression with symbols replaced; what stands below no Min, Max or Abs is simplified as usual."""
    new: dict[sympy.Basic, sympy.Basic] = {}
    branching: set[sympy.Basic] = set()
    for node in postorder(expression):
        if not node.args:
            new[node] = values.get(node, node)
            if new[node] is not node and is_branching(new[node]):
                branching.add(node)
            continue
        arguments = [new[argument] for argument in node.args]
        if isinstance(node, _BRANCHING) or any(argument in branching for argument in node.args):
            branching.add(node)
            new[node] = build(node.func, *arguments)
        elif all(a is b for a, b in zip(arguments, node.args, strict=True)):
            new[node] = node
        elif isinstance(node, sympy.Pow) and isinstance(arguments[0], sympy.Add):
            new[node] = build(sympy.Pow, *arguments)  # sympy would ask for the sign of the base, at length
        else:
            new[node] = node.func(*arguments)
    return new[expression]


def symbols_of(expression: sympy.Basic) -> set[sympy.Symbol]:
    """The symbols that occur."""
    return {node for node in postorder(expression) if isinstance(node, sympy.Symbol)}


def pack(expression: sympy.Expr) -> Packed:
    """A flat list of nodes, for pickling: sympy's own way evaluates every node again."""
    order = postorder(expression)
    place = {node: index for index, node in enumerate(order)}
    return tuple(
        (node.func, tuple(place[argument] for argument in node.args)) if node.args else (node, ()) for node in order
    )


def unpack(packed: Packed) -> sympy.Expr:
    """The expression that was packed, node by node."""
    nodes: list[sympy.Expr] = []
    for item, places in packed:
        nodes.append(build(item, *(nodes[place] for place in places)) if places else item)
    return nodes[-1]
