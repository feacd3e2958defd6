"""Parametric surfaces of the catalogue: each constructor of the textbook once, and the teapot."""

from dataclasses import replace
from math import pi
from typing import Any

import numpy as np

from gallery.catalog import Entry, Facts
from gallery.formulas import GOLD, MOSS, OCEAN, PLUM, STEEL, TEAL
from implicit.pictures.look import Look

TEXTBOOK = "Surface modelling, parametric surfaces"


def bezier_patch() -> Any:
    """A bicubic patch: a saddle with a bump."""
    from parametric import BezierSurface

    heights = [[0, 1, 1, 0.4], [1, -1, 2.6, 0.6], [0.6, 2.2, -1.2, 1.4], [0.2, 0.8, 1.2, -0.2]]
    return BezierSurface([[(i, j, heights[i][j]) for j in range(4)] for i in range(4)])


def bspline_surface() -> Any:
    """A wave of degree (3, 3) over 9 x 7 control points, with clamped knots."""
    from parametric import BSplineSurface

    i, j = np.meshgrid(np.arange(9), np.arange(7), indexing="ij")
    height = 1.6 * np.cos(1.35 * i) * np.exp(-((j - 3) ** 2) / 8) + 0.12 * (j - 3) ** 2
    return BSplineSurface(np.stack([i - 4.0, j - 3.0, height], axis=-1), (3, 3))


def coons_patch() -> Any:
    """The bilinearly blended patch of two waves and two arches."""
    from parametric import coons

    return coons(
        lambda s: (2 * s, 0, 0.35 * np.sin(2 * pi * s)),
        lambda s: (2 * s, 2, -0.35 * np.sin(2 * pi * s)),
        lambda s: (0, 2 * s, 1.1 * np.sin(pi * s)),
        lambda s: (2, 2 * s, 0.8 * np.sin(pi * s) ** 2),
    )


def ruled_surface() -> Any:
    """Lines from a circle to the same circle above, turned by 120 degrees: a hyperboloid of one sheet."""
    from parametric import circle, ruled

    def turned(s: Any) -> Any:
        angle = 2 * pi * np.asarray(s) + 2 * pi / 3
        return np.stack([np.cos(angle), np.sin(angle), np.full_like(angle, 1.1)], axis=-1)

    return ruled(circle(1, (0, 0, -1.1)), turned)


def revolved_vase() -> Any:
    """A vase: a cubic B-spline profile turned about the z-axis."""
    from parametric import BSplineCurve, revolve

    profile = [(0, 0, 0), (0.75, 0, 0), (1.15, 0, 0.45), (1.2, 0, 1.2), (0.35, 0, 1.75), (0.4, 0, 2.4), (0.85, 0, 2.75)]
    return revolve(BSplineCurve(profile[::-1], 3), ((0, 0, 0), (0, 0, 1)))


def swept_knot() -> Any:
    """A disc's rim swept along a trefoil knot without turning more than it must."""
    from sympy import cos, sin

    from parametric import FormulaCurve, circle, sweep, t

    path = FormulaCurve((sin(t) + 2 * sin(2 * t), cos(t) - 2 * cos(2 * t), -sin(3 * t)), (0, 2 * pi))
    return sweep(circle(0.42), path)


def enneper_surface() -> Any:
    """Enneper's minimal surface over a disc: (u - u^3/3 + u v^2, v - v^3/3 + v u^2, u^2 - v^2) with u + iv = r e^ia."""
    from sympy import cos, sin

    from parametric import FormulaSurface, u, v

    x = u * cos(v) - u**3 / 3 * cos(3 * v)
    y = u * sin(v) + u**3 / 3 * sin(3 * v)
    return FormulaSurface((x, y, u**2 * cos(2 * v)), ((0, 2), (0, 2 * pi)))


def moebius_strip() -> Any:
    """A strip with half a turn."""
    from sympy import cos, sin

    from parametric import FormulaSurface, u, v

    radius = 1 + v * cos(u / 2)
    return FormulaSurface((radius * cos(u), radius * sin(u), v * sin(u / 2)), ((0, 2 * pi), (-0.45, 0.45)))


def utah_teapot() -> Any:
    """32 bicubic patches."""
    from parametric import teapot

    return teapot()


PATCHES = (
    Entry(
        "bezier_patch",
        "Bézier patch",
        "p(u, v) = ΣΣ B_i3(u) B_j3(v) P_ij",
        f"{TEXTBOOK}: bicubic, 16 control points",
        Facts(closed=False, euler=1),
        build=bezier_patch,
        look=replace(OCEAN, view=(1.2, -1.5, 1.3)),
        iso_lines=(8, 8),
        control_net=True,
    ),
    Entry(
        "bspline_surface",
        "B-spline surface",
        "p(u, v) = ΣΣ N_i3(u) N_j3(v) P_ij",
        f"{TEXTBOOK}: degree (3, 3), clamped, 9 × 7 control points",
        Facts(closed=False, euler=1),
        build=bspline_surface,
        look=replace(TEAL, view=(1.1, -1.6, 1.7)),
        iso_lines=(12, 10),
        control_net=True,
    ),
    Entry(
        "coons_patch",
        "Coons patch",
        "p = (1 - v) p(u, 0) + v p(u, 1) + (1 - u) p(0, v) + u p(1, v) - corners",
        f"{TEXTBOOK}: bilinearly blended between four curves; Coons, MIT MAC-TR-41, 1967",
        Facts(closed=False, euler=1),
        build=coons_patch,
        look=replace(MOSS, view=(1.4, -1.4, 1.4)),
        iso_lines=(10, 10),
    ),
    Entry(
        "ruled_surface",
        "Ruled surface",
        "p(u, v) = (1 - v) a(u) + v b(u)",
        f"{TEXTBOOK}: lines between two circles, one turned by 120°: a hyperboloid",
        Facts(closed=False, euler=0),
        build=ruled_surface,
        look=PLUM,
        iso_lines=(30, 0),
    ),
    Entry(
        "revolved_vase",
        "Surface of revolution",
        "p(u, φ) = (r(u) cos φ, r(u) sin φ, z(u))",
        f"{TEXTBOOK}: a cubic B-spline profile turned about the z-axis",
        Facts(closed=False, euler=1),
        build=revolved_vase,
        iso_lines=(12, 20),
        look=Look(outside=(0.78, 0.50, 0.34), inside=(0.36, 0.25, 0.22), view=(1.0, -1.7, 1.25)),
    ),
    Entry(
        "swept_knot",
        "Swept surface",
        "p(u, v) = c(v) + R(v) s(u)",
        f"{TEXTBOOK}: a circle along a trefoil knot, in a rotation-minimizing frame",
        Facts(closed=True, euler=0),
        build=swept_knot,
        look=Look(outside=GOLD.outside, inside=GOLD.inside, view=(0.5, -0.9, 1.7)),
    ),
    Entry(
        "enneper_surface",
        "Enneper surface",
        "p = (u - u^3/3 + u v^2, v - v^3/3 + v u^2, u^2 - v^2)",
        "Enneper 1864, a minimal surface; its implicit equation has degree 9",
        Facts(closed=False, euler=1),
        build=enneper_surface,
        look=replace(OCEAN, view=(0.9, -1.3, 1.1)),
        iso_lines=(8, 32),
    ),
    Entry(
        "moebius_strip",
        "Möbius strip",
        "p = ((1 + v cos(u/2)) cos u, (1 + v cos(u/2)) sin u, v sin(u/2))",
        "Möbius, Listing 1858; one side, one rim",
        Facts(closed=False, euler=0),
        build=moebius_strip,
        look=STEEL,
        iso_lines=(36, 6),
    ),
    Entry(
        "teapot",
        "Utah teapot",
        "32 × ΣΣ B_i3(u) B_j3(v) P_ij",
        "Newell 1975",
        Facts(),
        build=utah_teapot,
        look=Look(outside=(0.86, 0.88, 0.90), inside=(0.55, 0.42, 0.34), view=(0.6, -1.9, 0.9)),
    ),
)
