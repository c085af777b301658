"""What an examination of the data path found, hop by hop."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from iveg.domain.hops import Check
from iveg.domain.probe import lag_in_words


@dataclass(frozen=True, slots=True)
class Lag:
    """Delay of measures on their way to Orion.

    Attributes:
        lag_s: Seconds.
        growing: Whether it is known to grow.
        at_least: Whether the true lag may be longer.
        told_by: Source of the lag, as a clause; empty for the doctor's own measure.
    """

    lag_s: float
    growing: bool = False
    at_least: bool = False
    told_by: str = ""

    @property
    def sentence(self) -> str:
        """A sentence such as "Measures reach Orion 23 s late, growing"."""
        said = lag_in_words(self.lag_s, growing=self.growing, at_least=self.at_least)
        return said[0].upper() + said[1:] + self.told_by


@dataclass(frozen=True, slots=True)
class Stack:
    """Addresses for the sentences.

    Attributes:
        broker: Host and port of the MQTT broker.
        user: User name at the broker; empty for anonymous.
        listener: Address that Orion was asked to post to.
        topics: The probe device's topics, up to the last slash.
        token: Address of the token endpoint; empty: no proxy asks for one.
        lag: Delay of measures, where that is known to be the cause.
        waited_s: Time that the doctor waited for its measure (s).
    """

    broker: str
    user: str
    orion: str
    agent: str
    listener: str
    database: str
    page: str
    topics: str
    token: str = ""
    lag: Lag | None = None
    waited_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of one tested hop.

    Attributes:
        took_s: Duration, or time waited (s).
        trouble: None for success; the reason of a refusal; empty for a time-out.
    """

    check: Check
    took_s: float
    trouble: str | None = None

    @property
    def well(self) -> bool:
        """Whether the hop works."""
        return self.trouble is None


Findings = Mapping[Check, Finding]


Case = Callable[[str, Findings], bool]
"""Whether a cause explains a failure, by its reason and by all findings."""
