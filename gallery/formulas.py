"""Implicit surfaces: the textbook chapter's, the classics of algebraic geometry, and solids."""

from dataclasses import replace
from math import pi

from gallery.catalog import Entry, Facts
from implicit.domain import Ball, Box
from implicit.pictures.look import Look

GOLDEN = {"p": "(1 + sqrt(5))/2"}

OCEAN = Look()
MOSS = Look(outside=(0.21, 0.50, 0.40), inside=(0.94, 0.83, 0.60))
PLUM = Look(outside=(0.44, 0.31, 0.60), inside=(0.96, 0.76, 0.52))
TEAL = Look(outside=(0.09, 0.50, 0.55), inside=(0.98, 0.80, 0.46))
GOLD = Look(outside=(0.91, 0.67, 0.22), inside=(0.24, 0.46, 0.72))
STEEL = Look(outside=(0.50, 0.60, 0.72), inside=(0.94, 0.64, 0.42))
CONFETTI = Look(triangles="random")

CHAPTER = "Surface modelling, section on singularities"
ELEMENTARY = "Elementary"

FORMULAS = (
    Entry(
        "chapter_node",
        "Cubic with a node",
        "x^2 + y^3 - y^2 + z^2 = 0",
        f"{CHAPTER}, first figure; its second point (0, 2/3, 0) is not on the surface",
        Facts(degree=3, singular_points=1, types="A1", singular_curves=0, closed=False, euler=2),
        Ball(1.5),
        look=replace(OCEAN, view=(1.0, 0.35, 1.7), up=(0.0, 1.0, 0.0)),
    ),
    Entry(
        "chapter_a5",
        "Cubic with an A5 point",
        "-x^3 + 2x z - y^2 z = 0",
        f"{CHAPTER}, second figure; printed with y z², but with the gradient of y² z",
        Facts(degree=3, singular_points=1, types="A5", singular_curves=0, closed=False, euler=1),
        Ball(1.5),
        look=replace(TEAL, view=(-1.0, -1.7, 1.0)),
        detail=0.5,
    ),
    Entry(
        "chapter_line",
        "Cubic with a singular line",
        "-x^2 y + x^2 - y z^2 - z^2 = 0",
        f"{CHAPTER}, third figure: Plücker's conoid, the line solitary beyond its two pinch points",
        Facts(degree=3, singular_points=0, singular_curves=1, closed=False, euler=1),
        Ball(1.5),
        look=replace(PLUM, view=(1.7, 1.2, 0.6), up=(0.0, 1.0, 0.0)),
        detail=0.7,
    ),
    Entry(
        "hyperbolic_paraboloid",
        "Hyperbolic paraboloid",
        "z = x^2 - y^2",
        "Surface modelling, polygonizer figure, left",
        Facts(degree=2, singular_points=0, singular_curves=0, closed=False, euler=1),
        Box((-1, -1, -1.2), (1, 1, 1.2)),
        method="following",
        look=replace(CONFETTI, view=(1.0, -1.5, 1.4)),
        detail=0.5,
    ),
    Entry(
        "dupin_cyclide",
        "Ring Dupin cyclide",
        "(x^2 + y^2 + z^2)^2 = 4(5x - 12)^2 + 64y^2",
        "Surface modelling, polygonizer figure, right; a = 5, b = d = 4, c = 3 in Chandru, Dutta, Hoffmann 1989",
        Facts(degree=4, singular_points=0, singular_curves=0, closed=True, euler=0),
        Box((-13, -11, -8), (13, 11, 8)),
        method="following",
        look=replace(CONFETTI, view=(0.4, -0.9, 1.3)),
        detail=0.8,
    ),
    Entry(
        "sphere",
        "Sphere",
        "x^2 + y^2 + z^2 = 1",
        ELEMENTARY,
        Facts(degree=2, singular_points=0, singular_curves=0, closed=True, euler=2, volume=4 / 3 * pi),
        1.2,
        look=STEEL,
    ),
    Entry(
        "torus",
        "Torus",
        "(x^2 + y^2 + z^2 + 3)^2 = 16(x^2 + y^2)",
        "Elementary: circles of radius 1 round a circle of radius 2",
        Facts(degree=4, singular_points=0, singular_curves=0, closed=True, euler=0, volume=4 * pi**2),
        3.2,
        look=GOLD,
    ),
    Entry(
        "gyroid",
        "Gyroid",
        "sin(x) cos(y) + sin(y) cos(z) + sin(z) cos(x) = 0",
        "Level-set approximation of Schoen's minimal surface, NASA TN D-5541, 1970",
        Facts(closed=False),
        Ball(5.5),
        look=OCEAN,
        detail=1.2,
    ),
    Entry(
        "cayley_cubic",
        "Cayley cubic",
        "4(x^2 + y^2 + z^2) + 16x y z = 1",
        "Cayley, A memoir on cubic surfaces, 1869",
        Facts(degree=3, singular_points=4, types="4 A1", singular_curves=0, closed=False, euler=2),
        Ball(1.8),
        look=replace(MOSS, view=(1.0, -2.2, 0.8)),
    ),
    Entry(
        "clebsch_cubic",
        "Clebsch diagonal cubic",
        "81(x^3 + y^3 + z^3) - 189(x^2 y + x^2 z + y^2 x + y^2 z + z^2 x + z^2 y) + 54x y z"
        " + 126(x y + y z + z x) - 9(x^2 + y^2 + z^2) - 9(x + y + z) + 1 = 0",
        "Clebsch, Math. Ann. 4, 1871; all 27 lines are real",
        Facts(degree=3, singular_points=0, singular_curves=0, closed=False),
        Ball(1.6),
        look=replace(GOLD, view=(1.2, -0.9, 0.6), up=(1.0, 1.0, 1.0)),
        detail=1.3,
    ),
    Entry(
        "barth_sextic",
        "Barth sextic",
        "(1 + 2p)(x^2 + y^2 + z^2 - 1)^2 = 4(p^2 x^2 - y^2)(p^2 y^2 - z^2)(p^2 z^2 - x^2)",
        "Barth, J. Algebraic Geom. 5, 1996; p is the golden ratio; 65 nodes, 15 of them at infinity",
        Facts(degree=6, singular_points=50, types="50 A1", singular_curves=0, closed=False),
        Ball(2.2),
        GOLDEN,
        look=GOLD,
        detail=1.5,
        method="marching",
    ),
    Entry(
        "whitney_umbrella",
        "Whitney umbrella",
        "x^2 = y^2 z",
        "Whitney, Duke Math. J. 10, 1943",
        Facts(degree=3, singular_points=0, singular_curves=1, closed=False, euler=1),
        Ball(1.5),
        look=replace(PLUM, view=(1.7, -1.2, 0.9)),
        detail=0.8,
    ),
    Entry(
        "kummer_quartic",
        "Kummer quartic",
        "(x^2 + y^2 + z^2 - 3/2)^2 = 7/3 ((1 - z)^2 - 2x^2)((1 + z)^2 - 2y^2)",
        "Kummer 1864; this form in Hudson, Kummer's quartic surface, 1905",
        Facts(degree=4, singular_points=16, types="16 A1", singular_curves=0, closed=False),
        Ball(1.9),
        look=TEAL,
        method="marching",
        detail=1.3,
    ),
    Entry(
        "steiner_roman",
        "Steiner's Roman surface",
        "x^2 y^2 + y^2 z^2 + z^2 x^2 = 2x y z",
        "Steiner 1844; three double lines, a triple point, six pinch points",
        Facts(degree=4, singular_points=0, singular_curves=3, closed=True, euler=5),
        Ball(1.25),
        look=MOSS,
        detail=0.5,
    ),
    Entry(
        "togliatti_quintic",
        "Togliatti quintic",
        "5q(2z - q)(4(x^2 + y^2 - z^2) + 1 + 3sqrt(5))^2"
        " = 64(x - 1)(x^4 - 4x^3 - 10x^2 y^2 - 4x^2 + 16x - 20x y^2 + 5y^4 + 16 - 20y^2)",
        "Togliatti 1940, this form by Endraß; q = √(5 − √5); 31 nodes, as many as a quintic can have",
        Facts(degree=5, singular_points=31, types="31 A1", singular_curves=0, closed=False),
        Ball(9.6),
        {"q": "sqrt(5 - sqrt(5))"},
        look=replace(PLUM, view=(-1.0, -1.5, 0.5)),
        detail=1.5,
        method="marching",
    ),
    Entry(
        "chmutov_quartic",
        "Banchoff-Chmutov quartic",
        "2(x^2 (x^2 - 1) + y^2 (y^2 - 1) + z^2 (z^2 - 1)) + 1 = 0",
        "Sums of Chebyshev polynomials, Chmutov, J. Algebraic Geom. 1, 1992; 12 nodes, on the edges of a cube",
        Facts(degree=4, singular_points=12, types="12 A1", singular_curves=0, closed=True, euler=4),
        1.3,
        look=STEEL,
        detail=0.8,
    ),
    Entry(
        "tanglecube",
        "Tanglecube",
        "x^4 - 5x^2 + y^4 - 5y^2 + z^4 - 5z^2 + 11.8 = 0",
        "Banchoff; a sphere with five handles",
        Facts(degree=4, singular_points=0, singular_curves=0, closed=True, euler=-8),
        2.6,
        look=TEAL,
    ),
    Entry(
        "ding_dong",
        "Ding-dong",
        "x^2 + y^2 = (1 - z) z^2",
        "Hauser, gallery of algebraic surfaces",
        Facts(degree=3, singular_points=1, types="A1", singular_curves=0, closed=False, euler=2),
        Ball(1.6),
        look=GOLD,
    ),
    Entry(
        "double_torus",
        "Double torus",
        "(x^2 (1 - x^2) - y^2)^2 + z^2 = 1/100",
        "A lemniscate thickened; two handles",
        Facts(degree=8, singular_points=0, singular_curves=0, closed=True, euler=-2),
        Box((-1.3, -0.9, -0.3), (1.3, 0.9, 0.3)),
        look=PLUM,
        detail=3,
    ),
    Entry(
        "heart",
        "Heart",
        "(x^2 + 9/4 y^2 + z^2 - 1)^3 = x^2 z^3 + 9/80 y^2 z^3",
        "Taubin, IEEE CG&A 14, 1994; singular at dip and tip, and along an ellipse where it looks smooth",
        Facts(degree=6, singular_points=2, types="2 A2", singular_curves=1, closed=True, euler=2),
        Box((-1.4, -0.9, -1.2), (1.4, 0.9, 1.5)),
        look=Look(outside=(0.80, 0.20, 0.30), inside=(0.96, 0.80, 0.70), view=(0.5, -2.0, 0.45)),
        method="marching",
    ),
    Entry(
        "csg_solid",
        "A constructed solid",
        "max(abs(x) - 1, abs(y) - 1, abs(z) - 1, x^2 + y^2 + z^2 - 7/4,"
        " 1/3 - x^2 - y^2, 1/3 - y^2 - z^2, 1/3 - z^2 - x^2) = 0",
        "Constructive solid geometry: a cube and a ball in common, less three cylinders; five handles",
        Facts(closed=True, euler=-8),
        1.1,
        look=STEEL,
        detail=3,
    ),
)
