"""Running sweeps: the same results by every executor, finished units left alone."""

from pathlib import Path

import numpy as np
import pytest

from farm_ar.sweeps import ProcessExecutor, SerialExecutor, Sweep, grid, run_sweep


@pytest.fixture(params=[SerialExecutor, ProcessExecutor])
def executor(request):
    with request.param() as executor:
        yield executor


def test_every_unit_gives_its_row_in_the_order_of_the_units(executor):
    sweep = Sweep("doubles", "sweep_functions:double", grid(x=range(5)), seeds=(0, 7))
    assert run_sweep(sweep, executor=executor).rows() == [
        {"double": 2 * x, "drawn": np.random.default_rng([seed, x]).random()}
        for x in range(5)
        for seed in (0, 7)
    ]


def test_a_finished_unit_is_never_computed_twice(executor, tmp_path):
    log = tmp_path / "log"
    for xs in (range(4), range(2, 6)):
        sweep = Sweep("doubles", "sweep_functions:logged", grid(x=xs, log=[str(log)]))
        assert len(run_sweep(sweep, tmp_path / "store", executor)) == 4
    assert sorted(log.read_text().split()) == ["0", "1", "2", "3", "4", "5"]


def test_a_fresh_start_forgets_the_former_units_too(tmp_path):
    log = tmp_path / "log"
    for name, xs, fresh in (("one", range(4), False), ("one", range(2, 6), True), ("two", range(2), False)):
        units = grid(x=xs, log=[str(log)])
        run_sweep(Sweep(name, "sweep_functions:logged", units), tmp_path / "store", fresh=fresh)
    assert log.read_text().split() == ["0", "1", "2", "3", "2", "3", "4", "5", "0", "1"]


def test_the_guide_shows_the_example_as_it_is():
    root = Path(__file__).parents[2]
    shown = (root / "docs" / "sweeps.md").read_text().partition("```python\n")[2].partition("```")[0]
    assert (root / "examples" / "own_sweep.py").read_text().endswith(shown)
