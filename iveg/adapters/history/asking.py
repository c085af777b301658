"""One question to the history's database, which a connection answers."""

from collections.abc import Callable
from typing import Concatenate, ParamSpec, TypeVar

from sqlalchemy import Connection, Engine
from sqlalchemy.exc import SQLAlchemyError

from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.migrate import reason_of
from iveg.domain.errors import HopError

P = ParamSpec("P")
T = TypeVar("T")


def ask(
    engine: Engine,
    question: Callable[Concatenate[Connection, P], T],
    *args: P.args,
    **named: P.kwargs,
) -> T:
    """The answer of a database.

    Raises:
        HopError: it does not answer.
    """
    try:
        with engine.connect() as connection:
            return question(connection, *args, **named)
    except SQLAlchemyError as error:
        raise HopError("database", reason_of(error)) from error


def ask_once(
    url: str,
    question: Callable[Concatenate[Connection, P], T],
    *args: P.args,
    **named: P.kwargs,
) -> T:
    """The same, of a database that is asked nothing else."""
    engine = reading_engine(url)
    try:
        return ask(engine, question, *args, **named)
    finally:
        engine.dispose()
