"""Parts whose failure harms nothing vital: history, map, messages, goals."""
