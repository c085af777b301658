"""The API as a page can show it: the OpenAPI document, flattened and frozen.

``/docs`` is drawn on the server from this, so that it needs no script and no CDN; the
document itself stays at ``/openapi.json``.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from fastapi import FastAPI
from fastapi.openapi.models import (
    MediaType,
    OpenAPI,
    Operation,
    Parameter,
    PathItem,
    Reference,
    RequestBody,
    Response,
    Schema,
)

from iveg.web.refusals import declared_actions
from iveg.web.security.roles import Action

METHODS = ("get", "post", "put", "patch", "delete")


@dataclass(frozen=True, slots=True)
class FieldDoc:
    """One parameter of a call or one member of a shape.

    Attributes:
        where: ``path``, ``query``, ``header`` or ``cookie``; empty in a shape.
        shape: In words: ``number``, ``[Robot, …]``, ``text or null``.
        limits: In words: ``≥ 0, ≤ 1``; empty where there are none.
    """

    name: str
    shape: str
    where: str = ""
    required: bool = False
    limits: str = ""
    description: str = ""


@dataclass(frozen=True, slots=True)
class AnswerDoc:
    """One answer that a call may give."""

    status: str
    description: str
    shape: str = ""


@dataclass(frozen=True, slots=True)
class CallDoc:
    """One method of one path.

    Attributes:
        anchor: Stable id for links on the page.
        action: What the caller must be allowed to: ``read``, ``stop``, ``release`` …
        body: Shape of the JSON body; empty where there is none.
    """

    method: str
    path: str
    anchor: str
    action: Action | None
    summary: str
    description: str
    parameters: tuple[FieldDoc, ...]
    body: str
    answers: tuple[AnswerDoc, ...]


@dataclass(frozen=True, slots=True)
class GroupDoc:
    """Calls that belong together, by their first tag."""

    name: str
    calls: tuple[CallDoc, ...]


@dataclass(frozen=True, slots=True)
class ShapeDoc:
    """A named JSON object."""

    name: str
    description: str
    fields: tuple[FieldDoc, ...]


@dataclass(frozen=True, slots=True)
class ApiDoc:
    """All that ``/docs`` shows."""

    title: str
    version: str
    groups: tuple[GroupDoc, ...]
    shapes: tuple[ShapeDoc, ...]


def describe_api(app: FastAPI) -> ApiDoc:
    """Flatten the OpenAPI document of a finished application."""
    document = OpenAPI.model_validate(app.openapi())
    groups: dict[str, list[CallDoc]] = {}
    actions = declared_actions(app)
    for path, method, operation in _operations(document.paths or {}):
        tag = operation.tags[0] if operation.tags else "api"
        action = actions.get((path, method.upper()))
        groups.setdefault(tag, []).append(_call(path, method, operation, action))
    return ApiDoc(
        document.info.title,
        document.info.version,
        tuple(GroupDoc(name, tuple(calls)) for name, calls in groups.items()),
        tuple(_shapes(document)),
    )


def _operations(
    paths: Mapping[str, object],
) -> Iterator[tuple[str, str, Operation]]:
    for path, raw in paths.items():
        item = PathItem.model_validate(raw)
        for method in METHODS:
            operation = getattr(item, method)
            if isinstance(operation, Operation):
                yield path, method, operation


def _call(
    path: str, method: str, operation: Operation, action: Action | None
) -> CallDoc:
    return CallDoc(
        method.upper(),
        path,
        _anchor(method, path),
        action,
        operation.summary or "",
        operation.description or "",
        tuple(
            _parameter(parameter)
            for parameter in operation.parameters or []
            if isinstance(parameter, Parameter)
        ),
        _body(operation.requestBody),
        tuple(
            _answer(status, Response.model_validate(answer))
            for status, answer in (operation.responses or {}).items()
        ),
    )


def _anchor(method: str, path: str) -> str:
    words = "".join(c if c.isalnum() else " " for c in path).split()
    return "-".join([method, *words])


def _parameter(parameter: Parameter) -> FieldDoc:
    schema = parameter.schema_
    return FieldDoc(
        parameter.name,
        shape_of(schema),
        parameter.in_.value,
        bool(parameter.required),
        _limits(schema),
        parameter.description or "",
    )


def _body(body: RequestBody | Reference | None) -> str:
    return _content(body.content) if isinstance(body, RequestBody) else ""


def _answer(status: str, answer: Response) -> AnswerDoc:
    return AnswerDoc(status, answer.description, _content(answer.content or {}))


def _content(content: Mapping[str, MediaType]) -> str:
    media = content.get("application/json")
    return "" if media is None else shape_of(media.schema_)


def _shapes(document: OpenAPI) -> Iterator[ShapeDoc]:
    schemas = document.components.schemas if document.components else None
    for name, schema in sorted((schemas or {}).items()):
        if isinstance(schema, Schema) and schema.properties:
            yield ShapeDoc(name, schema.description or "", tuple(_members(schema)))


def _members(schema: Schema) -> Iterator[FieldDoc]:
    required = frozenset(schema.required or ())
    for name, member in (schema.properties or {}).items():
        described = member.description if isinstance(member, Schema) else None
        yield FieldDoc(
            name,
            shape_of(member),
            required=name in required,
            limits=_limits(member),
            description=described or "",
        )


# --- a JSON schema in words ---------------------------------------------------------


def shape_of(schema: object) -> str:
    """A schema in a few words, such as ``[Robot, …]`` or ``number or null``."""
    if isinstance(schema, Schema | Reference) and schema.ref is not None:
        return schema.ref.rpartition("/")[2]
    if not isinstance(schema, Schema):
        return "anything"
    if schema.enum:
        return _either(str(value) for value in schema.enum)
    if schema.const is not None:
        return str(schema.const)
    choices = schema.anyOf or schema.oneOf or schema.allOf
    if choices:
        return _either(shape_of(choice) for choice in choices)
    if isinstance(schema.type, list):
        return _either(schema.type)
    if schema.type == "array":
        return f"[{shape_of(schema.items)}, …]" if schema.items else "[…]"
    if schema.type == "object" and isinstance(schema.additionalProperties, Schema):
        return f"{{name: {shape_of(schema.additionalProperties)}}}"
    return _word(schema)


def _either(types: Iterable[str]) -> str:
    return " or ".join(dict.fromkeys(types))


def _word(schema: Schema) -> str:
    if schema.format == "date-time":
        return "time (ISO-8601 UTC)"
    words = {"string": "text", "boolean": "true or false"}
    return words.get(str(schema.type), str(schema.type or "anything"))


def _limits(schema: object) -> str:
    if not isinstance(schema, Schema):
        return ""
    limits = (
        ("≥", schema.minimum),
        (">", schema.exclusiveMinimum),
        ("≤", schema.maximum),
        ("<", schema.exclusiveMaximum),
        ("shortest", schema.minLength),
        ("longest", schema.maxLength),
        ("fewest", schema.minItems),
        ("most", schema.maxItems),
        ("pattern", schema.pattern),
    )
    own = [f"{word} {value}" for word, value in limits if value is not None]
    # An optional value has its limits on the branch that is not null.
    branches = [text for branch in schema.anyOf or () if (text := _limits(branch))]
    return ", ".join(own + branches)
