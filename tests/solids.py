"""Shells with known answers, for the tests of shells, tessellation and classification."""

import numpy as np

from parametric import BezierSurface

# Quarters of the unit circle as (x, y, w): (1 - t^2, 2 t) / (1 + t^2), in integers, hence exact.
QUARTER = ((1, 0, 1), (1, 1, 1), (0, 2, 2))


def _turned(point, quarters):
    x, y, w = point
    return [(x, y), (-y, x), (-x, -y), (y, -x)][quarters] + (w,)


def torus_patches(major=1.0, minor=0.4, reverse=False, columns=range(4), rows=range(4)):
    """Biquadratic patches of a torus round the z axis, 4 x 4 of them, exact up to the rounding of the radii."""
    patches = []
    for i in columns:
        for j in rows:
            net = np.zeros((3, 3, 4))
            for a in range(3):
                for b in range(3):
                    cx, cy, cw = _turned(QUARTER[a], i)
                    dx, dy, dw = _turned(QUARTER[b], j)
                    reach = major * dw + minor * dx
                    net[a, b] = reach * cx, reach * cy, minor * dy * cw, cw * dw
            patches.append(from_weighted(net[:, ::-1] if reverse else net))
    return patches


def hemisphere_patches(upper=True):
    """Four patches of half the unit sphere, outward, each with a pole."""
    patches = []
    for i in range(4):
        net = np.zeros((3, 3, 4))
        for a in range(3):
            for b in range(3):
                cx, cy, cw = _turned(QUARTER[a], i)
                dx, dy, dw = QUARTER[b]
                net[a, b] = dx * cx, dx * cy, (dy if upper else -dy) * cw, cw * dw
        patches.append(from_weighted(net if upper else net[:, ::-1]))
    return patches


def disc_patches(upward=True):
    """Four patches of the unit disc in z = 0 with their common pole at the origin."""
    patches = []
    for i in range(4):
        rim = np.array([_turned(point, i) for point in QUARTER], dtype=float)
        net = np.zeros((3, 2, 4))
        net[:, 0, :2], net[:, 0, 3] = rim[:, :2], rim[:, 2]
        net[:, 1, 3] = rim[:, 2]
        patches.append(from_weighted(net if upward else net[:, ::-1]))
    return patches


def from_weighted(net):
    """A rational patch from control points (x, y, z, w) with the weights multiplied in."""
    return BezierSurface(net[..., :3] / net[..., 3:], net[..., 3])


def reparametrized(patch, ratio, axis):
    """The same set of points at another speed: t -> t / (t + c (1 - t)) multiplies the weights by powers of c."""
    count = patch.points.shape[axis]
    weights = np.ones(patch.points.shape[:2]) if patch.weights is None else patch.weights
    powers = ratio ** np.arange(count)
    return BezierSurface(patch.points, weights * (powers[:, None] if axis == 0 else powers[None, :]))


def box_patches(size=(1.0, 1.0, 1.0)):
    """The six bilinear faces of [0, a] x [0, b] x [0, c], outward."""
    corner = lambda i, j, k: (i * size[0], j * size[1], k * size[2])  # noqa: E731
    faces = []
    for axis in range(3):
        for end in (0, 1):
            net = []
            for s in (0, 1):
                row = []
                for t in (0, 1):
                    place = [s, t]
                    place.insert(axis, end)
                    row.append(corner(*place))
                net.append(row)
            outward = (end == 1) == (axis != 1)
            faces.append(BezierSurface(np.array(net) if outward else np.swapaxes(np.array(net), 0, 1)))
    return faces


def random_quilt(rng, m, n, degree=3):
    """m x n Bezier patches of a random B-spline surface over the unit square, each turned and mirrored at random."""
    from parametric import BSplineSurface

    x, y = np.meshgrid(np.arange(m + degree), np.arange(n + degree), indexing="ij")
    points = np.stack([x, y, np.zeros(x.shape)], axis=-1) + rng.uniform(-0.35, 0.35, (*x.shape, 3))
    quilt = []
    for patch in BSplineSurface(points, (degree, degree)).bezier_patches():
        net = patch.points
        if rng.random() < 0.5:
            net = np.swapaxes(net, 0, 1)
        if rng.random() < 0.5:
            net = net[::-1]
        if rng.random() < 0.5:
            net = net[:, ::-1]
        quilt.append(BezierSurface(net))
    return quilt


def moebius_patches():
    """Four bilinear patches of a strip with one side."""

    def across(k, w):
        t = k * np.pi / 2
        reach = 2 + w * np.cos(t / 2)
        return reach * np.cos(t), reach * np.sin(t), w * np.sin(t / 2)

    return [BezierSurface([[across(k, -1), across(k, 1)], [across(k + 1, -1), across(k + 1, 1)]]) for k in range(4)]


def pillow_patches(net, weights=None):
    """A patch with its boundary in z = 0 and its mirror image: a closed shell with an edge all round."""
    net = np.asarray(net, dtype=float)
    return [BezierSurface(net, weights), BezierSurface(net * [1, 1, -1], weights)]


def random_pillow(rng, rational=False):
    """A pillow of degrees 2 to 4 over a square that is not quite one."""
    p, q = rng.integers(2, 5, 2)
    net = np.stack(
        [*np.meshgrid(np.linspace(0, 1, p + 1), np.linspace(0, 1, q + 1), indexing="ij"), np.zeros((p + 1, q + 1))], -1
    )
    net[..., :2] += rng.uniform(-0.1, 0.1, (p + 1, q + 1, 2))
    net[1:-1, 1:-1, 2] = rng.uniform(0.1, 0.6, (p - 1, q - 1))
    return pillow_patches(net, np.exp(rng.normal(size=(p + 1, q + 1))) if rational else None)
