"""Measurements of iVeg's cost and speed: ``python -m benchmarks``."""
