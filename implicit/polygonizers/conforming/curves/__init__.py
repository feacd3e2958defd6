"""Singular curves: arcs, stations on them, tubes and zones round them, and ribbons."""
