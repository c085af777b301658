"""Plotly's script for the browser, packed and named by its content."""

import gzip
import hashlib
import importlib.resources
import re
from dataclasses import dataclass
from functools import cache
from typing import Any

_BUNDLE = "plotly-basic.min.js"
_STYLE_ID = re.compile(rb'getElementById\("([0-9a-f]{64})"\)')


@dataclass(frozen=True, slots=True)
class Library:
    """Plotly for the browser.

    Attributes:
        name: Changes with the content, so that a browser may keep it for good.
        packed: The script, gzipped.
        style_ids: Style elements that it makes unless one of that id is there; a page
            whose policy refuses them has to put something in their place first.
    """

    name: str
    packed: bytes
    style_ids: tuple[str, ...] = ()


@cache
def library() -> Library:
    """The script beside the page; the first call takes a while."""
    data = importlib.resources.files("iveg") / "static" / "vendor" / _BUNDLE
    script = data.read_bytes()
    digest = hashlib.sha256(script).hexdigest()[:16]
    # The sheets that parts of the library bring along are named by their hash.
    hashes = sorted({found.decode() for found in _STYLE_ID.findall(script)})
    packed = gzip.compress(script, 6, mtime=0)
    style_ids = ("plotly.js-style-global", *hashes)
    return Library(f"plotly-{digest}.min.js", packed, style_ids)


def library_facts() -> dict[str, Any]:
    """Address of the script that draws figures, and what a strict page must hold."""
    found = library()
    return {"library": f"/vendor/{found.name}", "style_ids": list(found.style_ids)}
