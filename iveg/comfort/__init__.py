"""Parts that people like to have: each may fail by itself, and nothing vital notices."""
