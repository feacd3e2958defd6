"""Cones refined towards their points: nearer to the surface, and the same in shape."""

import numpy as np
import pytest

from implicit import Mesh, Surface
from implicit.polygonizers.conforming import conforming
from implicit.polygonizers.conforming.points.inward import _LEVELS, refine_inwards
from tests.singular_cases import topology

CURVED = ["x^2 + y^2 = z^3", "x^2 + y^2 = z^4", "x^2 + y^2*z - z^3", "x^2 + y^2 = z^2 + z^3"]


@pytest.fixture(autouse=True)
def not_mended(monkeypatch: pytest.MonkeyPatch) -> None:
    """Halved sides have tests of their own; here they would stand between the spheres."""
    monkeypatch.setattr("implicit.polygonizers.conforming.draw.mend", lambda local, mesh, fixed: mesh)


def unrefined(surface: Surface, monkeypatch: pytest.MonkeyPatch) -> Mesh:
    place = "implicit.polygonizers.conforming.draw.refine_inwards"
    with monkeypatch.context() as patch:
        patch.setattr(place, lambda local, mesh, special, fixed: mesh)
        return conforming(surface, 0.8, 32)


def spokes(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """The ends of the edges from special points to vertices that are not on singular curves."""
    fixed = set(np.concatenate([mesh.points, *mesh.curves]).tolist())
    pairs = {(p, v) for face in mesh.faces.tolist() for p in face for v in face if p in mesh.points and v not in fixed}
    ends = np.array(sorted(pairs))
    return mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]


def beside(surface: Surface, points: np.ndarray) -> np.ndarray:
    """The distance of points from the surface to first order."""
    value, slope = surface.field.gradients(points)
    return np.abs(value) / np.linalg.norm(slope, axis=1)


@pytest.mark.parametrize("formula", CURVED)
def test_cones_come_nearer_to_the_surface_and_keep_their_shape(formula, monkeypatch):
    surface = Surface(formula)
    before, after = unrefined(surface, monkeypatch), conforming(surface, 0.8, 32)
    assert topology(after) == topology(before) and len(after.unresolved) == 0
    assert len(after.faces) > len(before.faces)
    (p, a), (q, b) = spokes(before), spokes(after)
    assert np.median(beside(surface, (q + b) / 2)) < 0.35 * np.median(beside(surface, (p + a) / 2))
    assert beside(surface, b).max() < 1e-10
    lengths = np.linalg.norm(a - p, axis=1)[:, None] / 2.0 ** np.arange(_LEVELS + 1)
    gaps = np.abs(np.linalg.norm(b - q, axis=1)[:, None] / lengths.ravel() - 1)
    assert gaps.min(axis=1).max() < 1e-9


def test_a_straight_cone_stays_as_it_is(monkeypatch):
    surface = Surface("x^2 + 2*y^2 = z^2 + x*z")
    before, after = unrefined(surface, monkeypatch), conforming(surface, 0.8, 32)
    assert np.array_equal(before.faces, after.faces) and np.array_equal(before.vertices, after.vertices)


def test_cones_that_share_a_face_stay_as_they_are():
    mesh = (np.eye(3), np.eye(3), np.array([[0, 1, 2]]))
    refined = refine_inwards(None, mesh, np.array([0, 1]), np.array([True, True, False]))
    assert all(np.array_equal(one, other) for one, other in zip(refined, mesh, strict=True))


def test_faces_that_are_turned_from_the_start_do_not_keep_the_search_going():
    """Only faces that halving would turn give up their spokes; those that faced away before stay as they are."""
    surface = Surface("x^2 + y^2 = z^3")
    place = "implicit.polygonizers.conforming.draw.refine_inwards"
    taken = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(place, lambda *arguments: taken.append(arguments) or arguments[1])
        conforming(surface, 0.8, 32)
    local, (vertices, normals, faces), special, fixed = taken[0]
    rim = next(int(v) for face in faces.tolist() if special[0] in face for v in face if v != special[0])
    normals[rim] *= -1
    refined = refine_inwards(local, (vertices, normals, faces), special, fixed)
    assert len(refined[2]) > len(faces)
