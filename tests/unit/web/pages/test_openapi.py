"""The API page shows what the routes say."""

from datetime import datetime
from typing import Annotated, Literal

import pytest
from fastapi import APIRouter, Depends, FastAPI, Path, Query
from pydantic import BaseModel, Field

from iveg.web.pages.openapi import ApiDoc, CallDoc, FieldDoc, describe_api
from iveg.web.security.requirements import require


class Pose(BaseModel):
    x: float = Field(description="Metres east.")


class Robot(BaseModel):
    """A robot as browsers see it."""

    robot_id: str
    link: Literal["LIVE", "LOST"]
    pose: Pose | None = None
    path: list[tuple[float, float]] = Field(default=[], max_length=1024)
    stamp: datetime
    seen: dict[str, int] = {}
    holds: list[Pose] = []


class Release(BaseModel):
    holds: list[str]


@pytest.fixture
def api() -> ApiDoc:
    router = APIRouter(prefix="/api/v1", tags=["robots"])

    @router.get("/robots/{robot_id}", dependencies=[Depends(require("read"))])
    async def robot(
        robot_id: Annotated[str, Path(max_length=64, description="Which one.")],
        since: Annotated[float | None, Query(ge=0)] = None,
    ) -> Robot:
        """One robot.

        With its age.
        """
        raise AssertionError(robot_id, since)

    @router.post(
        "/robots/{robot_id}/release",
        status_code=202,
        dependencies=[Depends(require("release"))],
    )
    async def release(robot_id: str, body: Release) -> None: ...

    app = FastAPI(title="iVeg", version="1.2.3")
    app.include_router(router)
    app.add_api_route("/healthz", lambda: None)
    return describe_api(app)


def call(api: ApiDoc, method: str) -> CallDoc:
    return next(c for g in api.groups for c in g.calls if c.method == method)


def member(api: ApiDoc, shape: str, name: str) -> FieldDoc:
    fields = next(found.fields for found in api.shapes if found.name == shape)
    return next(field for field in fields if field.name == name)


def test_calls_are_grouped_by_tag_under_title_and_version(api: ApiDoc) -> None:
    assert (api.title, api.version) == ("iVeg", "1.2.3")
    assert [(group.name, len(group.calls)) for group in api.groups] == [
        ("robots", 2),
        ("api", 1),
    ]


def test_each_call_says_what_the_caller_must_be_allowed_to(api: ApiDoc) -> None:
    actions = [c.action for group in api.groups for c in group.calls]

    assert actions == ["read", "release", None]


def test_a_call_has_its_words_its_parameters_and_its_answers(api: ApiDoc) -> None:
    get = call(api, "GET")

    assert get.summary == "Robot"
    assert get.description.startswith("One robot.")
    assert get.anchor == "get-api-v1-robots-robot-id"
    assert get.parameters == (
        FieldDoc("robot_id", "text", "path", True, "longest 64", "Which one."),
        FieldDoc("since", "number or null", "query", False, "≥ 0.0"),
    )
    assert get.answers[0].shape == "Robot"
    assert get.body == ""


def test_a_body_is_named_by_its_shape(api: ApiDoc) -> None:
    assert call(api, "POST").body == "Release"


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("robot_id", "text"),
        ("link", "LIVE or LOST"),
        ("pose", "Pose or null"),
        ("stamp", "time (ISO-8601 UTC)"),
        ("seen", "{name: integer}"),
        ("holds", "[Pose, …]"),
        ("path", "[[…], …]"),
    ],
)
def test_a_shape_is_told_in_words(api: ApiDoc, name: str, shape: str) -> None:
    assert member(api, "Robot", name).shape == shape


def test_a_shape_says_what_is_required_limited_and_meant(api: ApiDoc) -> None:
    assert member(api, "Robot", "robot_id").required
    assert not member(api, "Robot", "seen").required
    assert member(api, "Robot", "path").limits == "most 1024"
    assert member(api, "Pose", "x").description == "Metres east."
