"""Singular points: balls and blocks round them, their links, and cones."""
