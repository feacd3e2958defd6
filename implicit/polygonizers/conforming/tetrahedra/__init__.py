"""Tetrahedra near the singular set: their cells, vertices, refinement and triangles."""
