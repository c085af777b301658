"""Parts that people like to have: each may fail, and nothing vital notices."""
