"""Benchmarks: tables of ratios against peers in one run. Never a test."""
