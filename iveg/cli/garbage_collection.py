"""Garbage collection of a program that runs for months.

A message creates a hundred short-lived values, none of them in a cycle.  Python
collects the youngest generation after each 700, and now and then all imported objects,
which blocks the event loop for tenths of a second.
"""

import gc

_YOUNG, _MIDDLE, _OLD = 20_000, 20, 50


def tune_garbage_collection() -> None:
    """Exclude all present objects from collection; call it when everything is built."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(_YOUNG, _MIDDLE, _OLD)
