"""What a device answered to a challenge: a short object, looked at by its ceremony."""

import json
from typing import Annotated, Final

from pydantic import AfterValidator

_MOST: Final = 16 * 1024
"""Characters; certificates of a device come along when it is registered."""


def _short(answer: dict[str, object]) -> dict[str, object]:
    if len(json.dumps(answer)) > _MOST:
        raise ValueError("too long")
    return answer


AnswerOfDevice = Annotated[dict[str, object], AfterValidator(_short)]
