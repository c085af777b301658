"""``iveg doctor``: tests every hop of the data path by using it once.

A probe device of its own is created, measured, commanded and removed again; no robot's
device, entity or topic is touched, so it may run while robots drive.  It ends within
twenty seconds, with the findings until then::

    broker, Orion, agent, database, page      all at once
    the lag that a running iVeg reports       overload is known before load is added
    device → measure → notification → command → answer → direct command
    a missing measure                         awaited, while there is time
    removal
"""

import asyncio
import contextlib
import secrets
from collections.abc import Awaitable, Callable, Mapping
from contextlib import AsyncExitStack
from functools import partial
from http import HTTPStatus
from pathlib import Path
from urllib.parse import urlsplit

import orjson

from iveg.adapters import clock
from iveg.adapters.database_check import check_database
from iveg.adapters.doctor import ProbeDevice, TopicListener, probe_device
from iveg.adapters.fiware_http import FiwareHttp
from iveg.adapters.history.engine import describe, history_url
from iveg.adapters.post_listener import post_listener
from iveg.app.fiware import open_fiware
from iveg.cli.arguments import CommandCall
from iveg.cli.diagnosis import exit_code, judge, missing, table
from iveg.cli.doctor_addresses import bind_to, in_url, page_url_of
from iveg.cli.findings import Finding, Lag, Stack
from iveg.cli.nodes import broker_of
from iveg.cli.probe import Probe
from iveg.cli.running import run_until_stopped
from iveg.domain.errors import HopError, IvegError
from iveg.domain.hops import Check, Hop
from iveg.domain.probe import SLOW_S
from iveg.domain.records import Json
from iveg.ngsi import names
from iveg.settings import Settings

PATIENCE_S, LIMIT_S = 5.0, 20.0
_REMOVAL_S = 4.0
"""Part of the limit that is reserved for the removal (s)."""
_WAITS = 3
"""Longest wait for a measure, in multiples of ``patience_s``."""
_LOOK_EVERY_S = 0.05
_FRESH_S = 10.0
"""Age from which the probe of a running iVeg is ignored (s)."""


def run(call: CommandCall) -> int:
    """Examine, print the table, remove the probe; returns the exit code."""
    examination = Examination(call.settings, call.data)
    run_until_stopped(examination.run())
    rows = judge(examination.findings, examination.stack)
    print(table(rows))
    for sentence in examination.left_behind:
        print(sentence)
    return exit_code(rows)


class _Page(FiwareHttp):
    HOP = Hop.PAGE


class Examination:
    """One examination: every hop tested once, everything removed afterwards.

    Args:
        settings: Addresses of the parts.
        data: Directory of the history unless the settings name another.
        patience_s: Time limit of each hop (s).
        limit_s: Time limit of the examination, removal included (s).

    Attributes:
        findings: Findings so far.
        lag: Delay of measures, where that is the cause.
    """

    def __init__(
        self,
        settings: Settings,
        data: Path,
        patience_s: float = PATIENCE_S,
        limit_s: float = LIMIT_S,
    ) -> None:
        service = settings.fiware_service, settings.fiware_servicepath
        self._settings = settings
        self._patience_s = patience_s
        self._address = broker_of(settings)
        self._database = history_url(settings.database_url, data)
        self._orion, self._agent = open_fiware(settings)
        self._page = _Page(page_url_of(settings), *service, bearer=settings.api_token)
        self._probe = Probe(self._orion, self._agent, settings.apikey)
        self._device: ProbeDevice | None = None
        self._listening_at = ""
        self._mark = ""
        self._began: dict[Check, float] = {}
        self._ends = clock.mono() + limit_s - _REMOVAL_S
        self._measure_mark = ""
        self._measured_at = 0.0
        self._waited_s = 0.0
        self.findings: dict[Check, Finding] = {}
        self.lag: Lag | None = None

    @property
    def stack(self) -> Stack:
        """Addresses for the sentences."""
        address, settings = self._address, self._settings
        return Stack(
            broker=f"{address.host}:{address.port}",
            user=address.user or "",
            orion=settings.orion_url,
            agent=settings.iota_url,
            listener=self._listening_at,
            database=describe(self._database),
            page=page_url_of(settings),
            topics=self._probe.topic(""),
            token=settings.fiware_token_url,
            lag=self.lag,
            waited_s=self._waited_s,
        )

    @property
    def left_behind(self) -> list[str]:
        """Parts of the probe that could not be removed, as sentences."""
        return self._probe.left_behind

    async def run(self) -> None:
        """Test every hop; clean up also when cancelled."""
        look_at_database = partial(asyncio.to_thread, check_database, self._database)
        look_at_page = partial(
            self._page.ask, "GET", "/healthz", timeout_s=self._patience_s
        )
        async with AsyncExitStack() as stack:
            for client in (self._orion, self._agent, self._page):
                stack.push_async_callback(client.close)
            stack.push_async_callback(self._probe.remove, _REMOVAL_S)
            async with asyncio.TaskGroup() as tasks:
                for check, step in (
                    (Check.BROKER, lambda: self._connect(stack)),
                    (Check.ORION, self._orion.version),
                    (Check.AGENT, self._agent.version),
                    (Check.DATABASE, look_at_database),
                    (Check.PAGE, look_at_page),
                ):
                    tasks.create_task(self._try(check, step), name=check.name)
            lag = await self._ask_iveg()
            if lag is None or lag.lag_s < self._patience_s:
                await self._use_the_agent()
            else:
                self.lag = lag
                self.findings[Check.MEASURE] = Finding(
                    Check.MEASURE, lag.lag_s, "nothing was added to it"
                )
            await self._try(Check.NOTIFICATION, self._be_notified)
            await self._try(Check.DIRECT, self._command_straight)
            await self._wait_for_the_measure()

    async def _use_the_agent(self) -> None:
        await self._try(Check.DEVICE, self._make_device)
        await self._try(Check.MEASURE, self._measure)
        await self._try(Check.COMMAND, self._command)
        await self._try(Check.ANSWER, self._answer)

    async def _try(self, check: Check, step: Callable[[], Awaitable[object]]) -> None:
        if missing(check, self.findings) or clock.mono() >= self._ends:
            return
        trouble = None
        began = clock.mono()
        try:
            # The limit allows for two waits, or for Orion's wait for the agent.
            async with asyncio.timeout(min(2 * self._patience_s, self._left_s)):
                await step()
        except TimeoutError:
            trouble = ""
        except HopError as error:
            trouble = error.detail
        except (IvegError, OSError) as error:
            trouble = str(error)
        took_s = clock.mono() - self._began.get(check, began)
        self.findings[check] = Finding(check, took_s, trouble)

    @property
    def _left_s(self) -> float:
        return max(0.0, self._ends - clock.mono())

    # --- lag ----------------------------------------------------------------------

    async def _ask_iveg(self) -> Lag | None:
        """Lag that a running iVeg reports to holders of its token."""
        if not self._settings.api_token or missing(Check.PAGE, self.findings):
            return None
        with contextlib.suppress(HopError):
            path, within_s = "/api/v1/health", self._patience_s
            answer = await self._page.ask("GET", path, timeout_s=within_s)
            return _lag_told(self._page.read_object(answer))
        return None

    async def _wait_for_the_measure(self) -> None:
        """Wait for a late measure, which gives the lag or a lower bound of it."""
        finding = self.findings.get(Check.MEASURE)
        if finding is None or finding.trouble is None or not self._measured_at:
            return
        until = self._measured_at + _WAITS * self._patience_s
        left_s = min(until, self._ends) - clock.mono()
        with contextlib.suppress(TimeoutError, HopError):
            await self._seen("probe", self._measure_mark, left_s)
            took_s = clock.mono() - self._measured_at
            self.lag = Lag(took_s)
        self._waited_s = took_s = clock.mono() - self._measured_at
        self.findings[Check.MEASURE] = Finding(
            Check.MEASURE, took_s, f"nothing came in {self._patience_s:.1f} s"
        )
        if self.lag is None:
            self.lag = await self._lag_of_the_heartbeat()
        if self.lag is None and self._agent_is_slow:
            self.lag = Lag(took_s, at_least=True)

    async def _lag_of_the_heartbeat(self) -> Lag | None:
        """Lag of a running iVeg's own probe, between sending and arrival at Orion."""
        with contextlib.suppress(HopError):
            left, came = await self._orion.read_probe_times()
            fresh = clock.wall() - came < _FRESH_S
            if fresh and came - left > SLOW_S:
                return Lag(came - left, told_by=", as the running iVeg's probe shows")
        return None

    @property
    def _agent_is_slow(self) -> bool:
        """Whether the agent also answered other requests late."""
        asked = (Check.AGENT, Check.DEVICE, Check.COMMAND)
        found = [self.findings[check] for check in asked if check in self.findings]
        return any(one.took_s > SLOW_S for one in found)

    # --- hops ---------------------------------------------------------------------

    async def _connect(self, stack: AsyncExitStack) -> None:
        echo, command = self._probe.topic("echo"), self._probe.topic(names.COMMAND)
        connection = probe_device(self._address, (echo, command), self._patience_s)
        self._device = device = await stack.enter_async_context(connection)
        mark = device.ear.mark()
        await device.publish(echo, mark.encode(), self._patience_s)
        try:
            await device.ear.heard(mark, self._patience_s)
        except TimeoutError as error:
            raise HopError(Hop.MQTT, "gives no echo of what we publish") from error

    async def _make_device(self) -> None:
        settings = self._settings
        await self._probe.make_device(settings.iota_cb_url or settings.orion_url)

    async def _measure(self) -> None:
        self._measure_mark = mark = secrets.token_hex(8)
        self._measured_at = clock.mono()
        await self._publish("attrs", {"probe": {"mark": mark}})
        await self._seen("probe", mark, self._patience_s)

    async def _be_notified(self) -> None:
        """Be notified of a change made at Orion itself, without the agent."""
        ear = TopicListener()

        # As an iVeg with these settings names itself to Orion.
        settings = self._settings
        host = urlsplit(settings.notify_address).hostname or settings.host

        def hear(body: bytes) -> tuple[HTTPStatus, str]:
            ear.hear(body)
            return HTTPStatus.NO_CONTENT, ""

        async with post_listener(hear, bind_to(host)) as port:
            self._listening_at = f"http://{in_url(host)}:{port}/"
            subscription = await self._probe.subscribe(self._listening_at)
            mark = ear.mark()
            # The steps so far are preparation; the hop begins here.
            self._began[Check.NOTIFICATION] = clock.mono()
            await self._probe.change(mark)
            try:
                await ear.heard(mark, self._patience_s)
            except TimeoutError as error:
                reason = await self._probe.why_not_notified(subscription)
                raise HopError(Hop.ORION, reason) from error

    async def _command(self) -> None:
        device = self._connected
        self._mark = device.ear.mark()
        await self._probe.command(self._mark)
        await device.ear.heard(self._mark, self._patience_s)

    async def _answer(self) -> None:
        await self._publish("cmdexe", {names.COMMAND: {"probe": self._mark}})
        await self._seen(names.COMMAND_INFO, self._mark, self._patience_s)

    async def _command_straight(self) -> None:
        mark = self._connected.ear.mark()
        await self._publish(names.COMMAND, {names.COMMAND: {"probe": mark}})
        await self._connected.ear.heard(mark, self._patience_s)

    # --- what hops do -------------------------------------------------------------

    @property
    def _connected(self) -> ProbeDevice:
        if self._device is None:
            raise HopError(Hop.MQTT, "not connected")
        return self._device

    async def _publish(self, last: str, payload: Mapping[str, object]) -> None:
        body = orjson.dumps(payload)
        topic = self._probe.topic(last)
        await self._connected.publish(topic, body, self._patience_s)

    async def _seen(self, attribute: str, mark: str, within_s: float) -> None:
        """Wait until an attribute of the probe at Orion contains the mark."""
        async with asyncio.timeout(max(0.0, within_s)):
            # Orion is polled: notifications are tested by another hop.
            while not await self._probe.holds(attribute, mark):  # noqa: ASYNC110
                await asyncio.sleep(_LOOK_EVERY_S)


def _lag_told(health: Json) -> Lag | None:
    """Lag in ``GET /api/v1/health``; None if healthy or not reported."""
    try:
        agent = next(one for one in health["hops"] if one["hop"] == Hop.AGENT)
        lag_s, growing = float(agent["lag_s"]), bool(agent["growing"])
    except (KeyError, TypeError, ValueError, StopIteration):
        return None
    told_by = ", as the running iVeg says"
    return Lag(lag_s, growing=growing, told_by=told_by) if lag_s > SLOW_S else None
