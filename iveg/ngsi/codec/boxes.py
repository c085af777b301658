"""Detection frames: boxes of one picture, and the classes of those nobody can use."""

from collections.abc import Mapping

from pydantic import TypeAdapter, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Box3D
from iveg.domain.observations import Detection, DetectionFrame, Origin
from iveg.ngsi import names, payloads, texts
from iveg.ngsi.codec.fields import read_origin, read_stamped

_BOXES: TypeAdapter[list[payloads.BoxValue]] = TypeAdapter(list[payloads.BoxValue])


def read_frame(robot_id: str, attributes: Mapping[str, object]) -> DetectionFrame:
    """Read ``bounding_boxes`` and its header."""
    boxes = attributes[names.BOXES]
    if isinstance(boxes, dict):
        boxes = [boxes]
    if not isinstance(boxes, list) or len(boxes) > payloads.MAX_BOXES:
        raise UnreadableError("bad_bounding_boxes", "neither a box nor a short list")
    origin, detector = Origin(), None
    if attributes.get(names.BOXES_HEADER) is not None:
        header = payloads.BoxesHeaderValue.model_validate(
            attributes[names.BOXES_HEADER]
        )
        origin, detector = read_origin(header), header.detector
    try:
        read = list(map(_detection_of, _BOXES.validate_python(boxes)))
    except ValidationError:
        read = [_detection(box) for box in boxes]
    return _frame(robot_id, origin, boxes, read, detector)


def _frame(
    robot_id: str,
    origin: Origin,
    boxes: list[object],
    read: list[Detection | None],
    detector: str | None = None,
) -> DetectionFrame:
    """What could be read of a frame, and the classes of the boxes that could not."""
    found = tuple(one for one in read if one is not None)
    if len(found) == len(boxes):
        return DetectionFrame(robot_id, origin, found, (), detector)
    pairs = zip(boxes, read, strict=True)
    unread = tuple(_class_of(box) for box, detection in pairs if detection is None)
    return DetectionFrame(robot_id, origin, found, unread, detector)


def _class_of(box: object) -> str | None:
    class_id = box.get("class_id") if isinstance(box, dict) else None
    return texts.clean_text(class_id) if isinstance(class_id, str) else None


def _detection(raw: object) -> Detection | None:
    try:
        return _detection_of(payloads.BoxValue.model_validate(raw))
    except ValidationError:
        return None


def _detection_of(box: payloads.BoxValue) -> Detection | None:
    if box.frame_id == names.UNPLACED:
        return None
    sides = box.position
    position = Box3D(
        sides.xmin, sides.xmax, sides.ymin, sides.ymax, sides.zmin, sides.zmax
    )
    frame_id = box.frame_id or None
    return Detection(box.class_id, box.probability, position, frame_id, box.det_id)


_HALF_M = 0.25
"""Algorithm 1 sends a point; it is drawn as a box of half a metre."""


def read_single_detection(
    robot_id: str, attributes: Mapping[str, object]
) -> DetectionFrame:
    """Read the one detection of Algorithm 1's payload."""
    box = {
        "class_id": attributes["class"],
        "probability": attributes.get("conf"),
        "frame_id": "map",
        "position": _sides_about(attributes.get("position_3D")),
    }
    return _frame(robot_id, read_stamped(attributes), [box], [_detection(box)])


def _sides_about(raw: object) -> dict[str, float] | None:
    """Sides of the box about a point; None where it is none."""
    try:
        point = payloads.PointValue.model_validate(raw)
    except ValidationError:
        return None
    centre = {"x": point.x, "y": point.y, "z": point.z}
    return {
        axis + side: value + sign * _HALF_M
        for axis, value in centre.items()
        for side, sign in (("min", -1), ("max", 1))
    }
