"""Rational surfaces and random nets for the tests of implicitization."""

import random

import sympy
from sympy import cos, cosh, sin, sinh, symbols

u, v = symbols("u v", real=True)

HALF = (1 - u**2) / (1 + u**2), 2 * u / (1 + u**2)
HALF_V = (1 - v**2) / (1 + v**2), 2 * v / (1 + v**2)
N = 1 + u**2 + v**2

QUADRICS = {
    "sphere": (cos(u) * cos(v), sin(u) * cos(v), sin(v)),
    "sphere, stereographic": (2 * u / N, 2 * v / N, (u**2 + v**2 - 1) / N),
    "ellipsoid": (2 * HALF[0] * HALF_V[0], 3 * HALF[1] * HALF_V[0], 5 * HALF_V[1]),
    "cone": (v * cos(u), v * sin(u), v),
    "cylinder": (cos(u), sin(u), v),
    "elliptic cylinder at an angle": (2 * cos(u) + v, sin(u) - v, v),
    "hyperboloid of one sheet": (HALF[0] - v * HALF[1], HALF[1] + v * HALF[0], v),
    "hyperboloid of two sheets": (sinh(v) * cos(u), sinh(v) * sin(u), cosh(v)),
    "elliptic paraboloid": (v * cos(u), 2 * v * sin(u), v**2),
    "hyperbolic paraboloid": (u, v, u * v),
    "parabolic cylinder": (u, u**2, v),
    "hyperbolic cylinder": (cosh(u), sinh(u), v),
    "plane": (u, v, 2 * u - 3 * v + 1),
}
DEN = 5 - 3 * cos(u) * cos(v)
OTHERS = {
    "torus": (((2 + cos(v)) * cos(u), (2 + cos(v)) * sin(u), sin(v)), 4, 1),
    "horn torus": (((1 + cos(v)) * cos(u), (1 + cos(v)) * sin(u), sin(v)), 4, 1),
    "spindle torus": (((1 + 2 * cos(v)) * cos(u), (1 + 2 * cos(v)) * sin(u), 2 * sin(v)), 4, 1),
    "ring cyclide": (
        ((4 * (3 - 5 * cos(u) * cos(v)) + 16 * cos(u)) / DEN, 4 * sin(u) * (5 - 4 * cos(v)) / DEN,
         4 * sin(v) * (3 * cos(u) - 4) / DEN), 4, 1),
    "Steiner": ((2 * v / N, 2 * u / N, 2 * u * v / N), 4, 1),
    "cross-cap": ((2 * u * v / N, 2 * u / N, (1 - v**2) / N), 4, 1),
    "Whitney umbrella": ((u * v, u, v**2), 3, 1),
    "Enneper": ((u - u**3 / 3 + u * v**2, v - v**3 / 3 + v * u**2, u**2 - v**2), 9, 1),
    "Moebius strip": (((1 + v * cos(u / 2)) * cos(u), (1 + v * cos(u / 2)) * sin(u), v * sin(u / 2)), 3, 2),
    "monkey saddle": ((u, v, u**3 - 3 * u * v**2), 3, 1),
}  # fmt: skip


def bezier(points):
    """Expressions of a Bezier patch with control points [i][j]."""
    m, n = len(points) - 1, len(points[0]) - 1
    blend_u = [sympy.binomial(m, i) * u**i * (1 - u) ** (m - i) for i in range(m + 1)]
    blend_v = [sympy.binomial(n, j) * v**j * (1 - v) ** (n - j) for j in range(n + 1)]
    pairs = [(i, j) for i in range(m + 1) for j in range(n + 1)]
    return tuple(sum(sympy.Rational(points[i][j][k]) * blend_u[i] * blend_v[j] for i, j in pairs) for k in range(3))


def random_net(m, n, seed, size=9):
    r = random.Random(seed)
    return [[tuple(r.randint(-size, size) for _ in range(3)) for _ in range(n + 1)] for _ in range(m + 1)]
