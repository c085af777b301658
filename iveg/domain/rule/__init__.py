"""The detection rule at work: zones round people and peers, and speed limits."""
