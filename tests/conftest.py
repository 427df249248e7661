"""What every test may use: repeatable random numbers, repeatable Hypothesis, the authors' layouts."""

import os
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import HealthCheck, settings

mpl.use("Agg")
os.environ["FARM_AR_QUIET"] = "1"  # kernels are compiled without a word, for what is printed is compared

EVERYTHING = os.environ.get("FARM_AR_TESTS") == "all"
"""Whether the counts are full (`make test-all`); `make test` has a twentieth of them and no long test.

What a test repeats by itself it scales with `settings().max_examples`, as Hypothesis does.
"""

usual = settings(
    derandomize=True, deadline=None, max_examples=50, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("default", usual)
settings.register_profile("all", usual, max_examples=1000)
settings.load_profile("all" if EVERYTHING else "default")


def pytest_configure(config: pytest.Config) -> None:
    if EVERYTHING and config.option.markexpr == "not long":  # and not what was asked for by hand
        config.option.markexpr = ""


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
