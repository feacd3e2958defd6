"""Surfaces to measure: polynomials, a gyroid, and solids of many parts; each with the half width of its box."""

import random
from typing import Any

import sympy as sp

from implicit import x, y, z

_OFF = 1.0037  # keeps lattice planes off planes of symmetry


def _raw(kind: Any, *parts: Any) -> Any:
    """A function of many parts as it is written; sympy would compare all of them with each other."""
    return kind(*parts, evaluate=False)


def _sphere() -> tuple[sp.Expr, float]:
    return x**2 + y**2 + z**2 - 1, 1.3


def _torus() -> tuple[sp.Expr, float]:
    return (x**2 + y**2 + z**2 + 1 - sp.Rational(4, 25)) ** 2 - 4 * (x**2 + y**2), 1.6


def _genus2() -> tuple[sp.Expr, float]:
    return 2 * y * (y**2 - 3 * x**2) * (1 - z**2) + (x**2 + y**2) ** 2 - (9 * z**2 - 1) * (1 - z**2), 2.0


_PHI = (1 + sp.sqrt(5)) / 2


def _barth6() -> tuple[sp.Expr, float]:
    p = _PHI**2
    cones = (p * x**2 - y**2) * (p * y**2 - z**2) * (p * z**2 - x**2)
    return 4 * cones - (1 + 2 * _PHI) * (x**2 + y**2 + z**2 - 1) ** 2, 2.0


def _barth10() -> tuple[sp.Expr, float]:
    p = _PHI**4
    r = x**2 + y**2 + z**2
    planes = (x**2 - p * y**2) * (y**2 - p * z**2) * (z**2 - p * x**2)
    quartic = x**4 + y**4 + z**4 - 2 * x**2 * y**2 - 2 * x**2 * z**2 - 2 * y**2 * z**2
    return 8 * planes * quartic + (3 + 5 * _PHI) * (r - 1) ** 2 * (r - (2 - _PHI)) ** 2, 1.8


def _gyroid() -> tuple[sp.Expr, float]:
    s, c, w = sp.sin, sp.cos, 2 * sp.pi
    return s(w * x) * c(w * y) + s(w * y) * c(w * z) + s(w * z) * c(w * x), 2.0  # 4 periods


def _csg(count: int) -> tuple[sp.Expr, float]:
    """Balls, boxes and cylinders of random size and place, a fifth of them cut away."""
    draw = random.Random(1)

    def number(low: float, high: float) -> sp.Float:
        return sp.Float(round(draw.uniform(low, high), 3))

    size = 0.9 * (20 / count) ** (1 / 3) / 2.2
    added, cut = [], []
    for i in range(count):
        u = [x - number(-0.9, 0.9), y - number(-0.9, 0.9), z - number(-0.9, 0.9)]
        r = number(0.6 * size, 1.2 * size)
        if i % 3 == 0:
            part = sp.sqrt(u[0] ** 2 + u[1] ** 2 + u[2] ** 2) - r
        elif i % 3 == 1:
            sides = (r, number(0.5 * size, size), number(0.5 * size, size))
            part = _raw(sp.Max, *(sp.Abs(a) - side for a, side in zip(u, sides, strict=True)))
        else:
            turn = draw.randrange(3)
            u = u[turn:] + u[:turn]
            side = sp.sqrt(u[0] ** 2 + u[1] ** 2) - r * sp.Float(0.6)
            part = _raw(sp.Max, side, sp.Abs(u[2]) - r * sp.Float(1.5))
        (cut if i % 5 == 4 else added).append(part)
    return _raw(sp.Max, _raw(sp.Min, *added), *(-part for part in cut)), 1.37


def _blend12() -> tuple[sp.Expr, float]:
    """The smooth minimum of 12 balls: min(a, b) - max(k - |a - b|, 0)^2 / 4k."""
    draw = random.Random(3)
    k = sp.Float(0.15)
    result = None
    for _ in range(12):
        a, b, c = (sp.Float(round(draw.uniform(-0.8, 0.8), 3)) for _ in range(3))
        part = sp.sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) - sp.Float(round(draw.uniform(0.2, 0.35), 3))
        if result is None:
            result = part
            continue
        gap = _raw(sp.Abs, _raw(sp.Add, result, _raw(sp.Mul, -1, part)))
        near = _raw(sp.Max, _raw(sp.Add, k, _raw(sp.Mul, -1, gap)), sp.Integer(0))
        result = _raw(sp.Add, _raw(sp.Min, result, part), _raw(sp.Mul, -1 / (4 * k), _raw(sp.Pow, near, 2)))
    return result, 1.37


def _twist() -> tuple[sp.Expr, float]:
    c, s = sp.cos(2 * z), sp.sin(2 * z)
    sides = sp.Abs(c * x - s * y) - sp.Float(0.5), sp.Abs(s * x + c * y) - sp.Float(0.3), sp.Abs(z) - 1
    return _raw(sp.Max, *sides), 1.2


_MAKERS = {
    "sphere": _sphere,
    "torus": _torus,
    "genus 2": _genus2,
    "Barth sextic": _barth6,
    "Barth decic": _barth10,
    "gyroid": _gyroid,
    "CSG of 20": lambda: _csg(20),
    "CSG of 100": lambda: _csg(100),
    "smooth minimum of 12": _blend12,
    "twisted box": _twist,
}

SMOOTH = ("sphere", "torus", "genus 2", "Barth sextic", "Barth decic", "gyroid")
SOLIDS = ("CSG of 20", "smooth minimum of 12", "twisted box")
NAMES = tuple(_MAKERS)


def model(name: str) -> tuple[sp.Expr, float]:
    """The expression of a surface and the half width of its box."""
    expression, half = _MAKERS[name]()
    return expression, half * _OFF
