"""Parts that may fail, and nothing vital notices: history, map, messages, goals."""
