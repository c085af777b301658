"""Boxes in a picture, with depth: the paper's grounding, into map."""

import math

import numpy as np
import pytest

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import DetectionFrame
from iveg.robot.ros2 import detections
from iveg.robot.ros2.config import RobotConfig
from iveg.ros2 import messages as ros
from tests.unit.robot.ros2 import said
from tests.unit.robot.ros2.said import Bench, tf

WIDTH, HEIGHT, FOCAL = 64, 48, 60.0
PERSON, WALL = 3.0, 6.0
TOPICS = {
    "detections_2d": "boxes",
    "depth": "depth",
    "camera_info": "info",
    "mask": "mask",
}
OPTICAL = ros.Header(said.stamp(), "camera_optical")
MIDDLE, TALL = ros.Point2D(32.0, 25.0), ros.Point2D(20.0, 34.0)
"""The person's box in the picture."""


def info(**differs: float) -> ros.CameraInfo:
    p = np.zeros(12)
    p[0], p[5] = differs.get("fx", FOCAL), differs.get("fy", FOCAL)
    p[2], p[6], p[10] = (WIDTH - 1) / 2, (HEIGHT - 1) / 2, 1.0
    return ros.CameraInfo(OPTICAL, HEIGHT, WIDTH, p=p)


def scene() -> np.ndarray:
    """A person at 3 m in the middle, before a wall at 6 m; (m)."""
    depth = np.full((HEIGHT, WIDTH), WALL)
    depth[10:40, 25:40] = PERSON
    return depth


def image(
    pixels: np.ndarray, encoding: str, kind: str, *, big: bool = False, pad: int = 0
) -> ros.Image:
    rows = np.ascontiguousarray(pixels.astype((">" if big else "<") + kind))
    raw = np.frombuffer(rows.tobytes(), np.uint8).reshape(pixels.shape[0], -1)
    raw = np.pad(raw, ((0, 0), (0, pad)))
    return ros.Image(
        OPTICAL, HEIGHT, WIDTH, encoding, int(big), raw.shape[1], raw.reshape(-1)
    )


def depth() -> ros.Image:
    return image(scene() * 1000, "16UC1", "u2")


def look(
    centre: ros.Point2D = MIDDLE, size: ros.Point2D = TALL, *, count: int = 1
) -> ros.Detection2DArray:
    """Boxes of farmers in the picture, all in the same place."""
    sure = ros.ObjectHypothesisWithPose(ros.ObjectHypothesis("farmer", 0.9))
    box = ros.BoundingBox2D(ros.PicturePose(centre), size.x, size.y)
    return ros.Detection2DArray(
        OPTICAL, (ros.Detection2D(ros.Header(), (sure,), box),) * count
    )


def bench() -> Bench:
    """A camera 1 m above the floor, 10 m east of map's origin, looking east."""
    found = Bench(RobotConfig(topics=TOPICS), tree=False)
    optical = ros.Quaternion(-0.5, 0.5, -0.5, 0.5)
    place = ros.Transform(ros.Vector3(10.0, 0.0, 1.0), optical)
    header = ros.Header(said.stamp(), "map")
    found.hear("tf_static", tf(ros.TransformStamped(header, "camera_optical", place)))
    return found.hear("camera_info", info())


def test_a_mask_says_which_pixels_are_whose() -> None:
    mask = np.zeros((HEIGHT, WIDTH))
    mask[10:40, 25:33] = 1
    mask[10:40, 33:40] = 2
    one = bench().hear("depth", depth()).hear("mask", image(mask, "mono8", "u1"))
    found = one.hear("detections_2d", look(count=2)).only(DetectionFrame)

    left, right = (one.box for one in found.detections)
    assert left.ymin > right.ymax - 0.1
    assert left.ymin > -0.1


def test_a_look_whose_depth_never_comes_counts_everybody_as_lost() -> None:
    one = bench().hear("detections_2d", look())
    one.tick()

    (sensed,) = one.sense(0.4)

    found = sensed.observation
    assert isinstance(found, DetectionFrame)
    assert (found.detections, len(found.unread)) == ((), 1)
    assert sensed.age_s == pytest.approx(0.4)
    assert one.faults(0.4)["no_depth"] == "/boxes"


@pytest.mark.parametrize(
    "picture",
    [
        depth(),
        image(scene() * 1000, "16UC1", "u2", big=True, pad=6),
        image(scene(), "32FC1", "f4"),
        image(scene() * 1000, "mono16", "u2", pad=2),
    ],
)
def test_depth_is_read_in_every_encoding_that_ros_uses(picture: ros.Image) -> None:
    read = detections.read_depth(picture, info())

    assert np.allclose(read.depth, scene(), atol=1e-3)


@pytest.mark.parametrize(
    ("picture", "camera", "reason"),
    [
        (image(scene(), "rgb8", "u1"), info(), "bad_encoding"),
        (ros.Image(height=9, width=9, encoding="16UC1"), info(), "bad_picture"),
        (depth(), info(fx=math.nan), "bad_camera"),
        (depth(), info(fy=90.0), "bad_camera"),
        (depth(), ros.CameraInfo(height=4, width=4), "bad_camera"),
    ],
)
def test_a_picture_that_cannot_be_used_is_named(
    picture: ros.Image, camera: ros.CameraInfo, reason: str
) -> None:
    with pytest.raises(UnreadableError) as error:
        detections.read_depth(picture, camera)

    assert error.value.reason == reason
