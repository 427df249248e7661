"""Learning curves of several runs: what is averaged, which lines stand beside them, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from farm_ar.agents.training.curves import curves_of, draw, save
from farm_ar.agents.training.recipes import Recipe
from farm_ar.agents.training.run_folder import Run, RunError, RunFolder
from farm_ar.envs.references import reference_returns
from farm_ar.errors import OptionError


@pytest.fixture
def made(tmp_path):
    """Makes a run's folder with an evaluation at each of some steps."""

    def make(name, points, env="SceneLayout-v0", algo="ppo", seed=0, settings=None, **arguments):
        folder = RunFolder(tmp_path / name)
        folder.path.mkdir()
        folder.describe(Run(algo, env, seed, Recipe(env_kwargs=arguments, settings=settings or {})))
        rows = "".join(f"{steps},{value},{value}\n" for steps, value in points)
        (folder.path / "evaluations.csv").write_text("steps,mean_return,best_mean_return\n" + rows)
        return str(folder.path)

    return make


def test_runs_that_differ_in_the_seed_are_one_curve_on_the_steps_that_all_have(made):
    runs = [made("a", [(0, 0.0), (100, 1.0), (300, 3.0)]), made("b", [(50, 1.0), (250, 5.0)], seed=1)]
    (curve,), _ = curves_of(runs)
    assert curve.name == "ppo"
    np.testing.assert_array_equal(curve.steps, [50, 100, 250])
    np.testing.assert_allclose(curve.returns, [[0.5, 1.0, 2.5], [1.0, 2.0, 5.0]])


def test_another_learner_or_other_hyperparameters_are_another_curve(made):
    points = [(0, 0.0), (10, 1.0)]
    runs = [made("a", points), made("b", points, algo="sac"), made("c", points, settings={"gamma": 0.5})]
    assert [curve.name for curve in curves_of(runs)[0]] == ["ppo", "sac", "ppo (c)"]


def test_known_policies_are_lines_where_returns_are_of_the_same_kind_only(made):
    points = [(0, 0.0), (10, 1.0)]
    wanted = {name: one.mean for name, one in reference_returns("SceneLayout-v0").items()}
    assert curves_of([made("a", points)])[1] == wanted
    assert curves_of([made("b", points, env="SceneLayoutBlackBox-v0")])[1] == wanted
    assert curves_of([made("c", points, reward="margin")])[1] == {}
    assert curves_of([made("d", points, env="SceneLayoutShaped-v0")])[1] == {}
    assert curves_of([made("e", points, env="CartPole-v1")])[1] == {}
    assert curves_of([made("f", points, env="FarmToTable-v0", play_seconds=0.0)])[1] != {}


def test_runs_with_other_returns_are_not_drawn_together(made):
    points = [(0, 0.0), (10, 1.0)]
    first = made("a", points)
    for other in (made("b", points, env="FarmToTable-v0"), made("c", points, reward="margin")):
        with pytest.raises(OptionError, match="run: must be of the same environment"):
            curves_of([first, other])


def test_a_run_without_a_curve_is_refused(made, tmp_path):
    with pytest.raises(RunError, match="the run has not come so far"):
        curves_of([made("a", [])])
    with pytest.raises(RunError, match="the run has not come so far"):
        curves_of([made("b", [(0, "nan")])])
    with pytest.raises(OptionError, match="steps in common"):
        curves_of([made("c", [(0, 0.0), (5, 0.0)]), made("d", [(7, 0.0), (9, 0.0)], seed=1)])
    with pytest.raises(RunError):
        curves_of([str(tmp_path / "none")])


def test_the_picture_has_each_run_the_mean_and_the_lines_and_repeats_byte_for_byte(made, tmp_path):
    runs = [made("a", [(0, 0.0), (10, 1.0)]), made("b", [(0, 0.5), (10, 2.0)], seed=1)]
    curves, references = curves_of(runs)
    figure = draw(curves, references, "A title")
    (axes,) = figure.axes
    heights = [line.get_ydata()[-1] for line in axes.get_lines()]
    assert heights[:3] == [1.0, 2.0, 1.5]
    assert heights[3:] == list(references.values())
    for name in ("one.svg", "two.svg"):
        save(draw(curves, references, "A title"), tmp_path / name)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()


def test_names_of_lines_that_lie_together_stand_apart(made):
    curves, _ = curves_of([made("a", [(0, 0.0), (10, 1.0)])])
    (axes,) = draw(curves, {"low": 0.5, "also low": 0.501, "high": 0.9}, "").axes
    heights = {text.get_text().rsplit(" ", 1)[0]: text.xy[1] for text in axes.texts}
    low, high = axes.get_ylim()
    assert heights["low"] == 0.5
    assert heights["high"] == 0.9
    assert heights["also low"] - 0.5 >= 0.04 * (high - low)


@pytest.mark.parametrize(
    "table",
    [
        b"\xff\xfe",
        b"hello\nworld\n",
        b"steps,mean_return\n1\n",
        b"steps,mean_return\n1,2,3\n",
        b"steps,mean_return\n" + 200_000 * b"1" + b",2\n",
        b"steps,mean_return\n10,1\n0,5\n5,2\n",
        b"steps,mean_return\n1,1\n1,2\n",
        None,
    ],
)
def test_a_damaged_table_is_refused_by_its_name(made, table):
    run = made("a", [(0, 0.0)])
    path = Path(run) / "evaluations.csv"
    path.unlink()
    if table is None:
        path.mkdir()
    else:
        path.write_bytes(table)
    with pytest.raises(RunError, match=r"evaluations\.csv: must"):
        curves_of([run])


def test_a_run_is_no_two_seeds(made, tmp_path):
    run = made("a", [(0, 0.0), (10, 1.0)])
    (tmp_path / "link").symlink_to(run)
    for other in (run, str(tmp_path / "link")):
        with pytest.raises(OptionError, match="run: must be given once"):
            curves_of([run, other])
    with pytest.raises(OptionError, match="run: must be at least one"):
        curves_of([])
