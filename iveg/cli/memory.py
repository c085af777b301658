"""How often a program that runs for months looks for memory that nobody uses.

A message makes a hundred short-lived values, none of them in a cycle.  Python looks
through the youngest after each 700 of them, and now and then through everything that
was ever imported, which takes tenths of a second in which no robot is heard.
"""

import gc

_YOUNG, _MIDDLE, _OLD = 20_000, 20, 50


def settle_memory() -> None:
    """Call when everything is imported and built: it stays and is looked at no more."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(_YOUNG, _MIDDLE, _OLD)
