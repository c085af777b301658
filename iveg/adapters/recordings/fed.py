"""The inside of a process that is fed (``fed_process.py``): its pipes and last word."""

import contextlib
import signal
import sys
from collections.abc import Callable, Mapping
from typing import BinaryIO

import orjson

from iveg.adapters.urgency import LESS_URGENT, give_way

Serve = Callable[[BinaryIO, BinaryIO], None]
"""Takes inputs from the first until it ends, and answers on the second."""


def run_fed(
    serve: Serve, refusal: type[Exception], less_urgent: int = LESS_URGENT
) -> None:
    """Serve on standard input and output; a refusal is said once, and ends it.

    Signals are the feeder's to heed; its end is this process's.
    """
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, signal.SIG_IGN)
    give_way(less_urgent)
    with (
        open(0, "rb", buffering=0) as source,
        open(1, "wb", buffering=0) as answers,
    ):
        try:
            serve(source, answers)
        except refusal as error:
            reason = getattr(error, "strerror", None) or str(error)
            answer(answers, {"refused": reason})
            sys.exit(1)


def answer(answers: BinaryIO, message: Mapping[str, object]) -> None:
    """Tell the feeder; where nobody is left to be told, the source ends, too."""
    with contextlib.suppress(BrokenPipeError):
        answers.write(orjson.dumps(message) + b"\n")
