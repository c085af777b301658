"""Connections of one listener: how many there may be, and how long a request may take.

The newest connection comes in and the oldest one that asks for nothing goes, so that a
STOP gets through while somebody holds a thousand half-sent requests open::

    opened ──> awaited ──> busy ──> idle ──> awaited …
                  └── too late ──> ended

A connection whose request was signed in is *vouched for*: it is closed last, and never
while it is busy.  A part of all places is kept for addresses that have signed in.
"""

import asyncio
import logging
from collections import Counter, OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final

from iveg.adapters.connection_caps import ConnectionCaps
from iveg.adapters.networks import network_of

CONNECTION: Final = "iveg.connection"
"""Key of a :class:`Connection` in the ``state`` of an ASGI scope."""
_log = logging.getLogger(__name__)
_LOOKS_EVERY_S = 0.5
_KNOWN_S = 12 * 3600.0
"""How long an address that signed in keeps its share: as long as an idle session."""
_MOST_ADDRESSES = 1024


@dataclass(eq=False, slots=True)
class Connection:
    """One connection of a :class:`ConnectionTable`.

    Attributes:
        peer: Address at the other end; ``address`` that of the client behind it.
        due: When what it waits for has to be here; None: it waits for nothing.
        is_busy: Whether a request of it is being answered.
        is_proxy: Whether the peer speaks for others.
        vouched: Whether its newest request was signed in.
    """

    table: "ConnectionTable" = field(repr=False)
    peer: str
    end: Callable[[], None] = field(repr=False)
    address: str
    is_proxy: bool
    due: float | None = None
    is_busy: bool = False
    vouched: bool = False

    def await_head(self) -> None:
        """A request begins: nobody has vouched for it yet."""
        self._expect(self.table.caps.head_s)
        self.vouched = False
        self.table.touch(self)

    def await_body(self) -> None:
        """Its head is here."""
        self._expect(self.table.caps.body_s)

    def serve(self) -> None:
        """A request is whole and is being answered, or a WebSocket is open."""
        self.due, self.is_busy = None, True

    def rest(self) -> None:
        """The answer is out."""
        self.due, self.is_busy = None, False
        if self.address == self.peer:
            self.table.touch(self)
        else:
            self.table.move(self, self.peer)

    def vouch(self) -> None:
        """Its request was signed in."""
        self.vouched = True
        self.table.remember(self.address)

    @property
    def is_idle(self) -> bool:
        """Whether nothing is awaited of it, and it waits for nothing."""
        return self.due is None and not self.is_busy

    @property
    def is_kept(self) -> bool:
        """Whether no other displaces it: a signed-in request, or an open WebSocket."""
        return self.vouched and self.is_busy

    def belongs_to(self, client: str) -> bool:
        """Name the client behind a proxy; whether that one may have another."""
        return client == self.address or self.table.move(self, client)

    def leave(self) -> None:
        """It is closed."""
        self.table.remove(self)

    def _expect(self, within_s: float) -> None:
        self.due, self.is_busy = self.table.now() + within_s, False


class ConnectionTable:
    """All connections of a listener.

    Args:
        now: Monotonic clock (s).
        caps: What the listener bears.
        is_proxy: Whether an address is a proxy's, whose clients are distinguished by
            what it says of them, so that it has no cap of its own.

    Attributes:
        counters: Connections that were closed for others, refused or too late.
    """

    def __init__(
        self,
        now: Callable[[], float],
        caps: ConnectionCaps,
        is_proxy: Callable[[str], bool] = lambda _: False,
    ) -> None:
        self.now = now
        self.caps = caps
        self.counters: Counter[str] = Counter()
        self._is_proxy = is_proxy
        self._by_address: dict[str, dict[Connection, None]] = {}
        """Connections of each address; the one that was quiet longest comes first."""
        self._known: OrderedDict[str, float] = OrderedDict()
        self._logged: OrderedDict[tuple[str, str], None] = OrderedDict()

    def __len__(self) -> int:
        return sum(map(len, self._by_address.values()))

    def admit(self, peer: str, end: Callable[[], None]) -> Connection | None:
        """Take in a new connection; None where it has to be closed at once.

        Args:
            peer: Address at the other end.
            end: Closes it without waiting for anything.
        """
        network = network_of(peer)
        is_proxy = self._is_proxy(peer)
        new = Connection(self, network, end, network, is_proxy)
        self._put(new)
        if self._has_room(new):
            new.await_head()
            return new
        self.remove(new)
        return None

    def move(self, connection: Connection, address: str) -> bool:
        """Count a connection as another address's; whether it may stay."""
        self.remove(connection)
        connection.address = address
        self._put(connection)
        return self._has_room(connection)

    def touch(self, connection: Connection) -> None:
        """Something happens on a connection: it is the last of its address to go."""
        own = self._by_address.get(connection.address, {})
        if connection in own:
            del own[connection]
            own[connection] = None

    def remove(self, connection: Connection) -> None:
        """Forget a connection."""
        own = self._by_address.get(connection.address, {})
        own.pop(connection, None)
        if not own:
            self._by_address.pop(connection.address, None)

    def remember(self, address: str) -> None:
        """Keep a share for an address that somebody has signed in from."""
        self._known[address] = self.now()
        self._known.move_to_end(address)
        if len(self._known) > _MOST_ADDRESSES:
            self._known.popitem(last=False)

    def end_overdue(self) -> None:
        """End every connection whose request did not come in time."""
        now = self.now()
        everyone = [one for own in self._by_address.values() for one in own]
        for one in everyone:
            if one.due is not None and one.due < now:
                self._end(one, "late")

    async def run(self) -> None:
        """Look for requests that are late, until cancelled."""
        while True:
            await asyncio.sleep(_LOOKS_EVERY_S)
            self.end_overdue()

    def refused(self, address: str, reason: str) -> None:
        """Count a refusal; the first of an address and reason is logged."""
        self.counters[f"connections.{reason}"] += 1
        if reason == "late" or (address, reason) in self._logged:
            return
        self._logged[address, reason] = None
        if len(self._logged) > _MOST_ADDRESSES:
            self._logged.popitem(last=False)
        _log.warning("connections of %s: %s", address or "?", _SENTENCES[reason])

    def _put(self, connection: Connection) -> None:
        self._by_address.setdefault(connection.address, {})[connection] = None

    def _has_room(self, new: Connection) -> bool:
        """Whether a connection may stay; another that must give way for it is ended."""
        caps, own = self.caps, self._by_address[new.address]
        is_capped = not (new.is_proxy and new.address == new.peer)
        if is_capped and len(own) > caps.of_an_address:
            return self._give_way(own, new)
        self._forget_known()
        if new.address not in self._known:
            by_address = self._by_address.items()
            strangers = [each for one, each in by_address if one not in self._known]
            if sum(map(len, strangers)) > caps.of_strangers:
                return self._give_way(_longest(strangers), new)
        if len(self) > caps.connections:
            return self._give_way(_longest(self._by_address.values()), new)
        return True

    def _give_way(self, among: Iterable[Connection], new: Connection) -> bool:
        """End the first that nobody vouches for, else the first that is not kept."""
        free = (one for one in among if one is not new and not one.vouched)
        rest = (one for one in among if one is not new and not one.is_kept)
        first = next(free, None) or next(rest, None)
        if first is None:
            self.refused(new.address, "refused")
            return False
        self._end(first, "gave_way")
        return True

    def _end(self, one: Connection, reason: str) -> None:
        self.refused(one.address, reason)
        self.remove(one)
        one.end()

    def _forget_known(self) -> None:
        """Addresses from which nobody has signed in for long are strangers again."""
        since = self.now() - _KNOWN_S
        while self._known and next(iter(self._known.values())) < since:
            self._known.popitem(last=False)


_SENTENCES: Final = {
    "refused": "one too many is refused, as all others are in use",
    "gave_way": "too many, the oldest gives way",
    "head_too_long": "a request with too long a head is refused",
    "packet_too_long": "a packet that is too long is refused",
    "unreadable": "a request that cannot be read is refused",
}


def _longest(groups: Iterable[dict[Connection, None]]) -> dict[Connection, None]:
    return max(groups, key=lambda one: len(one))
