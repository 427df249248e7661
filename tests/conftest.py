"""What every test may use: repeatable random numbers, repeatable Hypothesis, the authors' layouts."""

import os
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import HealthCheck, settings

mpl.use("Agg")
os.environ["FARM_AR_QUIET"] = "1"  # kernels are compiled without a word, for what is printed is compared

settings.register_profile(
    "default",
    derandomize=True,
    deadline=None,
    max_examples=50,
    suppress_health_check=[HealthCheck.too_slow],
)
# For a longer search by hand: pytest --hypothesis-profile=thorough
settings.register_profile("thorough", deadline=None, max_examples=2000)
settings.load_profile("default")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.fixture(scope="session")
def paper_scenes() -> Path:
    """The folder with the layouts of the paper's authors; tests that need it are skipped without it."""
    folder = os.environ.get("FARM_AR_PAPER_SCENES")
    if not folder:
        pytest.skip("FARM_AR_PAPER_SCENES is not set: it names the folder with the paper authors' layouts")
    path = Path(folder)
    if not path.is_dir():
        pytest.fail(f"FARM_AR_PAPER_SCENES is {folder!r}, which is not a folder")
    return path
