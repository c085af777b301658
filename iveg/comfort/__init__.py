"""What may fail by itself, and nothing vital notices: history, map, messages, goals."""
