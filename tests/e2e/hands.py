"""What a person does at the page with a robot: let it go again."""

from contextlib import suppress
from typing import Any

from playwright import sync_api
from playwright.sync_api import APIResponse, BrowserContext, Locator, Page, expect

from tests.e2e.reading import card
from tests.patience import AGAIN
from tests.processes import Site, until

HELD_MS = 2300
"""How long the release is held, and a little more."""
_OWN = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}


def open_menu(page: Page, robot: str) -> None:
    """Open the menu of a robot's card; that of a card that moves is closed again."""
    panel = card(page, robot).locator("dialog[open]")

    def is_open() -> bool:
        press_open(page, card(page, robot).locator(".card__menu"))
        if panel.is_visible():
            return True
        # Cards changed places, and it is another's: no card moves while it is open.
        page.keyboard.press("Escape")
        return False

    until(is_open, f"the menu of {robot} opens")


def press_open(page: Page, opener: Locator) -> None:
    """Press until a panel is open, as a person does.

    Cards grow and lose lines: on a busy machine a button may move away between the
    finger's down and up, and that press then meets nothing.
    """

    def is_open() -> bool:
        # One that opened late lies over its button.
        if page.locator("dialog[open]").count() == 0:
            opener.click()
        with suppress(sync_api.TimeoutError):
            page.wait_for_selector("dialog[open]", timeout=1000)
            return True
        return False

    until(is_open, "a panel opens")


def begin_hold(page: Page, button: Locator) -> None:
    """Put a finger down on a button that has to be held, and leave it there.

    What moves the button away before the finger is down makes a person try again.
    """

    def is_held() -> bool:
        page.mouse.up()
        button.hover()
        page.mouse.down()
        return button.get_attribute("data-holding") is not None

    until(is_held, "a button is held")


def hold(page: Page, button: Locator, done: Locator) -> None:
    """Hold a button until its fill is full, again where it gave way, until ``done`` may
    be pressed."""

    def is_done() -> bool:
        if button.is_enabled():
            begin_hold(page, button)
            expect(button).not_to_have_attribute("data-holding", "")
            page.mouse.up()
        with suppress(AssertionError):
            expect(done).to_be_enabled(timeout=2000)
            return True
        return False

    until(is_done, "what is held is done")


def ask(
    who: Page | BrowserContext, stack: Site, path: str, body: object
) -> APIResponse:
    """What the page would send, under its own session."""
    url = f"{stack.url}/api/v1/{path}"
    return who.request.post(url, data=body, headers=_OWN, max_retries=AGAIN)


def look(who: Page | BrowserContext, stack: Site, robot: str) -> dict[str, Any]:
    """What the server says of a robot."""
    return _get(who, stack, f"robots/{robot}")


def let_go(who: Page | BrowserContext, stack: Site, robot: str) -> None:
    """Release and resume a robot until nothing stops it; a refusal is tried again.

    None is asked for while another is under way, which would outlast this call.
    """

    def is_over(answer: APIResponse) -> bool:
        path = f"commands/{answer.json()['command_id']}"
        return bool(_get(who, stack, path)["state"] != "RELEASING")

    def is_free() -> bool:
        seen = look(who, stack, robot)
        holds = [hold["id"] for hold in seen["holds"]]
        if seen["stop_state"] == "READY":
            answer = ask(who, stack, f"robots/{robot}/resume", {})
        elif holds:
            answer = ask(who, stack, f"robots/{robot}/release", {"holds": holds})
        else:
            return bool(seen["stop_state"] == "RUNNING")
        if answer.ok:
            until(lambda: is_over(answer), f"the order to {robot} is over")
        return False

    until(is_free, f"{robot} is free")


def _get(who: Page | BrowserContext, stack: Site, path: str) -> dict[str, Any]:
    url = f"{stack.url}/api/v1/{path}"
    found: dict[str, Any] = who.request.get(url, max_retries=AGAIN).json()
    return found
