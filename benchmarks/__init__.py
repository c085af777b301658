"""What iVeg costs and how fast it is, measured: ``python -m benchmarks``."""
