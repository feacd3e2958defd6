"""Sweep surfaces: a section moved along a path, or by matrices."""

from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from parametric.curve import CurveLike, ParametricCurve, to_curve
from parametric.differences import differentiate, multiply
from parametric.parameters import Array, Interval, check_orders, to_interval, to_vector
from parametric.place import translation
from parametric.splines.bspline import BSplineCurve
from parametric.surface import ParametricSurface
from parametric.sweeps.caps import cap
from parametric.sweeps.frames import FrameField, MinimalFrame, to_frame, turn
from parametric.sweeps.laws import Law, LawLike
from parametric.transfinite.blend import BlendedSurface, linear_blend

if TYPE_CHECKING:
    from parametric.shell import Shell


def extrude(curve: CurveLike, vector: ArrayLike) -> BlendedSurface:
    """Tabulated cylinder p(u, v) = curve(u) + v vector, v in [0, 1].

    Examples
    --------
    >>> extrude([(0, 0, 0), (1, 0, 0)], (0, 0, 2))(0.5, 0.5)
    array([0.5, 0. , 1. ])
    """
    rail = to_curve(curve)
    if not np.any(to_vector(vector, "vector")):
        raise ValueError("the vector of an extrusion must not be zero")
    return BlendedSurface((rail, rail.transform(translation(vector))), linear_blend())


def transform_sweep(curve: CurveLike, matrices: Any, domain: ArrayLike = (0.0, 1.0)) -> "TransformSweep":
    """Sweep Q(u, s) = [x(u) y(u) z(u) 1] T(s), as in the source: T acts on row vectors.

    Parameters
    ----------
    curve : curve object, callable on [0, 1] or vertices of a polyline
    matrices : callable s -> (4, 4), or a sympy Matrix in one symbol
        Derivatives by s are exact for a sympy Matrix and differences of order eight for a callable.
    domain : (s0, s1)

    Examples
    --------
    >>> def screw(s):
    ...     c, d = np.cos(2 * np.pi * s), np.sin(2 * np.pi * s)
    ...     return [[1, 0, 0, 0], [0, c, d, 0], [0, -d, c, 0], [10 * s, 0, 0, 1]]
    >>> transform_sweep([(0, 0, 0), (0, 3, 0)], screw)(0.5, 0.5).round(12) + 0.0
    array([ 5. , -1.5,  0. ])
    """
    return TransformSweep(to_curve(curve), matrices, to_interval(domain))


class TransformSweep(ParametricSurface):
    """A sweep by matrices; see `transform_sweep`."""

    def __init__(self, curve: ParametricCurve, matrices: Any, domain: Interval) -> None:
        self.curve, self.matrices, self._range = curve, matrices, domain
        self._functions: dict[int, Any] = {}
        self._at(np.array([domain[0], domain[1]]), 0)

    @property
    def domain(self) -> tuple[Interval, Interval]:
        """The domain of the curve, and of s."""
        return self.curve.domain, self._range

    @property
    def breaks(self) -> tuple[Array, Array]:
        """The breaks of the curve, and the ends of s."""
        return self.curve.breaks, np.array(self._range)

    def _at(self, s: Array, order: int) -> Array:
        """Matrices or their derivatives, (..., 4, 4)."""
        if callable(self.matrices):
            return differentiate(self._sample, s, order, self._range).reshape(*s.shape, 4, 4)
        if order not in self._functions:
            import sympy

            symbols = sorted(self.matrices.free_symbols, key=str) or [sympy.Symbol("s")]
            if self.matrices.shape != (4, 4) or len(symbols) > 1:
                raise ValueError(f"a sweep needs a matrix (4, 4) in one symbol, got {self.matrices}")
            derived = self.matrices.diff(symbols[0], order) if order else self.matrices
            self._functions[order] = [sympy.lambdify(symbols, e, modules="numpy") for e in derived]
        entries = [np.broadcast_to(f(s), s.shape) for f in self._functions[order]]
        return np.stack(entries, axis=-1).astype(float).reshape(*s.shape, 4, 4)

    def _sample(self, s: Array) -> Array:
        matrices = [np.asarray(self.matrices(float(value)), dtype=float) for value in s.ravel()]
        for matrix in matrices:
            if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
                raise ValueError(f"a sweep needs finite matrices (4, 4), got {matrix.tolist()}")
            if not np.array_equal(matrix[:, 3], [0, 0, 0, matrix[3, 3]]) or matrix[3, 3] == 0:
                raise ValueError(f"the last column of a sweep matrix must be 0 0 0 w, got {matrix[:, 3].tolist()}")
        return np.stack(matrices).reshape(*s.shape, 16)

    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by s: (..., 3)."""
        check_orders(i, j)
        a, s = self.parameters(u, v)
        point = self.curve.derivative(a, i)
        row = np.concatenate([point, np.full((*point.shape[:-1], 1), float(i == 0))], axis=-1)
        quotients: list[Array] = []
        matrices = [self._at(s, k) for k in range(j + 1)]
        scales = [m[..., 3, 3, None] for m in matrices]
        for k, matrix in enumerate(matrices):
            rest = np.einsum("...i,...ij->...j", row, matrix)[..., :3]
            if k:
                rest = rest - multiply(scales, [*quotients, np.zeros(3)], np.multiply, k)
            quotients.append(rest / scales[0])
        return quotients[-1]


@overload
def sweep(
    section: CurveLike,
    path: CurveLike,
    *,
    frame: str = ...,
    twist: LawLike = ...,
    scale: LawLike = ...,
    caps: Literal[False] = ...,
    anchor: ArrayLike = ...,
    start: ArrayLike | None = ...,
) -> ParametricSurface: ...
@overload
def sweep(
    section: CurveLike,
    path: CurveLike,
    *,
    frame: str = ...,
    twist: LawLike = ...,
    scale: LawLike = ...,
    caps: Literal[True],
    anchor: ArrayLike = ...,
    start: ArrayLike | None = ...,
) -> "Shell": ...
def sweep(
    section: CurveLike,
    path: CurveLike,
    *,
    frame: str = "minimal",
    twist: LawLike = 0,
    scale: LawLike = 1,
    caps: bool = False,
    anchor: ArrayLike = (0, 0, 0),
    start: ArrayLike | None = None,
) -> "ParametricSurface | Shell":
    """Sweep of a section along a path: p(u, s) = path(s) + scale(s) (x e1(s) + y e2(s) + z t(s)).

    (x, y, z) = section(u) - anchor is turned by twist(s) about the tangent t. A section drawn counter-clockwise in
    the xy-plane has the normals p_u x p_s outside.

    Parameters
    ----------
    section, path : curve objects, callables on [0, 1] or vertices of polylines
        Polyline paths get mitred corners; any other corner in a path is an error.
    frame : "minimal", "frenet" or "fixed"
        "minimal" turns least about the tangent, and closes on closed paths; "fixed" keeps the frame of the start.
    twist, scale : numbers or callables
        A number is reached linearly at the end of the path (from 0 and from 1); a callable takes s in [0, 1].
    caps : whether to close both ends with plane caps; the result is then a Shell
    anchor : the point of the section's plane that lies on the path
    start : direction of e1 at the start; by default the x-axis, turned with the z-axis onto the tangent

    Examples
    --------
    >>> from parametric.conic import circle
    >>> from parametric.splines.bspline import line
    >>> sweep(circle(1), line((0, 0, 0), (0, 0, 5)))(0.0, 0.5)
    array([1. , 0. , 2.5])
    """
    profile, rail = to_curve(section, "section"), to_curve(path, "path")
    laws = Law(twist, 0.0, "twist"), Law(scale, 1.0, "scale")
    if isinstance(rail, BSplineCurve) and rail.degree == 1 and len(rail.points) > 2:
        from parametric.sweeps.mitre import mitred

        side: ParametricSurface = mitred(profile, rail, frame, *laws, anchor, start)
    else:
        _check_smooth(rail)
        side = SweptSurface(profile, to_frame(frame, rail, start), *laws, anchor)
    if not caps:
        return side
    if rail.closed:
        raise ValueError("a closed path has no ends to cap")
    from parametric.shell import Shell

    low, high = side.domain[1]
    ends = [cap(side.iso_v(low)), cap(side.iso_v(high), reverse=True)]
    return Shell([side, *(end for end in ends if end is not None)])


def _check_smooth(path: ParametricCurve) -> None:
    for s in path.breaks[1:-1]:
        sides = path.tangent([np.nextafter(s, -np.inf), s])
        if np.linalg.norm(sides[0] - sides[1]) > 1e-7:
            raise ValueError(f"the path has a corner at s = {s:g}: only polylines are mitred")


class SweptSurface(ParametricSurface):
    """A section along a smooth path; see `sweep`."""

    def __init__(
        self,
        section: ParametricCurve,
        frames: FrameField,
        twist: Law,
        scale: Law,
        anchor: ArrayLike,
    ) -> None:
        self.section, self.frames, self.path = section, frames, frames.path
        self.anchor = to_vector(anchor, "anchor")
        self._laws = twist, scale
        self._closing = self._miss()

    def _miss(self) -> float:
        """The angle to turn by on the way, so that a minimal frame closes on a smoothly closed path."""
        if not (isinstance(self.frames, MinimalFrame) and self.path.closed):
            return 0.0
        ends = self.path.tangent(np.array(self.path.domain))
        return -self.frames.holonomy if np.linalg.norm(ends[0] - ends[1]) < 1e-9 else 0.0

    @property
    def domain(self) -> tuple[Interval, Interval]:
        """The domains of section and path."""
        return self.section.domain, self.path.domain

    @property
    def breaks(self) -> tuple[Array, Array]:
        """The breaks of section and path."""
        return self.section.breaks, self.path.breaks

    def _placed(self, s: Array, order: int) -> list[tuple[Array, Array, Array]]:
        """The turned and scaled frame and its derivatives."""
        frames = self.frames.derivatives(s, order)
        low, high = self.path.domain
        fraction, rate = np.clip((s - low) / (high - low), 0, 1), 1 / (high - low)
        angles, sizes = ([d * rate**k for k, d in enumerate(law.derivatives(fraction, order))] for law in self._laws)
        angles[0] = angles[0] + self._closing * fraction[..., None]
        if order:
            angles[1] = angles[1] + self._closing * rate
        cos, sin = turn(angles, order)
        e1, e2, t = (list(vectors) for vectors in zip(*frames))
        orders = range(order + 1)
        first = [multiply(cos, e1, np.multiply, n) + multiply(sin, e2, np.multiply, n) for n in orders]
        second = [multiply(cos, e2, np.multiply, n) - multiply(sin, e1, np.multiply, n) for n in orders]
        scaled = ([multiply(sizes, vectors, np.multiply, n) for n in orders] for vectors in (first, second, t))
        return list(zip(*scaled))

    def derivative(self, u: ArrayLike, v: ArrayLike, i: int, j: int) -> Array:
        """The partial derivative, i times by u and j times by s: (..., 3)."""
        check_orders(i, j)
        a, s = self.parameters(u, v)
        vectors = self.section.derivative(a, i) - (self.anchor if i == 0 else 0.0)
        frame = self._placed(s, j)[j]
        result = sum(vectors[..., k, None] * axis for k, axis in enumerate(frame[1:], 1)) + vectors[..., :1] * frame[0]
        return np.asarray(result + self.path.derivative(s, j) if i == 0 else result)
