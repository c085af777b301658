"""The page of resources has every key of every model with its type, and no other."""

import re

import pytest
from pydantic.json_schema import models_json_schema

from iveg.models.alert import AcknowledgedAlerts
from iveg.models.base import Model
from iveg.models.cost import Cost
from iveg.models.day import Day
from iveg.models.device import Device
from iveg.models.dictionary import DictionaryColumn
from iveg.models.equipment import Measurement
from iveg.models.kept_detection import DetectionRow, KeptDetection
from iveg.models.note import Note
from iveg.models.odometry import OdometryRow
from iveg.models.recordings import Recording
from iveg.models.signing_in import SessionsEnded
from iveg.models.typescript import TOLD
from tests.architecture import documents
from tests.processes import ROOT

PAGE = (documents.INTERFACES / "resources.md").read_text()
_SHOWN: tuple[type[Model], ...] = (
    *TOLD,
    AcknowledgedAlerts,
    Cost,
    Day,
    Device,
    KeptDetection,
    DetectionRow,
    OdometryRow,
    Measurement,
    Recording,
    DictionaryColumn,
    Note,
    SessionsEnded,
)
_, _DOCUMENT = models_json_schema([(model, "serialization") for model in _SHOWN])
_SHAPES = _DOCUMENT["$defs"]
MODELS = {
    name: schema["properties"]
    for name, schema in _SHAPES.items()
    if "properties" in schema
}


@pytest.mark.parametrize("model", sorted(MODELS))
def test_every_key_of_a_model_has_its_row(model: str) -> None:
    rows = documents.keys(documents.section(PAGE, model))

    assert sorted(rows) == sorted(MODELS[model])


@pytest.mark.parametrize("model", sorted(MODELS))
def test_every_row_has_the_type_of_its_key(model: str) -> None:
    told = dict(documents.types(documents.section(PAGE, model)))

    assert told == {
        key: documents.type_of(schema, _SHAPES) for key, schema in MODELS[model].items()
    }


def test_every_resource_of_the_page_is_a_model() -> None:
    assert set(documents.headings(PAGE)) - {"Resources"} == set(MODELS)


def test_every_metric_has_its_row() -> None:
    page = documents.section((documents.INTERFACES / "http.md").read_text(), "Metrics")
    files = (ROOT / "iveg/web/api").glob("*metrics.py")
    told = "".join(one.read_text() for one in files)
    metrics = {f"iveg_{one}" for one in re.findall(r'family\(\s*"([a-z_]+)"', told)}

    assert metrics - set(documents.keys(page)) == set()
