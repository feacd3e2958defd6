"""Tori and ring, horn and spindle cyclides of Dupin, quartics with the leading terms (x^2 + y^2 + z^2)^2.

In its own axes a cyclide is (q.q + b^2 - m^2)^2 = 4 (a q1 - c m)^2 + 4 b^2 q2^2 with c^2 = a^2 - b^2; a torus has c = 0
and a = b its large, m its small radius (V. Chandru, D. Dutta, C. Hoffmann 1989).
"""

import sympy

from implicit.language.trees import x, y, z
from implicit.parametrize.chart import TURN, Chart, make_chart, moved, u, v

_NORM = x**2 + y**2 + z**2


def parametrize_cyclide(expression: sympy.Expr) -> Chart | None:
    """The chart of a Dupin cyclide of degree 4; None for other surfaces."""
    polynomial = sympy.Poly(expression, x, y, z)
    lead = polynomial.coeff_monomial(x**4)
    if polynomial.total_degree() != 4 or lead == 0 or not (expression / lead).is_polynomial(x, y, z):
        return None
    parts = _parts(sympy.Poly(sympy.expand(expression / lead), x, y, z))
    if sympy.expand(parts[4] - _NORM**2) != 0:
        return None
    slope, rest = sympy.div(sympy.Poly(parts[3], x, y, z), sympy.Poly(_NORM, x, y, z))
    if not rest.is_zero:
        return None
    center = sympy.Matrix([-slope.as_expr().coeff(s, 1) / 4 for s in (x, y, z)])
    shift = {s: s + c for s, c in zip((x, y, z), center, strict=True)}
    centered = sympy.expand((expression / lead).subs(shift, simultaneous=True))
    parts = _parts(sympy.Poly(centered, x, y, z))
    if parts[3] != 0:
        return None
    return _from_axes(parts, center)


def _parts(polynomial: sympy.Poly) -> list[sympy.Expr]:
    """The homogeneous parts of degrees 0 to 4."""
    parts = [sympy.Integer(0)] * 5
    for (i, j, k), c in polynomial.terms():
        parts[i + j + k] += c * x**i * y**j * z**k
    return parts


def _from_axes(parts: list[sympy.Expr], center: sympy.Matrix) -> Chart | None:
    """From the quadratic part q.M.q, the linear part and the constant, in axes through the center."""
    form = sympy.hessian(parts[2], (x, y, z)) / 2
    linear = sympy.Matrix([parts[1].coeff(s, 1) for s in (x, y, z)])
    axes = _principal(form, linear)
    if axes is None:
        return None
    (first, second, third), matrix = axes
    a, b = sympy.sqrt((third - first) / 4), sympy.sqrt((third - second) / 4)
    m_squared = sympy.radsimp(b**2 - third / 2)
    if b == 0 or not m_squared.is_nonnegative or not (b**2).is_positive:
        return None
    m = sympy.sqrt(m_squared)
    c = sympy.sqrt(sympy.simplify(a**2 - b**2))
    along = (matrix.T * linear)[0]
    if along.is_negative:
        matrix, along = matrix * sympy.diag(-1, 1, -1), -along
    constant = (b**2 - m**2) ** 2 - 4 * c**2 * m**2
    if sympy.simplify(along - 8 * a * c * m) != 0 or sympy.simplify(parts[0] - constant) != 0:
        return None
    return make_chart(moved(_cyclide(a, b, c, m), matrix, center), (TURN, TURN), "torus" if c == 0 else "Dupin cyclide")


def _cyclide(a: sympy.Expr, b: sympy.Expr, c: sympy.Expr, m: sympy.Expr) -> list[sympy.Expr]:
    cos_u, sin_u, cos_v, sin_v = sympy.cos(u), sympy.sin(u), sympy.cos(v), sympy.sin(v)
    if c == 0:
        return [(a + m * cos_v) * cos_u, (a + m * cos_v) * sin_u, m * sin_v]
    den = a - c * cos_u * cos_v
    return [
        (m * (c - a * cos_u * cos_v) + b**2 * cos_u) / den,
        b * sin_u * (a - m * cos_v) / den,
        b * sin_v * (c * cos_u - m) / den,
    ]


def _principal(form: sympy.Matrix, linear: sympy.Matrix) -> tuple[list[sympy.Expr], sympy.Matrix] | None:
    """Eigenvalues in ascending order and orthonormal eigenvectors; the first along the linear part if there is one."""
    pairs = []
    for value, multiplicity, vectors in form.eigenvects():
        if not value.is_real or len(vectors) != multiplicity:
            return None
        pairs += [(value, w) for w in sympy.GramSchmidt([w.applyfunc(sympy.radsimp) for w in vectors], True)]
    pairs.sort(key=lambda pair: float(pair[0]))
    matrix = sympy.Matrix.hstack(*(w for _, w in pairs)).applyfunc(sympy.radsimp)
    if matrix.det().is_negative:
        matrix = matrix * sympy.diag(1, 1, -1)
    across = (matrix.T * linear).applyfunc(sympy.radsimp)
    if across[1] != 0 or across[2] != 0:
        return None
    return [value for value, _ in pairs], matrix
