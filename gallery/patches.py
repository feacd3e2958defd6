"""Parametric surfaces of the catalogue."""

from gallery.catalog import Entry

PATCHES: tuple[Entry, ...] = ()
