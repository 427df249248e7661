"""Several seeds of one training beside each other: each as if it had been trained alone."""

from dataclasses import replace

import pytest
from typer.testing import CliRunner

from farm_ar.agents.training.run_folder import BEST, RunFolder
from farm_ar.agents.training.seeds import STORE, train_seeds
from farm_ar.agents.training.training import train
from farm_ar.cli.program import app
from farm_ar.errors import OptionError
from farm_ar.sweeps import SerialExecutor, Store


def test_each_seed_is_the_run_of_that_seed_and_is_trained_once(tiny, tmp_path):
    run = tiny()
    folders = train_seeds(run, [3, 4], tmp_path / "beside", SerialExecutor())
    assert [folder.name for folder in folders] == ["seed-3", "seed-4"]
    kept = [folder.stat().st_mtime_ns for folder in folders]
    again = train_seeds(run, [3, 4], tmp_path / "beside", SerialExecutor())
    assert [folder.stat().st_mtime_ns for folder in again] == kept
    train(replace(run, seed=4), tmp_path / "alone")
    curves = [(folder / "evaluations.csv").read_bytes() for folder in (folders[1], tmp_path / "alone")]
    assert curves[0] == curves[1]
    assert RunFolder(folders[1]).read() == RunFolder(tmp_path / "alone").read() == replace(run, seed=4)
    assert RunFolder(folders[1]).newest(BEST).name == RunFolder(tmp_path / "alone").newest(BEST).name
    other = replace(run, eval_episodes=run.eval_episodes + 1)
    with pytest.raises(OptionError, match="run: must be another folder"):
        train_seeds(other, [3], tmp_path / "beside", SerialExecutor())
    with Store(tmp_path / "beside" / STORE, create=False) as store:
        learnt = [outcome.rows[-1]["learnt"] for outcome in store.results("seeds").outcomes()]
    assert len({*learnt}) == 2


def test_a_folder_that_is_gone_is_made_again_from_the_store(tiny, tmp_path):
    (folder,) = train_seeds(tiny(), [0], tmp_path, SerialExecutor())
    before = {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()}
    for file in sorted(folder.rglob("*"), reverse=True):
        file.unlink() if file.is_file() else file.rmdir()
    folder.rmdir()
    train_seeds(tiny(), [0], tmp_path, SerialExecutor())
    assert {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()} == before


def test_what_shares_seeds_needs_seeds(tmp_path):
    result = CliRunner().invoke(app, ["train", str(tmp_path / "run"), "--workers", "2"])
    assert result.exit_code == 2
    assert "--seeds: must be given with --workers, --executor and --address" in result.stderr
    assert not (tmp_path / "run").exists()
