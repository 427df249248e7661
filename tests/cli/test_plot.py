"""`farm-ar plot`: the picture of learning curves."""

from farm_ar.agents.training.recipes import Recipe
from farm_ar.agents.training.run_folder import Run, RunFolder


def test_runs_are_drawn_and_what_they_came_to_is_told(run, mistake, tmp_path):
    for seed in (0, 1):
        folder = RunFolder(tmp_path / f"run-{seed}")
        folder.path.mkdir()
        folder.describe(Run("ppo", "SceneLayout-v0", seed, Recipe()))
        rows = f"steps,mean_return,best_mean_return\n10,0.0,0.0\n20,{1 + seed},0\n"
        (folder.path / "evaluations.csv").write_text(rows)
    runs, out = [tmp_path / f"run-{seed}" for seed in (0, 1)], tmp_path / "new" / "curves.png"
    told = run("plot", *runs, "--out", out).stdout
    assert out.read_bytes().startswith(b"\x89PNG")
    assert told == f"ppo: 1.50 after 20 steps, 2 seeds\nWrote {out}\n"
    wrong = mistake("plot", *runs, "--out", tmp_path / "curves.txt")
    assert wrong.startswith("OptionError: --out: must end in .svg, .png or .pdf")
    assert mistake("plot", tmp_path / "none", "--out", out).startswith("RunError: ")
    assert "training.csv: must hold finite numbers" in mistake("plot", *runs, "--training", "--out", out)


def test_where_known_policies_have_no_lines_that_is_said(run, tmp_path):
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    folder.describe(Run("ppo", "SceneLayout-v0", 0, Recipe(env_kwargs={"reward": "margin"})))
    (folder.path / "evaluations.csv").write_text("steps,mean_return,best_mean_return\n10,1,0\n20,-0.001,0\n")
    told = run("plot", folder.path, "--out", tmp_path / "curves.svg").stdout.splitlines()
    assert told[0].startswith("No lines of reference policies: ")
    assert told[1] == "ppo: 0.00 after 20 steps, 1 seeds"
