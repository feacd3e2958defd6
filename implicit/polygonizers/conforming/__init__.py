"""Meshes of singular surfaces: the singular set is made of vertices and edges of the mesh."""

from implicit.polygonizers.conforming.assemble import conforming, conforming_if_singular

__all__ = ["conforming", "conforming_if_singular"]
