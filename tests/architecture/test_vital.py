"""Every module of the pipeline is vital or comfort, and the contract says which."""

import tomllib

from tests.processes import ROOT

_WIRES = {"iveg.pipeline.build", "iveg.pipeline.parts", "iveg.pipeline.services"}
"""Give comfort to what is vital; hold none of it."""


def _contract() -> tuple[set[str], set[str]]:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = settings["tool"]["importlinter"]["contracts"]
    (found,) = [one for one in contracts if one["name"].startswith("vital keeps")]
    return set(found["source_modules"]), set(found["forbidden_modules"])


def test_every_module_of_the_pipeline_is_vital_or_comfort() -> None:
    vital, comfort = _contract()
    modules = {
        f"iveg.pipeline.{path.stem}"
        for path in (ROOT / "iveg/pipeline").glob("*.py")
        if path.stem != "__init__"
    }

    assert modules - vital - comfort == _WIRES
    assert vital & comfort == set()


def test_what_the_page_calls_comfort_is_comfort() -> None:
    _, comfort = _contract()

    assert comfort >= {
        "iveg.pipeline.mapping",
        "iveg.pipeline.coverage",
        "iveg.pipeline.margins",
        "iveg.pipeline.messenger",
        "iveg.adapters.history",
        "iveg.adapters.provisioner",
        "iveg.web",
    }
