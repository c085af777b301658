"""Schemas of Foxglove's well-known messages, as far as they are used.

Names and fields: https://docs.foxglove.dev/docs/sdk/schemas.
"""

_NUMBER, _TEXT, _FLAG = {"type": "number"}, {"type": "string"}, {"type": "boolean"}


def _object(**properties: object) -> dict[str, object]:
    return {"type": "object", "properties": properties}


def _list(of: object) -> dict[str, object]:
    return {"type": "array", "items": of}


_TIME = _object(sec={"type": "integer"}, nsec={"type": "integer"})


_VECTOR = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)


_QUATERNION = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)


_POSE = _object(position=_VECTOR, orientation=_QUATERNION)


_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)


POSE_IN_FRAME = _object(timestamp=_TIME, frame_id=_TEXT, pose=_POSE)


TRANSFORM = _object(
    timestamp=_TIME,
    parent_frame_id=_TEXT,
    child_frame_id=_TEXT,
    translation=_VECTOR,
    rotation=_QUATERNION,
)


SCAN = _object(
    timestamp=_TIME,
    frame_id=_TEXT,
    pose=_POSE,
    start_angle=_NUMBER,
    end_angle=_NUMBER,
    ranges=_list(_NUMBER),
    intensities=_list(_NUMBER),
)


_CUBE = _object(pose=_POSE, size=_VECTOR, color=_COLOUR)


_ENTITY = _object(
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_TIME,
    frame_locked=_FLAG,
    metadata=_list(_object(key=_TEXT, value=_TEXT)),
    cubes=_list(_CUBE),
)


SCENE = _object(deletions=_list(_object()), entities=_list(_ENTITY))
