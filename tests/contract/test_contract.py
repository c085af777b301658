import os
from collections.abc import AsyncIterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import orjson
import pytest

from tests.contract.runner import Stack, embedded_stack, playing

HERE = Path(__file__).parent
CASES = sorted(HERE.glob("cases/*.json"))
FLEET = orjson.loads((HERE / "fleet.json").read_bytes())


@asynccontextmanager
async def real_stack() -> AsyncIterator[Stack]:
    mqtt = urlsplit(os.environ["IVEG_TEST_MQTT_URL"])
    yield Stack(
        os.environ["IVEG_TEST_ORION_URL"],
        os.environ["IVEG_TEST_IOTA_URL"],
        (mqtt.hostname or "127.0.0.1", mqtt.port or 1883),
        os.environ.get("IVEG_TEST_LISTENER_HOST", "127.0.0.1"),
    )


STACKS = {"embedded": embedded_stack}
if "IVEG_TEST_ORION_URL" in os.environ:
    STACKS["real"] = real_stack


def _runs() -> list[Any]:
    runs = []
    for file in CASES:
        for case in orjson.loads(file.read_bytes()):
            only = case.get("only")
            runs += [
                pytest.param(
                    stack,
                    (FLEET if case.get("fleet") else []) + case["steps"],
                    id=f"{name}: {case['about']}",
                    marks=[pytest.mark.fiware] if name == "real" else [],
                )
                for name, stack in STACKS.items()
                if only in (None, name)
            ]
    return runs


@pytest.mark.parametrize(("stack", "steps"), _runs())
async def test_fiware_behaves_as_recorded(
    stack: "type[AbstractAsyncContextManager[Stack]]", steps: list[dict[str, Any]]
) -> None:
    async with stack() as where, playing(where) as player:
        for step in steps:
            await player.play(step)
