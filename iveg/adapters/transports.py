"""Transports of orders: straight over MQTT, and through Orion and the IoT Agent.

They share nothing, so that a fault of one transport leaves the other alone.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Literal

from iveg.adapters.mqtt import MqttLink
from iveg.adapters.orion import OrionClient
from iveg.domain.feedback import Feedback
from iveg.domain.goals import CancelOrder, GoalOrder
from iveg.domain.peer_scan import PeerScan
from iveg.ngsi import codec, names


class _OrderTransport(ABC):
    """Orders as NGSI commands; implements ``vital.ports.CommandPort``."""

    @abstractmethod
    async def _order(self, robot_id: str, order: codec.Order) -> None:
        """Send an order once."""

    async def stop(self, robot_id: str, hold_id: str, by: str) -> None:
        """Send a STOP; a repetition does no harm."""
        await self._order(robot_id, codec.StopOrder(hold_id, by))

    async def release(
        self, robot_id: str, ids: Iterable[str], challenge: str, attempt: str
    ) -> None:
        """Send a release, once."""
        order = codec.ReleaseOrder(challenge, attempt, tuple(ids))
        await self._order(robot_id, order)

    async def resume(self, robot_id: str, challenge: str, attempt: str) -> None:
        """Send a resume, once."""
        await self._order(robot_id, codec.ResumeOrder(challenge, attempt))

    async def goal(self, robot_id: str, order: GoalOrder | CancelOrder) -> None:
        """Send a goal or its cancellation, once."""
        await self._order(robot_id, order)


class MqttTransport(_OrderTransport):
    """Orders straight to the robots; also implements ``vital.ports.FleetPort``."""

    def __init__(self, link: MqttLink, apikey: str) -> None:
        self._link, self._apikey = link, apikey

    def publish_feedback(self, feedback: Feedback) -> None:
        """Offer feedback; newer feedback replaces feedback that has not left yet."""
        topic = names.FEEDBACK_TOPIC.format(robot_id=feedback.robot_id)
        self._link.enqueue(topic, codec.write_feedback(feedback), qos=1)

    def publish_peer_scan(self, scan: PeerScan) -> None:
        """Offer a scan at QoS 0; a newer scan replaces one that has not left yet."""
        topic = names.PEER_SCAN_TOPIC.format(robot_id=scan.robot_id)
        self._link.enqueue(topic, codec.write_peer_scan(scan))

    async def stop(self, robot_id: str, hold_id: str, by: str) -> None:
        """Publish a STOP, never retained; returns when the broker has confirmed."""
        # QoS 1: unlike a release, a copy that arrives late makes nothing drive.
        await self._order(robot_id, codec.StopOrder(hold_id, by), qos=1)

    async def _order(self, robot_id: str, order: codec.Order, qos: int = 0) -> None:
        """Publish; at QoS 0 no client repeats an order after a lost connection."""
        topic = names.command_topic(self._apikey, robot_id)
        await self._link.publish(topic, codec.write_command(order), qos=qos)

    async def set_desired_state(
        self, robot_id: str, desired: Literal["stopped", "run"], ids: Iterable[str]
    ) -> None:
        """Publish the retained desired state that a reconnecting robot finds."""
        topic = names.DESIRED_TOPIC.format(robot_id=robot_id)
        payload = codec.write_desired(desired, ids)
        await self._link.publish(topic, payload, qos=1, retain=True)


class OrionTransport(_OrderTransport):
    """Orders through Orion; its 204 is no evidence of arrival."""

    def __init__(self, orion: OrionClient) -> None:
        self._orion = orion

    async def _order(self, robot_id: str, order: codec.Order) -> None:
        name, value = codec.write_order(order)
        await self._orion.update_command(robot_id, value, name=name)
