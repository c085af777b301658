"""A person with a browser who stops, releases and resumes while things break."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import httpx

from tests.chaos.witness import Witness
from tests.processes import NO_TLS, Site, until

_LIMIT_S = 10.0


class Person:
    """Signs in again whenever iVeg has forgotten who it was."""

    def __init__(self, place: Site, witness: Witness) -> None:
        self._place = place
        self._witness = witness
        self._browser = self._new_browser()

    def close(self) -> None:
        self._browser.close()

    def press(self, robot_id: str | None = None) -> bool:
        """STOP; whether it was accepted."""
        path = "fleet/stop" if robot_id is None else f"robots/{robot_id}/stop"
        return self._post(path, {}) == 202

    def release(self, robot_id: str) -> bool:
        """Lift what the page shows; whether that was accepted."""
        robot = self.look(robot_id)
        holds = [hold["id"] for hold in (robot or {}).get("holds", [])]
        return bool(holds) and self._post(f"robots/{robot_id}/release", holds) == 202

    def resume(self, robot_id: str) -> bool:
        robot = self._witness.of(robot_id)
        if self.state(robot_id) == "READY":
            # The witness hears the same reports, maybe later than iVeg, and would take
            # one from before the release for a hold that came after this.
            with suppress(AssertionError):
                until(lambda: not robot.held, f"{robot_id} is seen free", _LIMIT_S)
        self._witness.allow(robot_id)
        return self._post(f"robots/{robot_id}/resume", {}) == 202

    def look(self, robot_id: str) -> dict[str, Any] | None:
        """What the page says of a robot; None where there is no page."""
        answer = self._ask(lambda: self._browser.get(f"/api/v1/robots/{robot_id}"))
        if answer is None or answer.status_code != 200:
            return None
        found: dict[str, Any] = answer.json()
        return found

    def state(self, robot_id: str) -> str:
        robot = self.look(robot_id)
        return "" if robot is None else str(robot["stop_state"])

    def wait_for(self, robot_id: str, state: str) -> None:
        until(lambda: self.state(robot_id) == state, f"{robot_id} is {state}")

    def let_go(self, robot_id: str) -> None:
        """Release and resume until it drives; a refusal is tried again."""

        def step() -> bool:
            if self.state(robot_id) == "READY" or not self._witness.of(robot_id).held:
                self.resume(robot_id)
            else:
                self.release(robot_id)
            return self._witness.of(robot_id).speed > 0.1

        until(step, f"{robot_id} drives")

    def _post(self, path: str, body: object) -> int:
        words = {"holds": body} if isinstance(body, list) else body
        answer = self._ask(lambda: self._browser.post(f"/api/v1/{path}", json=words))
        return 0 if answer is None else answer.status_code

    def _ask(self, asking: Callable[[], httpx.Response]) -> httpx.Response | None:
        try:
            answer = asking()
            if answer.status_code == 401:
                self._browser.post("/signin", json=self._place.proof)
                answer = asking()
        except httpx.HTTPError:
            return None
        return answer

    def _new_browser(self) -> httpx.Client:
        page = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
        return httpx.Client(
            base_url=self._place.url,
            headers=page,
            timeout=_LIMIT_S,
            trust_env=False,
            verify=NO_TLS,
            follow_redirects=True,
        )
