"""Surfaces that a moving curve makes: sweeps and revolution."""
