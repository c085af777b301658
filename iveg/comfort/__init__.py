"""Parts that may fail alone, unnoticed by vital ones: history, map, messages, goals."""
