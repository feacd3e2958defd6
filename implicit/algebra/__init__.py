"""Exact algebra: polynomials over Q and over real number fields, their factors, and exact values of expressions."""
