"""The detection rule at work: zones round people and peers, and the speed limits of robots."""
