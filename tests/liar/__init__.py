"""One part lies by a seeded script while honest robots drive among people."""
