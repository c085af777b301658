"""A node of somebody else that starts late: a publisher and a listener of the drive.

``python -m tests.integration.dds_stranger NODE DOMAIN``, with the configuration that
``rmw_cyclonedds`` gives to such a node; says ``heard`` once the gate reaches it.
"""

import sys
from threading import Event

from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.types import float64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

_NAMES = "geometry_msgs.msg.dds_."
Vector3 = make_idl_struct("Vector3", f"{_NAMES}Vector3_", dict.fromkeys("xyz", float64))
Twist = make_idl_struct(
    "Twist", f"{_NAMES}Twist_", {"linear": Vector3, "angular": Vector3}
)
_PORTS = (
    "<ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
)
NODES = {
    "jazzy": f"<Discovery>{_PORTS}</Discovery>",
    "humble": "<Discovery/>",
    "jazzy on this machine": "<General><AllowMulticast>false</AllowMulticast></General>"
    f'<Discovery>{_PORTS}<Peers><Peer address="localhost"/></Peers></Discovery>',
    "humble on this machine": "<General><Interfaces>"
    '<NetworkInterface address="127.0.0.1"/></Interfaces></General>',
}


def drive(node: str, domain: int) -> None:
    """Until killed."""
    _domain = Domain(domain, f"<CycloneDDS><Domain>{NODES[node]}</Domain></CycloneDDS>")
    participant = DomainParticipant(domain)
    topic = Topic(participant, "rt/cmd_vel", Twist)
    _writer = DataWriter(participant, topic)
    reader = DataReader(participant, topic)
    pause = Event()
    while not reader.take():
        pause.wait(0.02)
    sys.stdout.write("heard\n")
    sys.stdout.flush()
    pause.wait()


if __name__ == "__main__":
    drive(sys.argv[1], int(sys.argv[2]))
