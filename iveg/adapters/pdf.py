"""A page of HTML as PDF, by the machine's own Chromium where there is one."""

import logging
import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from shutil import which

_log = logging.getLogger(__name__)
_NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
LIMIT_S = 20.0
_FLAGS = (
    "--headless",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-pdf-header-footer",
)


def find_browser() -> str | None:
    """Where a Chromium is; None without one."""
    return next((found for name in _NAMES if (found := which(name))), None)


def print_pdf(browser: str, html: bytes) -> bytes | None:
    """The page as PDF; None where the browser fails or hangs, which is logged.

    Args:
        browser: Its program.
        html: A page of our own, which has no scripts and asks for nothing.
    """
    with tempfile.TemporaryDirectory(prefix="iveg-pdf-") as name:
        folder = Path(name)
        (folder / "page.html").write_bytes(html)
        try:
            subprocess.run(  # noqa: S603 - a program of the machine, and our own page
                _command(browser, folder),
                check=True,
                timeout=LIMIT_S,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            return (folder / "page.pdf").read_bytes()
        except (OSError, subprocess.SubprocessError) as error:
            _log.warning("%s made no PDF: %s", browser, error)
            return None


def _command(browser: str, folder: Path) -> Sequence[str]:
    # Its sandbox needs another user than root; a container has no other.
    rights = ("--no-sandbox",) if os.geteuid() == 0 else ()
    return (
        browser,
        *_FLAGS,
        *rights,
        f"--user-data-dir={folder / 'profile'}",
        f"--print-to-pdf={folder / 'page.pdf'}",
        (folder / "page.html").as_uri(),
    )
