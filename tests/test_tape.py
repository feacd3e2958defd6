"""Tapes: small, shared, evaluated alike on bricks and at points, shortened without changing a bit."""

from functools import cache

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from implicit import Surface, x, y, z
from implicit.kernels.adjoint import differentiate
from implicit.kernels.ranges import enclose
from implicit.kernels.shorten import shorten
from implicit.kernels.values import EVERYTHING, SIDE, WIDTH, evaluate, spread
from implicit.tape import ADD, CONST, DIV, MAX, MIN, MUL, Tape, make_tape


@cache
def random_solid(seed, parts=12):
    """Min and Max of spheres, slabs and waves, as a user would write them."""
    rng = np.random.default_rng(seed)
    solid = None
    for n in range(parts):
        a, b, c, r = (sympy.Rational(int(v), 100) for v in rng.integers(-90, 90, 4))
        part = [
            sympy.sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) - abs(r),
            sympy.Max(sympy.Abs(x - a), sympy.Abs(y - b), evaluate=False) - abs(r),
            sympy.sin(3 * x) * sympy.cos(2 * y) + z - r,
            sympy.exp(x - a) - sympy.log(y + 2) + r,
        ][n % 4]
        kind = sympy.Max if rng.random() < 0.3 else sympy.Min
        solid = part if solid is None else kind(solid, part if rng.random() < 0.8 else -part, evaluate=False)
    return solid


@njit
def repeat(out, register, mask):
    spread(out, register, mask, 7)


def brick(code, start, count, tape, arguments, axes):
    registers, scratch = np.empty((count, WIDTH)), np.empty((3, WIDTH))
    evaluate(code, start, count, arguments, tape.constants, axes, 0, EVERYTHING, registers, scratch)
    out = np.empty(512)
    repeat(out, registers[count - 1], np.int64(code[start + count - 1, 3]))
    return out


def grid(axes):
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def test_equal_parts_share_a_register():
    part = sympy.sin(x * y) + z
    assert len(make_tape(part**2 + part)) == len(make_tape(part)) + 2
    assert len(make_tape(sympy.Max(part, sympy.exp(part), evaluate=False))) == len(make_tape(part)) + 2


def test_rows_come_in_order_and_the_result_is_last():
    tape = make_tape(random_solid(3))
    for q, (operation, a, b, mask) in enumerate(tape.code.tolist()):
        read = []
        if operation in (MIN, MAX):
            read = tape.arguments[a : a + b].tolist()
        elif operation > CONST:
            read = [a, b] if operation <= DIV else [a]
        assert all(r < q for r in read)
        assert operation <= CONST or mask == np.bitwise_or.reduce([tape.code[r, 3] for r in read])


def test_sums_and_products_are_grouped_by_their_variables():
    tape = make_tape(sympy.sin(x) * sympy.cos(z) * sympy.exp(x) + z**2 + y + sympy.cos(z))
    full = [row for row in tape.code.tolist() if row[3].bit_count() == 3]
    mixed = [row for row in tape.code.tolist() if row[3].bit_count() >= 2]
    assert [row[0] for row in full] == [ADD] and [row[0] for row in mixed] == [MUL, ADD, ADD]


@given(st.integers(0, 15))
@settings(max_examples=20, deadline=None)
def test_bricks_and_points_agree_bit_by_bit(seed):
    rng = np.random.default_rng(seed)
    surface = Surface.from_expression(random_solid(seed))
    tape = surface.field.tape
    axes = np.sort(rng.uniform(-1, 1, (3, SIDE)), axis=1)
    on_brick = brick(tape.code, 0, len(tape), tape, tape.arguments, axes)
    assert np.array_equal(on_brick, surface(grid(axes)), equal_nan=True)
    naive = sympy.lambdify((x, y, z), surface.expression, "numpy")(*grid(axes).T)
    assert np.allclose(on_brick, naive, rtol=1e-12, atol=1e-12)


@given(st.integers(0, 15), st.floats(-3, 0))
@settings(max_examples=40, deadline=None)
def test_shortened_tapes_change_no_bit(seed, scale):
    """In every box of a mesh the shortened tape has the values, the gradients and no more rows than the whole one."""
    rng = np.random.default_rng(seed)
    blend = sympy.Max(sympy.Rational(1, 5) - sympy.Abs(x - y, evaluate=False), 0, evaluate=False)
    tape = make_tape(sympy.Add(random_solid(seed, 16), -3 * blend**2, evaluate=False))
    n, m = len(tape), len(tape.arguments)
    code, arguments = np.zeros((2 * n, 4), np.int32), np.zeros(3 * m, np.int32)
    code[:n], arguments[:m] = tape.code, tape.arguments
    edges = rng.uniform(-1, 1, 3)[:, None] + 10**scale * np.arange(5)
    low, high = np.empty((n, 64)), np.empty((n, 64))
    enclose(
        code,
        0,
        n,
        arguments,
        tape.constants,
        edges[:, :4].copy(),
        edges[:, 1:].copy(),
        low,
        high,
        np.empty((5, WIDTH)),
    )
    for i, j, k in rng.integers(0, 4, (3, 3)):
        box, work = 16 * i + 4 * j + k, np.empty((4, max(n, m)), np.int32)
        rows, end = shorten(code, 0, n, arguments, tape.constants, low, high, box, n, m, work)
        assert rows <= n and end <= 2 * m
        start = 0 if rows == n and end == m else n
        axes = np.stack([np.linspace(edges[a, q], edges[a, q + 1], SIDE) for a, q in enumerate((i, j, k))])
        whole = brick(code, 0, n, tape, arguments, axes)
        assert np.array_equal(whole, brick(code, start, rows, tape, arguments, axes))
        points = np.ascontiguousarray(grid(axes).T)
        slopes = [gradients(code, s, c, tape, arguments, points) for s, c in ((0, n), (start, rows))]
        assert np.array_equal(*slopes)


def gradients(code, start, count, tape, arguments, points):
    registers, adjoints, scratch = np.empty((count, WIDTH)), np.empty((count, WIDTH)), np.empty((3, WIDTH))
    found = np.empty((3, WIDTH))
    evaluate(code, start, count, arguments, tape.constants, points, 512, EVERYTHING, registers, scratch)
    differentiate(code, start, count, arguments, tape.constants, 512, registers, adjoints, found, scratch)
    return found[:, :512]


def test_large_solids_are_built_without_sympy_evaluating_them():
    import time

    begin = time.process_time()
    tape = make_tape(random_solid(1, 300))
    assert len(tape) > 500 and time.process_time() - begin < 20  # hours, if sympy simplified the tree


def test_deep_trees_need_no_recursion():
    f = x
    for _ in range(3000):
        f = (
            sympy.Max(f, y, evaluate=False) + z
            if f is x
            else sympy.Add(sympy.Abs(f, evaluate=False), z, evaluate=False)
        )
    assert len(make_tape(f)) > 3000


@pytest.mark.parametrize(
    ("f", "message"),
    [
        (sympy.gamma(x), "no rule for gamma"),
        (x + sympy.sqrt(-2 - sympy.E), "real numbers"),
        (sympy.Symbol("q") + x, "no rule"),
    ],
)
def test_what_has_no_rule_is_named(f, message):
    with pytest.raises(ValueError, match=message):
        make_tape(f)


def test_tapes_are_immutable():
    tape = make_tape(x + 1)
    assert isinstance(tape, Tape) and not tape.code.flags.writeable and not tape.constants.flags.writeable
