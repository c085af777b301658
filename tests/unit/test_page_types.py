"""The page's types are those of the models, and name what the server sends."""

import pytest

from iveg.models.typescript import TOLD, WRITTEN, write_types
from tests.processes import ROOT


@pytest.mark.parametrize("name", WRITTEN)
def test_what_the_page_has_from_python_is_fresh(name: str) -> None:
    stale = f"iveg/static/js/{name}: python -m iveg.models.typescript"

    assert (ROOT / "iveg/static/js" / name).read_text() == WRITTEN[name](), stale


def test_a_field_of_a_model_is_a_member_of_its_type() -> None:
    written = write_types()

    for model in TOLD:
        declared = written.split(f"export type {model.__name__} = {{")[1].split("};")[0]
        for name, field in model.model_fields.items():
            assert f"  {field.serialization_alias or name}: " in declared


def test_null_lists_words_and_maps_are_written_as_typescript_has_them() -> None:
    written = write_types()

    assert 'mode: "RUNNING" | "SLOW" | "STOPPED";' in written
    assert "points: [number, number][];" in written
    assert "detections: Record<string, DetectionFrame>;" in written
    assert 'class: "person" | "robot";' in written
    assert "climate: Climate | null;" in written
