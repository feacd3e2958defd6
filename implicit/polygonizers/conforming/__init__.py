"""Meshes of singular surfaces: the singular set is made of vertices and edges of the mesh."""

from implicit.polygonizers.conforming.assemble import conforming

__all__ = ["conforming"]
