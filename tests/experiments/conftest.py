"""Scenes to run the experiments on: our own, and those of the paper's authors."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from farm_ar.experiments.setting import load_scenes
from farm_ar.scenes import Scene


@pytest.fixture(scope="session")
def own_scenes() -> Mapping[str, Scene]:
    return load_scenes(None)


@pytest.fixture(scope="session")
def authors_scenes(paper_scenes: Path) -> Mapping[str, Scene]:
    return load_scenes(paper_scenes)
