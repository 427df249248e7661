"""The version of the code: whatever may change the results changes it."""

from importlib import invalidate_caches

import pytest

from farm_ar import __version__
from farm_ar.sweeps import ProcessExecutor, Sweep, grid, run_sweep, unit
from farm_ar.sweeps.unit import code_version

BODY = "def triple(seed, x):\n    return {'triple': 3 * x}\n"


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A module and a package of the user's own; gives a function that says the version of either anew."""
    (tmp_path / "own_module.py").write_text(BODY)
    (tmp_path / "own_package").mkdir()
    for name in ("__init__", "work", "aid"):
        (tmp_path / "own_package" / f"{name}.py").write_text(BODY)
    monkeypatch.syspath_prepend(tmp_path)
    invalidate_caches()

    def version(function):
        code_version.cache_clear()
        return code_version(function)

    yield version
    code_version.cache_clear()


def test_a_version_names_that_of_farm_ar(own):
    assert own("own_module:triple").startswith(f"{__version__}+")


@pytest.mark.parametrize(
    ("file", "changes"), [("own_module.py", True), ("own_package/aid.py", False), ("other.py", False)]
)
def test_a_function_in_a_file_changes_with_that_file(own, tmp_path, file, changes):
    before = own("own_module:triple")
    (tmp_path / file).write_text(BODY.replace("3 * x", "x * 3"))
    assert (own("own_module:triple") != before) == changes


@pytest.mark.parametrize("file", ["work.py", "aid.py", "table.csv"])
def test_a_function_in_a_package_changes_with_any_file_of_the_package(own, tmp_path, file):
    before = own("own_package.work:triple")
    assert own("own_package.work:triple") == before
    (tmp_path / "own_package" / file).write_text("# changed")
    assert own("own_package.work:triple") != before


def test_compiled_and_hidden_files_do_not_count(own, tmp_path):
    before = own("own_package.work:triple")
    (tmp_path / "own_package" / "__pycache__").mkdir(exist_ok=True)
    (tmp_path / "own_package" / "__pycache__" / "work.cpython-311.pyc").write_bytes(b"1")
    (tmp_path / "own_package" / ".work.py.swp").write_bytes(b"1")
    assert own("own_package.work:triple") == before


def test_every_function_changes_with_farm_ar_itself(own, tmp_path, monkeypatch):
    before = own("own_module:triple")
    files = unit._files
    other = [("farm_ar/reid/costs.py", b"# changed")]
    monkeypatch.setattr(unit, "_files", lambda top: files(top) + (other if top == "farm_ar" else []))
    assert own("own_module:triple") != before


def test_another_version_of_a_library_is_another_version(own, monkeypatch):
    before = own("own_module:triple")
    monkeypatch.setattr(unit.metadata, "version", lambda name: "0.0.1")
    assert own("own_module:triple") != before


def test_results_of_changed_code_are_computed_anew_unless_the_version_is_vouched_for(own, tmp_path):
    store = tmp_path / "store"
    done = {}

    def units_run(version):
        code_version.cache_clear()
        sweep = Sweep("s", "own_module:triple", grid(x=(1, 2)), version=version)
        run_sweep(sweep, store, watch=lambda standing: done.update(n=standing.done))
        return done["n"]

    assert [units_run(None), units_run(None), units_run("7")] == [2, 0, 2]
    (tmp_path / "own_module.py").write_text(BODY.replace("3 * x", "x + x + x"))
    assert [units_run(None), units_run("7")] == [2, 0]


def test_a_worker_whose_code_was_changed_meanwhile_computes_nothing(own, tmp_path):
    sweep = Sweep("s", "own_module:triple", grid(x=(1,)))
    vouched = Sweep("s", "own_module:triple", grid(x=(1,)), version="7")
    assert sweep.units
    (tmp_path / "own_module.py").write_text(BODY.replace("3 * x", "4 * x"))
    with ProcessExecutor(1) as executor:
        (failure,) = run_sweep(sweep, executor=executor).failures
        assert "is not that which the sweep began with" in failure.problem
        assert run_sweep(vouched, executor=executor).rows() == [{"triple": 4}]


def test_a_library_that_is_missing_and_a_module_made_by_hand_have_versions_too(own, monkeypatch):
    before = own("own_module:triple")
    monkeypatch.setattr(unit, "NUMBERS_FROM", ("a-library-that-nobody-has",))
    assert own("own_module:triple") != before
    assert own("no_such_module:triple") != own("own_module:triple")
