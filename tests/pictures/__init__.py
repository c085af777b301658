"""Fleets in situations, and what takes the pictures of docs/dashboard.md."""
