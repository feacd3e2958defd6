"""Splines: knots, basis functions, and the curves and surfaces that control points make."""
