"""Parts that may fail by themselves, and nothing vital notices: history, map, messages, goals."""
