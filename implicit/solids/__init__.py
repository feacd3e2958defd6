"""Solids: ordinary shapes, and solids made from solids."""
