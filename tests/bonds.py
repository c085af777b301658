"""Programs that never outlive the test that started them."""

import shutil

_SETPRIV = shutil.which("setpriv")
"""Of Linux (util-linux); elsewhere an interrupted test may leave programs behind."""


def bound(*words: str) -> list[str]:
    """A command line whose program is killed where its parent dies, however it dies.

    Fixtures end what they began, unless pytest itself is killed.  What has stopped dies
    of this as well.  The kernel forgets it where a program changes its user.
    """
    return [_SETPRIV, "--pdeathsig", "KILL", *words] if _SETPRIV else [*words]
