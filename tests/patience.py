"""How long a test waits before it gives up: a busy machine is slow without being wrong.

What must be quick has a limit of its own.
"""

PATIENCE_S = 120.0
PATIENCE_MS = 1000 * PATIENCE_S

AGAIN = 1
"""Requests of the driver's own: it keeps connections, and may write on one that the
server has just closed."""
