"""Another process on DDS: one topic a quality of service, ten messages a second each.

``python -m tests.integration.dds_talker DOMAIN``; ``/kept`` is written once, at once.
"""

import sys
import threading
from itertools import count

from iveg.ros2 import cdr, names
from iveg.ros2 import messages as ros
from iveg.ros2.names import Qos
from tests.dds import Dds, loopback

QUALITIES = {
    "/best_effort": Qos(reliable=False),
    "/reliable": names.DEFAULT,
    "/kept": names.TF_STATIC,
}


def talk(domain: int) -> None:
    """Until killed."""
    pause = threading.Event()
    with Dds(loopback(domain)) as dds:
        writers = {
            topic: dds.writer(topic, ros.Twist, qos) for topic, qos in QUALITIES.items()
        }
        kept = writers.pop("/kept")
        for number in range(3):
            kept.write(cdr.write(ros.Twist(ros.Vector3(float(number)))))
        for number in count():
            for writer in writers.values():
                writer.write(cdr.write(ros.Twist(ros.Vector3(float(number)))))
            pause.wait(0.1)


if __name__ == "__main__":
    talk(int(sys.argv[1]))
