"""The site's own command that the broker follows."""

import shlex
import sys
from pathlib import Path

import pytest

from iveg.adapters.broker_access import BrokerAccessCommand
from iveg.domain.errors import HopError


async def test_the_sites_command_is_told_which_robot(tmp_path: Path) -> None:
    told = tmp_path / "told"
    code = f"import sys; open({str(told)!r}, 'a').write(' '.join(sys.argv[1:]) + ';')"
    command = BrokerAccessCommand(shlex.join([sys.executable, "-c", code]))

    answers = [await command.change("AGI", admitted=one) for one in (False, True)]

    assert answers == ["done", "done"]
    assert told.read_text() == "--revoke AGI;--allow AGI;"


async def test_without_a_command_nobody_is_asked() -> None:
    assert await BrokerAccessCommand("").change("AGI", admitted=False) == "not_asked"


@pytest.mark.parametrize(
    "command", ["/nowhere/at-all", "sh -c 'echo no broker; exit 3'"]
)
async def test_a_command_that_fails_says_why(command: str) -> None:
    with pytest.raises(HopError, match=r"no broker|No such file"):
        await BrokerAccessCommand(command).change("AGI", admitted=False)
