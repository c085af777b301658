"""How it stands with a robot: one truth, which every surface says."""
