"""What iVeg asks of one robot: a command, or the retained level."""

from collections.abc import Iterable, Mapping
from typing import Any, Literal

import orjson

from iveg.ngsi import names


def write_stop(hold_id: str, by: str) -> dict[str, Any]:
    """The value of ``cmd`` that stops a robot."""
    return {"stop": {"id": hold_id, "by": by}}


def write_release(hold_ids: Iterable[str], challenge: str) -> dict[str, Any]:
    """The value of ``cmd`` that lifts exactly these holds."""
    return {"release": {"ids": list(hold_ids), "ch": challenge}}


def write_resume(challenge: str) -> dict[str, Any]:
    """The value of ``cmd`` that lets a released robot drive."""
    return {"resume": {"ch": challenge}}


def write_command(value: Mapping[str, Any]) -> bytes:
    """A command as the IoT Agent puts it on the robot's topic."""
    return orjson.dumps({names.COMMAND: value})


def write_desired(desired: Literal["stopped", "run"], ids: Iterable[str]) -> bytes:
    """The retained level on ``/{robot}/iveg/desired``."""
    return orjson.dumps({"desired": desired, "ids": list(ids)})
