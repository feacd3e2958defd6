"""What is written can be read back by others, and closed meshes stay closed on the way."""

import json
import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from implicit.files import round_to_single, save
from implicit.mesh import Mesh
from implicit.surface import Surface

SUFFIXES = (".stl", ".ply", ".obj", ".glb", ".vtp")


def octahedron(levels: int = 3) -> Mesh:
    """A sphere from an octahedron, each triangle cut in four `levels` times."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(levels):
        sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, index = np.unique(sides, axis=0, return_inverse=True)
        middle = len(vertices) + index.reshape(-1, 3)
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        a, b, c, ab, bc, ca = *faces.T, *middle.T
        faces = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    return Mesh(vertices, faces, normals=vertices, curves=[[0, 2, 1]], points=[4, 5])


def boundary(faces: np.ndarray) -> int:
    """How many directed edges are not met by their opposite."""
    pairs: dict[tuple[int, int], int] = {}
    for a, b in faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist():
        if pairs.get((b, a), 0):
            pairs[(b, a)] -= 1
        else:
            pairs[(a, b)] = pairs.get((a, b), 0) + 1
    return sum(pairs.values())


def weld(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a soup (F, 3, 3), equal points made one."""
    vertices, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def read_stl(path: Path) -> np.ndarray:
    """Corners (F, 3, 3) of a binary STL."""
    data = path.read_bytes()
    rows = np.frombuffer(data[84:], dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    assert len(rows) == struct.unpack("<I", data[80:84])[0]
    return rows["c"]


def read_glb(path: Path) -> tuple[dict, list[np.ndarray]]:
    """The JSON part and the arrays of a GLB, laid out as its accessors say."""
    data = path.read_bytes()
    magic, version, length, size = struct.unpack("<4sIII", data[:16])
    assert (magic, version, length) == (b"glTF", 2, len(data))
    scene = json.loads(data[20 : 20 + size])
    binary = data[28 + size :]
    assert data[24 + size : 28 + size] == b"BIN\0"
    assert scene["buffers"][0]["byteLength"] == len(binary) == struct.unpack("<I", data[20 + size : 24 + size])[0]
    arrays = []
    for accessor in scene["accessors"]:
        view = scene["bufferViews"][accessor["bufferView"]]
        part = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        wide = accessor["type"] == "VEC3"
        array = np.frombuffer(part, dtype="<f4" if accessor["componentType"] == 5126 else "<u4")
        arrays.append(array.reshape(-1, 3) if wide else array)
        assert accessor["count"] == len(arrays[-1])
    return scene, arrays


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".vtp"])
def test_vtk_reads_back_the_same_closed_surface(suffix: str, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    mesh = octahedron()
    if suffix == ".obj":  # VTK's reader keeps no `l` and `p`
        mesh = Mesh(mesh.vertices, mesh.faces, mesh.normals)
    read = pyvista.read(save(mesh, tmp_path / f"sphere{suffix}"))
    vertices, faces = weld(np.asarray(read.points)[read.regular_faces])
    assert faces.shape == mesh.faces.shape
    assert boundary(faces) == 0
    assert len(vertices) == len(mesh.vertices)
    assert Mesh(vertices, faces).volume == pytest.approx(mesh.volume, rel=1e-6)
    if suffix == ".vtp":
        assert np.array_equal(read.points, mesh.vertices)
        assert np.allclose(read.point_data["Normals"], mesh.normals, atol=1e-7)
        assert read.lines.tolist() == [3, 0, 2, 1]
        assert read.verts.tolist() == [1, 4, 1, 5]
    if suffix in (".ply", ".obj"):
        assert np.allclose(read.point_data["Normals"], read.points, atol=1e-6)


def test_glb_holds_triangles_lines_points_and_unit_normals(tmp_path: Path) -> None:
    mesh = octahedron()
    scene, (positions, normals, faces, lines, points) = read_glb(save(mesh, tmp_path / "sphere.glb"))
    assert [part["mode"] for part in scene["meshes"][0]["primitives"]] == [4, 1, 0]
    assert np.array_equal(positions, mesh.vertices.astype("f4"))
    assert np.array_equal(faces.reshape(-1, 3), mesh.faces)
    assert lines.tolist() == [0, 2, 2, 1]
    assert points.tolist() == [4, 5]
    assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    assert scene["accessors"][0]["min"] == [-1, -1, -1]


def test_obj_and_ply_keep_every_bit_of_the_coordinates(tmp_path: Path) -> None:
    mesh = octahedron()
    rows = save(mesh, tmp_path / "a.obj").read_text().splitlines()
    vertices = np.array([row.split()[1:] for row in rows if row.startswith("v ")], dtype=float)
    faces = np.array([[item.split("//")[0] for item in row.split()[1:]] for row in rows if row.startswith("f ")], int)
    assert np.array_equal(vertices, mesh.vertices)
    assert np.array_equal(faces - 1, mesh.faces)
    assert [row for row in rows if row[0] in "lp"] == ["l 1 3 2", "p 5", "p 6"]
    header, body = save(mesh, tmp_path / "a.ply").read_bytes().split(b"end_header\n", 1)
    points = np.frombuffer(body, dtype=[("p", "<f8", 3), ("n", "<f4", 3)], count=len(mesh.vertices))
    assert np.array_equal(points["p"], mesh.vertices)
    assert b"element edge 2" in header
    assert np.frombuffer(body[-16:], "<i4").tolist() == [0, 2, 2, 1]


@settings(max_examples=30, deadline=None)
@given(st.floats(1e-9, 1.0), st.tuples(*[st.floats(-100, 100)] * 3))
def test_rounding_keeps_a_closed_mesh_closed(scale: float, shift: tuple[float, float, float]) -> None:
    """Small spheres far from the origin lose most of their vertices in single precision, but never get a hole."""
    mesh = octahedron(2)
    corners, faces = round_to_single(mesh.vertices * scale + np.array(shift), mesh.faces)
    assert boundary(faces) == 0
    assert boundary(weld(corners[faces])[1]) == 0
    assert all(len(set(map(tuple, triangle))) == 3 for triangle in corners[faces].tolist())


def test_rounding_changes_no_connection_when_nothing_collapses() -> None:
    mesh = octahedron(1)
    assert np.array_equal(round_to_single(mesh.vertices, mesh.faces)[1], mesh.faces)


def test_a_closed_mesh_written_as_stl_is_closed(tmp_path: Path) -> None:
    mesh = octahedron(3)
    squashed = Mesh(mesh.vertices * [1, 1, 1e-7] + [50, 0, 1], mesh.faces)
    assert boundary(weld(read_stl(save(squashed, tmp_path / "thin.stl")))[1]) == 0


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_an_empty_mesh_is_a_valid_file(suffix: str, tmp_path: Path) -> None:
    path = save(Mesh([], []), tmp_path / f"empty{suffix}")
    assert path.stat().st_size > 0
    if suffix == ".stl":
        assert len(read_stl(path)) == 0


def test_a_node_without_a_normal_still_has_unit_normals_in_glb(tmp_path: Path) -> None:
    mesh = octahedron(1)
    normals = mesh.normals.copy()
    normals[0] = 0
    _, arrays = read_glb(save(Mesh(mesh.vertices, mesh.faces, normals), tmp_path / "node.glb"))
    assert np.allclose(np.linalg.norm(arrays[1], axis=1), 1, atol=1e-6)


def test_an_unknown_suffix_names_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"one of \.3mf \.glb \.obj \.ply \.stl \.vtp; got 'a\.step'"):
        save(octahedron(0), tmp_path / "a.step")


def test_only_meshes_are_saved(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="a Mesh was wanted, got Surface"):
        save(Surface("x"), tmp_path / "a.stl")  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    path.write_text("old")
    with pytest.raises(ValueError, match="single-precision"):
        save(Mesh(octahedron(0).vertices * 1e39, octahedron(0).faces), path)
    assert path.read_text() == "old"
    assert [item.name for item in tmp_path.iterdir()] == ["a.stl"]


def test_3mf_without_its_library_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lib3mf", None)
    with pytest.raises(ImportError, match="extra `print`"):
        save(octahedron(0), tmp_path / "a.3mf")
    assert not list(tmp_path.iterdir())


def test_3mf_is_read_back_as_a_solid_in_millimetres(tmp_path: Path) -> None:
    lib3mf = pytest.importorskip("lib3mf")
    mesh = octahedron(2)
    model = lib3mf.get_wrapper().CreateModel()
    model.QueryReader("3mf").ReadFromFile(str(save(mesh, tmp_path / "a.3mf")))
    assert model.GetUnit() == lib3mf.ModelUnit.MilliMeter
    things = model.GetMeshObjects()
    assert things.MoveNext()
    thing = things.GetCurrentMeshObject()
    assert thing.IsManifoldAndOriented()
    assert (thing.GetVertexCount(), thing.GetTriangleCount()) == (len(mesh.vertices), len(mesh.faces))
