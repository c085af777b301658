"""The two tables that the paper printed, to stand beside what is measured here.

Both are of a real FIWARE with MongoDB: the first in simulation on a local network
("co-located LAN deployment"), the second in the AgroConnect greenhouse (n > 10,000 for
Δt₁, n = 598 for Δt₂).  Its totals at P95 are sums of two P95, not a P95 of sums.
"""

from dataclasses import dataclass
from typing import Final, Literal

from iveg.domain.latency.segments import Data

Place = Literal["simulation", "field"]


@dataclass(frozen=True, slots=True)
class PaperLatency:
    """One row, all in ms."""

    uplink_mean: float
    uplink_p95: float
    fiware_mean: float
    fiware_p95: float
    total_mean: float
    total_p95: float


PAPER: Final[dict[Place, dict[Data, PaperLatency]]] = {
    "simulation": {
        "odometry": PaperLatency(3.8, 11.2, 98.4, 182.3, 102.2, 193.5),
        "detections": PaperLatency(4.1, 12.5, 101.2, 188.7, 105.3, 201.2),
        "lidar": PaperLatency(4.3, 13.1, 96.1, 155.4, 100.4, 168.5),
    },
    "field": {
        "odometry": PaperLatency(16.9, 103.9, 121.3, 212.6, 138.2, 316.5),
        "detections": PaperLatency(16.2, 101.0, 119.2, 214.9, 135.4, 315.8),
        "lidar": PaperLatency(17.4, 97.2, 117.0, 168.6, 134.4, 265.8),
    },
}
