"""The detection rule over HTTP: the version in force, earlier ones, a new one."""

from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Response
from pydantic import Field, create_model, field_validator

from iveg.comfort.trials import Trials
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import VersionMissingError
from iveg.domain.parameters import PARAMETERS, Class
from iveg.domain.wire import clean_text
from iveg.models.base import Body, Listing
from iveg.models.rule import Rule as RuleModel
from iveg.models.rule import Trial as TrialModel
from iveg.models.rule import parameter_fields
from iveg.vital.operators import Rules
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import READERS, Operator

_MOST_ALIASES = 200


class _RuleChange(Body):
    """The parameters to change; others stay as they are.

    A detector's word must stand for `person` or `robot`; both names always stand for
    themselves.
    """

    version: int | None = None
    """The version that the person saw: 428 without, 409 when it is in force no more."""
    aliases: Annotated[dict[str, Class], Field(max_length=_MOST_ALIASES)] | None = None

    @field_validator("aliases")
    @classmethod
    def _readable(cls, aliases: dict[str, Class] | None) -> dict[str, Class] | None:
        if aliases is None:
            return None
        cleaned = {clean_text(name).strip().lower(): aliases[name] for name in aliases}
        own: dict[str, Class] = {"person": "person", "robot": "robot"}
        if "" in cleaned or any(cleaned.get(n, c) != c for n, c in own.items()):
            raise ValueError("names must not be empty; person and robot are themselves")
        return {**cleaned, **own}

    def applied_to(self, rule: DetectionRule) -> DetectionRule:
        """A rule with these parameters, of nobody yet."""
        told = dict(self)
        values: dict[str, Any] = {
            row.name: row.read(told, getattr(rule, row.name), row.key)
            for row in PARAMETERS
        }
        aliases = dict(rule.aliases) if self.aliases is None else self.aliases
        return DetectionRule(
            **values, id=rule.id, version=rule.version, aliases=aliases
        )


if TYPE_CHECKING:
    RuleChange = _RuleChange
else:
    RuleChange = create_model(
        "RuleChange",
        __base__=_RuleChange,
        __doc__=_RuleChange.__doc__,
        **parameter_fields(lambda row: row.key, "none"),
    )


class Promotion(Body):
    """The version in force that the person saw beside the trial."""

    version: int


def router(rules: Rules, trials: Trials, clock: Clock) -> APIRouter:
    """Rule and trial, read by all and changed by operators.

    Every version keeps its author and time; a trial acts on nothing.
    """
    routes = APIRouter(prefix="/api/v1", tags=["rule"])

    @routes.get("/rule", response_model=RuleModel, dependencies=READERS)
    async def rule() -> Response:
        """The version in force."""
        return Json(RuleModel.of(rules.current))

    @routes.get(
        "/rule/versions", response_model=Listing[RuleModel], dependencies=READERS
    )
    async def versions() -> Response:
        """Every version with its author and time, newest first."""
        items = [RuleModel.of(one) for one in reversed(rules.versions)]
        return Json(Listing(items=items))

    @routes.put("/rule", response_model=RuleModel)
    async def change(body: RuleChange, who: Operator) -> Response:
        """Put a new version in force at once; parameters that are not named stay."""
        if body.version is None:
            raise VersionMissingError("The rule")
        wanted = body.applied_to(rules.current)
        return Json(
            RuleModel.of(await rules.change(wanted, who.name, clock(), body.version))
        )

    @routes.get(
        "/rule/trial",
        response_model=Listing[TrialModel],
        dependencies=READERS,
    )
    async def current() -> Response:
        """The trial, if one runs: it acts on nothing."""
        trial = trials.current
        return Json(Listing(items=[TrialModel.of(trial)] if trial else []))

    @routes.post("/rule/trial", response_model=TrialModel, status_code=201)
    async def begin(body: RuleChange, who: Operator) -> Response:
        """Try the rule in force with other parameters, beside it."""
        wanted = body.applied_to(rules.current)
        return Json(TrialModel.of(trials.begin(wanted, who.name, clock())), 201)

    @routes.delete("/rule/trial", response_model=TrialModel)
    async def end(_: Operator) -> Response:
        """End the trial; the answer is how it stood."""
        return Json(TrialModel.of(trials.end()))

    @routes.post("/rule/trial/promote", response_model=RuleModel)
    async def promote(body: Promotion, who: Operator) -> Response:
        """Put the candidate in force, with what came of the trial."""
        return Json(RuleModel.of(await trials.promote(who.name, clock(), body.version)))

    return routes
