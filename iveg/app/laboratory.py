"""The door of the laboratory: where it is installed, its parts join iVeg here.

Nothing of the product imports ``iveg.lab``; the server's image is made without it.
"""

from importlib import import_module
from types import ModuleType


def find_laboratory(part: str) -> ModuleType | None:
    """A module of the laboratory by its name; None where there is no laboratory."""
    module = f"iveg.lab.{part}"
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name in ("iveg.lab", module):
            return None
        raise
