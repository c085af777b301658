"""Recordings of inputs, as MCAP (docs/interfaces/recordings.md)."""
