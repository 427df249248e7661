"""The folder of a run: whole files or none."""

import json

import pytest

from farm_ar.agents.training.run_folder import RunError, RunFolder, Table, read_table


def test_a_run_is_read_as_it_was_described(tmp_path, tiny):
    run = tiny(n_timesteps=7)
    folder = RunFolder(tmp_path / "run")
    assert not folder.exists
    folder.describe(run)
    assert folder.exists
    assert folder.read() == run
    folder.describe(run)
    assert len(json.loads((tmp_path / "run" / "run.json").read_text())["commands"]) == 2


def test_what_belongs_to_no_run_is_named(tmp_path, tiny):
    with pytest.raises(RunError, match=r"run\.json: file: must be a readable file"):
        RunFolder(tmp_path).read()
    RunFolder(tmp_path).describe(tiny())
    (tmp_path / "hyperparameters.yml").unlink()
    with pytest.raises(RunError, match=r"hyperparameters\.yml: file: must be a readable file"):
        RunFolder(tmp_path).read()
    with pytest.raises(RunError, match="best: must hold a model"):
        RunFolder(tmp_path).newest("best")


def test_the_newest_stay(tmp_path):
    folder = RunFolder(tmp_path)
    for steps in (5, 100, 20):
        folder.keep("best", steps, lambda at: (at / "model").write_text("m"))
    assert [path.name for path in folder.kept("best")] == ["000000020", "000000100"]
    assert folder.newest("best").name == "000000100"


def test_what_is_interrupted_leaves_nothing(tmp_path):
    def interrupted(at):
        (at / "model").write_text("half")
        raise KeyboardInterrupt

    folder = RunFolder(tmp_path)
    folder.keep("best", 1, lambda at: (at / "model").write_text("m"))
    with pytest.raises(KeyboardInterrupt):
        folder.keep("best", 2, interrupted)
    assert [path.name for path in (tmp_path / "best").iterdir()] == ["000000001"]


def test_who_goes_back_to_a_checkpoint_forgets_what_came_after_and_what_is_unfinished(tmp_path):
    folder = RunFolder(tmp_path)
    for kind, steps in (("checkpoints", 32), ("checkpoints", 64), ("best", 40), ("best", 70)):
        folder.keep(kind, steps, lambda at: (at / "model").write_text("m"))
    (tmp_path / "best" / ".90-abc").mkdir()
    folder.go_back(64)
    left = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.glob("*/*"))
    assert left == ["best/000000040", "checkpoints/000000032", "checkpoints/000000064"]
    folder.keep("best", 70, lambda at: (at / "model").write_text("another"))
    assert (folder.newest("best") / "model").read_text() == "another"


def test_what_a_killed_process_left_is_not_taken_for_a_checkpoint(tmp_path):
    (tmp_path / "best" / ".9-abc").mkdir(parents=True)
    assert RunFolder(tmp_path).kept("best") == []


def test_a_table_goes_on_from_the_steps_it_is_told(tmp_path):
    path = tmp_path / "table.csv"
    table = Table(path, ("steps", "value"), until=0)
    for steps in (1, 2, 3):
        table.add(steps=steps, value=steps / 2)
    Table(path, ("steps", "value"), until=2).add(steps=9, value=0)
    assert [row["steps"] for row in read_table(path)] == [1, 2, 9]
    assert path.read_text().splitlines() == ["steps,value", "1,0.5", "2,1.0", "9,0"]
    assert read_table(tmp_path / "none.csv") == []
