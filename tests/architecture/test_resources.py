"""The page of resources is as the models are, and the metrics have their rows."""

import re

from iveg.models.docs import write_page
from tests.architecture import documents
from tests.processes import ROOT


def test_the_page_of_resources_is_what_the_models_say() -> None:
    page = (documents.INTERFACES / "resources.md").read_text()

    is_fresh = page == write_page()

    assert is_fresh, "python -m iveg.models.docs > docs/interfaces/resources.md"


def test_every_metric_has_its_row() -> None:
    page = documents.section((documents.INTERFACES / "http.md").read_text(), "Metrics")
    told = (ROOT / "iveg/web/api/health.py").read_text()
    found = re.findall(r'\(\s*"(counter|gauge)",\s*"([a-z_]+)"', told)
    metrics = {f"iveg_{name}{'_total' * (kind == 'counter')}" for kind, name in found}

    assert len(metrics) > 5
    assert metrics - set(documents.keys(page)) == set()
