"""A moment of the past that a page is shown."""

import json
from collections.abc import Callable

from playwright.sync_api import Page, Route

from tests.e2e.frozen import NOW, Frozen

PAST_AT = "2026-11-21T03:30:00Z"
PAST = f"/?t={PAST_AT}"


def prepare(page: Page, told: Frozen) -> None:
    """What a page of the past needs before it is opened."""
    page.route("**/api/v1/world*", _then(told))


def _then(told: Frozen) -> Callable[[Route], None]:
    """A recorded moment, at which the fleet was as it is now."""
    seen = told["snapshot"]
    world = {
        **{k: v for k, v in seen.items() if k not in ("t", "server", "user")},
        "at": PAST_AT,
        "at_s": NOW - 80.2,
        "left_out": [],
        "scans": [],
    }
    return lambda route: route.fulfill(
        body=json.dumps(world), content_type="application/json"
    )
