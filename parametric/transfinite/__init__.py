"""Surfaces through whole curves: ruled, lofted, Coons and Gordon."""
