"""Settings that the safety nodes of a run share."""

from dataclasses import dataclass
from pathlib import Path

from iveg.adapters.broker_address import BrokerAddress
from iveg.domain.limits import LIMITS
from iveg.domain.witness import Plan
from iveg.robot.judgement import OnLinkLoss
from iveg.robot.uplink import Form


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeSettings:
    """Settings shared by the safety nodes of a run.

    Attributes:
        address: The broker.
        apikey: First part of the measure topics.
        directory: Where the holds of each robot survive a loss of power.
        slow_s: Feedback older than this halves the speed (s).
        stand_s: Feedback older than this stops the robot (s).
        on_link_loss: ``slow``: it goes on at half speed instead.
        uplink: One message a topic, or Algorithm 1's single payload.
        plan: What stands in the greenhouse; None: nobody drew it.
    """

    address: BrokerAddress
    apikey: str
    directory: Path
    slow_s: float = LIMITS.feedback_slow_s
    stand_s: float = LIMITS.feedback_stand_s
    on_link_loss: OnLinkLoss = "stop"
    uplink: Form = "per-topic"
    plan: Plan | None = None
