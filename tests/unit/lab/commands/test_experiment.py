"""An experiment's own settings."""

from pathlib import Path

from iveg.lab.commands.experiment import experiment_settings
from iveg.settings import Settings


def test_the_fleet_is_the_papers_and_secrets_are_new(tmp_path: Path) -> None:
    site = Settings(robots=("R1",), api_token="known", greenhouse="none")

    placed = experiment_settings(tmp_path, site)

    assert placed.robots == ("AGI", "AGII")
    assert placed.greenhouse == "mvsim-20x20"
    assert placed.api_token not in ("", "known")
    assert Path(placed.data_directory).parent == tmp_path
