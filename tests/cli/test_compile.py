"""`farm-ar compile`: the machine code of kernels, made ahead."""

import pytest

from farm_ar.cli.compile import STEPS, _command
from farm_ar.errors import UnfinishedError


def test_what_is_compiled_is_on_the_disk_and_nothing_is_printed(run, tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    done = run("compile", "design", "--workers", 1)
    assert (done.exit_code, done.stdout) == (0, "")
    assert list((tmp_path / "kept").rglob("design._spread_out-*.nbc"))


def test_a_part_that_is_not_known_is_refused_with_the_list(mistake):
    told = mistake("compile", "coffee")
    assert "part" in told
    assert all(name in told for name in STEPS)


def test_a_part_that_ends_with_a_mistake_does_not_count_as_compiled():
    with pytest.raises(UnfinishedError, match=r"scenes validate nothing\.json ended with exit code 2"):
        _command("scenes", "validate", "nothing.json")
