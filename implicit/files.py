"""Mesh files: STL, PLY, OBJ, GLB, VTP and, with the extra `print`, 3MF.

A file is written beside its destination and renamed, so a reader never meets half of one. PLY, OBJ and VTP hold
the coordinates exactly; STL, GLB and 3MF hold them in single precision.
"""

import base64
import ctypes
import json
import os
import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from implicit.errors import wrong_kind
from implicit.mesh import Mesh

Array = NDArray[np.generic]
Corners = NDArray[np.float32]
Faces = NDArray[np.int64]


def save(mesh: Mesh, path: str | os.PathLike[str]) -> Path:
    """Write `mesh` to `path` in the format its suffix names, and return the path.

    | suffix | coordinates | normals | singular curves | special points |
    |--------|-------------|---------|-----------------|----------------|
    | .ply   | double      | yes     | edges           | -              |
    | .obj   | double      | yes     | `l`             | `p`            |
    | .vtp   | double      | yes     | lines           | vertices       |
    | .glb   | single      | yes     | lines           | points         |
    | .stl   | single      | faces   | -               | -              |
    | .3mf   | single      | -       | -               | -              |

    Single precision moves a vertex by up to 6e-8 of its coordinates. Triangles that shrink to a segment on the way
    are left out together with what they joined, so the file of a closed mesh is closed. 3MF and STL lengths are
    read as millimetres. An existing file is replaced; on an error it stays as it was.

    Raises ValueError for an unknown suffix, TypeError for what is no Mesh and ImportError for 3MF without lib3mf.

    >>> import tempfile
    >>> from implicit.mesh import Mesh
    >>> tetrahedron = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(tetrahedron, Path(folder) / "tetrahedron.stl").stat().st_size
    284
    """
    if not isinstance(mesh, Mesh):
        raise wrong_kind("a Mesh", mesh)
    path = Path(path)
    check_suffix(path)
    write = _WRITERS[path.suffix.lower()]
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as stream:
            write(mesh, stream)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return path


def check_suffix(path: str | os.PathLike[str]) -> None:
    """Raise ValueError unless a mesh can be saved in the format that the suffix of `path` names."""
    if Path(path).suffix.lower() not in _WRITERS:
        known = " ".join(sorted(_WRITERS))
        raise ValueError(f"a mesh is saved by suffix, one of {known}; got {Path(path).name!r}")


def round_to_single(vertices: ArrayLike, faces: ArrayLike) -> tuple[Corners, Faces]:
    """Vertices (V, 3) in single precision and the faces (F', 3) that keep three distinct corners.

    Vertices joined by an edge that rounds to a point become one; collapsed triangles are dropped, and so are pairs of
    triangles left back to back. Each step keeps the boundary of the mesh, hence a closed mesh closed.
    """
    with np.errstate(over="ignore"):
        corners = np.ascontiguousarray(vertices, dtype="<f4").reshape(-1, 3)
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if not np.isfinite(corners).all():
        raise ValueError("a mesh in a single-precision file needs coordinates below 3.4e38, got larger ones")
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    short = edges[(corners[edges[:, 0]] == corners[edges[:, 1]]).all(axis=1)]
    if not len(short):
        return corners, triangles
    name = np.arange(len(corners))
    while (name[short[:, 0]] != name[short[:, 1]]).any():
        np.minimum.at(name, short.ravel(), name[short[:, ::-1]].ravel())
    triangles = name[triangles]
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return corners, _without_back_to_back(triangles[distinct])


def _without_back_to_back(triangles: Faces) -> Faces:
    """The triangles that remain when those with equal corners and opposite orientation cancel in pairs."""
    ordered = np.sort(triangles, axis=1)
    turned = [(triangles == np.roll(ordered, shift, axis=1)).all(axis=1) for shift in range(3)]
    sign = np.where(np.any(turned, axis=0), 1, -1)
    group = np.unique(ordered, axis=0, return_inverse=True)[1].ravel()
    total = np.bincount(group, weights=sign).astype(np.int64)[group]
    kind = 2 * group + (sign > 0)
    order = np.argsort(kind, kind="stable")
    counts = np.bincount(kind)
    rank = np.empty(len(kind), dtype=np.int64)
    rank[order] = np.arange(len(kind)) - (np.cumsum(counts) - counts)[kind[order]]
    return triangles[(sign * total > 0) & (rank < abs(total))]


def _normals(mesh: Mesh) -> Corners:
    """Unit normals in single precision; zero where the mesh has none (singular points)."""
    normals = np.nan_to_num(np.asarray(mesh.normals, dtype=float))
    return np.ascontiguousarray(normals, dtype="<f4")


def _segments(mesh: Mesh) -> Faces:
    """The edges (n, 2) of the singular curves."""
    pieces = [np.column_stack([curve[:-1], curve[1:]]) for curve in mesh.curves if len(curve) > 1]
    return np.concatenate(pieces).astype(np.int64) if pieces else np.empty((0, 2), dtype=np.int64)


def _write_stl(mesh: Mesh, stream: BinaryIO) -> None:
    vertices, faces = round_to_single(mesh.vertices, mesh.faces)
    corners = vertices[faces]
    wide = corners.astype(float)
    normals = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    rows = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["normal"] = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    rows["corners"] = corners
    stream.write(b"binary STL, lengths in mm".ljust(80) + struct.pack("<I", len(rows)))
    stream.write(rows.tobytes())


def _write_ply(mesh: Mesh, stream: BinaryIO) -> None:
    points = np.zeros(len(mesh.vertices), dtype=[("position", "<f8", 3), ("normal", "<f4", 3)])
    points["position"], points["normal"] = mesh.vertices, _normals(mesh)
    faces = np.zeros(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    edges = _segments(mesh).astype("<i4")
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property double {axis}" for axis in "xyz"] + [f"property float n{axis}" for axis in "xyz"]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    if len(edges):
        header += [f"element edge {len(edges)}", "property int vertex1", "property int vertex2"]
    stream.write(("\n".join(header) + "\nend_header\n").encode())
    for rows in (points, faces, edges):
        stream.write(rows.tobytes())


def _write_obj(mesh: Mesh, stream: BinaryIO) -> None:
    def lines(pattern: str, table: Array) -> None:
        stream.write("".join(map(pattern.format, *table.T.tolist())).encode())

    stream.write(b"# vertices, normals, triangles, curves (l), special points (p)\n")
    lines("v {} {} {}\n", np.asarray(mesh.vertices, dtype=float))
    lines("vn {:.7g} {:.7g} {:.7g}\n", _normals(mesh))
    lines("f {0}//{0} {1}//{1} {2}//{2}\n", np.asarray(mesh.faces) + 1)
    for curve in mesh.curves:
        if len(curve) > 1:
            stream.write(f"l {' '.join(map(str, (np.asarray(curve) + 1).tolist()))}\n".encode())
    for point in np.asarray(mesh.points, dtype=np.int64).tolist():
        stream.write(f"p {point + 1}\n".encode())


def _write_vtp(mesh: Mesh, stream: BinaryIO) -> None:
    def array(values: Array, kind: str, name: str, components: int = 1) -> str:
        raw = np.ascontiguousarray(values).tobytes()
        text = base64.b64encode(struct.pack("<Q", len(raw)) + raw).decode()
        kind = f'type="{kind}" Name="{name}" NumberOfComponents="{components}"'
        return f'<DataArray {kind} format="binary">{text}</DataArray>'

    def cells(tag: str, groups: Sequence[Array]) -> str:
        flat = np.concatenate([np.ravel(group) for group in groups] or [np.empty(0)]).astype("<i8")
        ends = np.cumsum([len(group) for group in groups], dtype="<i8")
        return f"<{tag}>{array(flat, 'Int64', 'connectivity')}{array(ends, 'Int64', 'offsets')}</{tag}>"

    curves = [np.asarray(curve) for curve in mesh.curves if len(curve) > 1]
    points = [np.array([index]) for index in np.asarray(mesh.points, dtype=np.int64)]
    counts = (len(mesh.vertices), len(points), len(curves), len(mesh.faces))
    names = ("NumberOfPoints", "NumberOfVerts", "NumberOfLines", "NumberOfPolys")
    sizes = " ".join(f'{name}="{count}"' for name, count in zip(names, counts, strict=True))
    body = [
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        f'<PolyData><Piece {sizes} NumberOfStrips="0">',
        f'<PointData Normals="Normals">{array(_normals(mesh), "Float32", "Normals", 3)}</PointData>',
        f"<Points>{array(np.asarray(mesh.vertices, dtype='<f8'), 'Float64', 'Points', 3)}</Points>",
        cells("Verts", points),
        cells("Lines", curves),
        cells("Polys", list(np.asarray(mesh.faces))),
        "</Piece></PolyData></VTKFile>\n",
    ]
    stream.write("\n".join(body).encode())


def _write_glb(mesh: Mesh, stream: BinaryIO) -> None:
    positions, faces = round_to_single(mesh.vertices, mesh.faces)
    parts = [(4, faces), (1, _segments(mesh)), (0, mesh.points)]  # triangles, lines, points
    parts = [(mode, indices.ravel().astype("<u4")) for mode, indices in parts if indices.size]
    scene: dict[str, object] = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{}]}
    binary = b""
    if parts:
        arrays: list[Array] = [positions, _unit(_normals(mesh)), *(indices for _, indices in parts)]
        binary = b"".join(array.tobytes() for array in arrays)
        primitives = [
            {
                "attributes": {"POSITION": 0, "NORMAL": 1} if mode == 4 else {"POSITION": 0},
                "indices": 2 + number,
                "mode": mode,
                "material": int(mode != 4),
            }
            for number, (mode, _) in enumerate(parts)
        ]
        scene |= {"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": primitives}]}
        scene |= {"materials": _MATERIALS, "buffers": [{"byteLength": len(binary)}], **_layout(arrays)}
    text = json.dumps(scene).encode()
    chunks = [(text + b" " * (-len(text) % 4), b"JSON")] + ([(binary, b"BIN\0")] if parts else [])
    stream.write(struct.pack("<4sII", b"glTF", 2, 12 + sum(8 + len(chunk) for chunk, _ in chunks)))
    for chunk, tag in chunks:
        stream.write(struct.pack("<I4s", len(chunk), tag) + chunk)


def _layout(arrays: list[Array]) -> dict[str, object]:
    """Where each array of a GLB file begins, and what it holds: positions, normals, then indices."""
    starts = np.cumsum([0] + [array.nbytes for array in arrays]).tolist()
    views: list[dict[str, int]] = []
    accessors: list[dict[str, object]] = []
    for number, array in enumerate(arrays):
        flat = array.ndim == 1
        view = {
            "buffer": 0,
            "byteOffset": starts[number],
            "byteLength": array.nbytes,
            "target": 34963 if flat else 34962,
        }
        views.append(view)
        kind = {"componentType": 5125, "type": "SCALAR"} if flat else {"componentType": 5126, "type": "VEC3"}
        accessors.append({"bufferView": number, "count": len(array), **kind})
    accessors[0] |= {"min": arrays[0].min(axis=0).tolist(), "max": arrays[0].max(axis=0).tolist()}
    return {"bufferViews": views, "accessors": accessors}


def _unit(normals: Corners) -> Corners:
    """Normals with every zero replaced by +z, since glTF wants unit vectors."""
    missing = (normals == 0).all(axis=1)
    return np.where(missing[:, None], np.array([0, 0, 1], dtype="<f4"), normals)


_MATERIALS = [
    {
        "doubleSided": True,
        "pbrMetallicRoughness": {"baseColorFactor": [0.10, 0.30, 0.55, 1], "metallicFactor": 0, "roughnessFactor": 0.5},
    },
    {"pbrMetallicRoughness": {"baseColorFactor": [0.85, 0.05, 0.05, 1], "metallicFactor": 0}},
]


def _write_3mf(mesh: Mesh, stream: BinaryIO) -> None:
    try:
        import lib3mf
    except ImportError:
        raise ImportError("3MF files need lib3mf: install the extra `print`, or save as .stl or .ply") from None
    vertices, faces = round_to_single(mesh.vertices, mesh.faces)
    model = lib3mf.get_wrapper().CreateModel()
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    thing = model.AddMeshObject()
    thing.SetGeometry(
        [lib3mf.Position((ctypes.c_float * 3)(*point)) for point in vertices.tolist()],
        [lib3mf.Triangle((ctypes.c_uint32 * 3)(*face)) for face in faces.tolist()],
    )
    if not thing.IsManifoldAndOriented():
        thing.SetType(lib3mf.ObjectType.Surface)
    model.AddBuildItem(thing, lib3mf.get_wrapper().GetIdentityTransform())
    stream.write(bytes(model.QueryWriter("3mf").WriteToBuffer()))


_WRITERS: dict[str, Callable[[Mesh, BinaryIO], None]] = {
    ".stl": _write_stl,
    ".ply": _write_ply,
    ".obj": _write_obj,
    ".glb": _write_glb,
    ".vtp": _write_vtp,
    ".3mf": _write_3mf,
}
