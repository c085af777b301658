"""Recordings of what came in, as MCAP (docs/interfaces/recordings.md)."""
