"""All experiments from end to end, in their smallest form."""

import io
import json
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from rich.console import Console

from farm_ar.errors import OptionError, SceneError, UnfinishedError
from farm_ar.experiments import EXPERIMENTS, pruning, reproduce, setting_of
from farm_ar.experiments.published import TABLE_1
from farm_ar.experiments.reproduce import BEYOND_THE_PAPER
from farm_ar.experiments.setting import Setting
from farm_ar.reid import SpatialReid
from farm_ar.scenes import save_scene

NAMES = ["table1", "table2", "table3", "table4", "table5", "fig5", "fig7", "fig9", "fig13", "fig14"]
SVG = "{http://www.w3.org/2000/svg}"


def run(out: Path, what: str = "all", **options) -> str:
    """Run experiments in their smallest form; what they print."""
    screen = io.StringIO()
    console = Console(file=screen, width=160, markup=False)
    workers, chosen = options.pop("workers", 1), {"layouts": 1, "quick": True, **options}
    reproduce(what, setting_of(what, **chosen), out, workers, console)
    return screen.getvalue()


@pytest.fixture(scope="module")
def few_times():
    """Take the time of two snapshots only."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pruning, "TIMED_SNAPSHOTS", 2)
        yield


@pytest.fixture(scope="module")
def printed_and_out(few_times, tmp_path_factory):
    out = tmp_path_factory.mktemp("reproduced")
    return run(out, workers=2), out


@pytest.fixture(scope="module")
def out(printed_and_out) -> Path:
    return printed_and_out[1]


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_the_experiments_are_those_of_the_paper():
    assert [name for name in EXPERIMENTS if name not in BEYOND_THE_PAPER] == NAMES


def test_every_experiment_leaves_its_files_and_nothing_else(out):
    expected = {f"{name}.{suffix}" for name in NAMES for suffix in ("csv", "json", "svg")}
    timed = {f"{name}_times.{suffix}" for name in ("fig9", "table5") for suffix in ("csv", "json")}
    others = timed | {"summary.md", "sweeps.sqlite"}
    assert set(contents(out)) == expected | others


@pytest.mark.parametrize("name", NAMES)
def test_every_picture_shows_something(out, name):
    root = ET.parse(out / f"{name}.svg").getroot()
    assert root.tag == f"{SVG}svg"
    marks = [*root.iter(f"{SVG}path"), *root.iter(f"{SVG}use")]
    assert len(marks) > 60


def test_the_summary_has_the_papers_number_beside_every_one_of_ours(out):
    summary = (out / "summary.md").read_text()
    assert "On the built-in scenes, seed 0, 1 noisy layouts per noise level, the quick form." in summary
    for line in (
        "| H2: sites, types, objects, area in m² | 14, 11, 48, 225 | 14, 11, 48, 225 |",
        "| classroom: sites, chairs, area in m² | 7, 29, 130 | 7, 29, 130 |",
        "| pantry: SD over the frames of a layout, % | 22.26 | ",
        "| classroom: most frequent accuracy of a frame | 100% | ",
        "| accuracy, without translation: mean / SD over snapshots | 0.17 / 0.27 | 0.",
        "| rank 9 | S8 0.065 | S",
        "| offices, rotation SD 50°, low translation noise, local boxes | 0.7739 | 0.",
        "| offices, translation SD 0.5 m, all rotation noise, world boxes | 0.7723 | 0.",
        "| accuracy, without rotation | 0.43 | ",
        "| accuracy at threshold 0.50 | 0.91 | 0.",
        "| time at threshold 0.75, of that without pruning | about 0.8 | ",
    ):
        assert line in summary
    assert re.findall(r"\[(\w+)\.svg\]", summary) == NAMES


def test_the_terminal_shows_the_summary_and_where_the_files_are(printed_and_out):
    printed, out = printed_and_out
    for number in ("0.91 / 0.19", "S6 0.214", "0.7739", "about 0.5"):
        assert number in printed
    assert "The paper's camera walked once through one noisy layout" in printed
    assert re.search(rf"Done in \d+ s\. Pictures, tables and summary\.md:\s+{re.escape(str(out))}/", printed)


def test_the_same_seed_gives_the_same_bytes_with_any_number_of_workers(out, few_times, tmp_path):
    run(tmp_path, workers=1)
    first, second = contents(out), contents(tmp_path)
    assert set(first) == set(second)
    of_the_clock = {"fig9.svg", "sweeps.sqlite"} | {name for name in first if "_times." in name}
    times = re.compile(rb"^\| time (at|to|of) .*\n", re.MULTILINE)
    for name in set(first) - of_the_clock:
        assert times.sub(b"", first[name]) == times.sub(b"", second[name]), name
    assert len(times.findall(first["summary.md"])) == 2 + 3


@pytest.mark.parametrize("what", ["table2", "table5", "fig5", "fig7", "fig9", "fig13", "fig14"])
def test_another_seed_gives_other_results(out, few_times, own_scenes, what):
    report = EXPERIMENTS[what](Setting(layouts=1, seed=1, quick=True))
    assert list(report.rows) != json.loads((out / f"{what}.json").read_text())


@pytest.mark.parametrize("what", ["table1", "table3", "table4"])
def test_the_seed_does_not_matter_where_nothing_is_random(out, own_scenes, what):
    report = EXPERIMENTS[what](Setting(layouts=1, seed=1, quick=True))
    assert list(report.rows) == json.loads((out / f"{what}.json").read_text())


def test_quick_noise_levels_are_evenly_spaced_so_that_means_over_them_can_be_compared(out):
    rows = json.loads((out / "fig5.json").read_text())
    for scene in TABLE_1:
        here = [row for row in rows if row["scene"] == scene]
        assert sorted({row["rotation_sd_deg"] for row in here}) == list(range(0, 121, 10))
        assert {row["translation_sd_m"] for row in here} >= {0.1, 0.5, 1.0, 2.0, 5.0}


def test_one_experiment_can_be_run_alone(tmp_path):
    run(tmp_path, "table2")
    files = {"table2.csv", "table2.json", "table2.svg", "summary.md", "sweeps.sqlite"}
    assert set(contents(tmp_path)) == files


@pytest.mark.parametrize(("quick", "layouts"), [(True, 5), (False, 20)])
def test_without_a_number_of_layouts_there_are_20_or_5_if_quick(tmp_path, quick, layouts):
    run(tmp_path, "table2", quick=quick, layouts=None)
    assert f"R(0, 30), {layouts} layouts" in (tmp_path / "summary.md").read_text()


def test_scenes_of_a_folder_take_the_place_of_ours(own_scenes, out, tmp_path):
    for name in own_scenes:
        save_scene(own_scenes["M1" if name == "H1" else name], tmp_path / "mine" / f"{name}.json")
    run(tmp_path, "table3", scenes=tmp_path / "mine")
    summary = (tmp_path / "summary.md").read_text()
    assert "On the scenes of `mine`, seed 0" in summary
    ranks = re.findall(r"\| rank \d \| S\d+ 0\.\d+ \| (S\d)", summary)
    assert len(ranks) == len(set(ranks)) == 4, "M1 has five sites, and the camera is in one of them"


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        (
            {"what": "table9"},
            OptionError,
            f"what: must be one of {', '.join(sorted(EXPERIMENTS))}",
        ),
        ({"layouts": 0}, OptionError, "layouts: must be a whole number not below 1, got 0"),
        ({"workers": 0}, OptionError, "workers: must be a whole number not below 1, got 0"),
        ({"seed": -1}, OptionError, "seed: must be a whole number not below 0, got -1"),
        ({"scenes": Path("nowhere")}, SceneError, "scenes: must be a folder with L1.json to H2.json"),
    ],
)
def test_mistakes_are_refused_before_anything_is_written(tmp_path, options, error, message):
    with pytest.raises(error) as problem:
        run(tmp_path / "out", **options)
    assert str(problem.value).startswith(message)
    assert not (tmp_path / "out").exists()


def test_an_error_in_one_experiment_is_told_at_the_end_and_the_others_are_done(out, tmp_path, monkeypatch):
    def fail(self, batch):
        raise FloatingPointError("in a worker")

    monkeypatch.setattr(SpatialReid, "identify_many", fail)
    three = {name: EXPERIMENTS[name] for name in ("table2", "table3", "fig9")}
    monkeypatch.setattr(sys.modules[reproduce.__module__], "EXPERIMENTS", three)
    with pytest.raises(UnfinishedError) as problem:
        run(tmp_path)
    lines = str(problem.value).splitlines()
    assert "table2: 4 of its units gave no result; all others are kept" in lines
    assert "fig9: 21 of its units gave no result; all others are kept" in lines
    assert "FloatingPointError: in a worker" in lines
    left = contents(tmp_path)
    assert left.pop("sweeps.sqlite")
    assert re.findall(r"\[(\w+)\.svg\]", left.pop("summary.md").decode()) == ["table3"]
    assert left == {name: (out / name).read_bytes() for name in left}
    assert set(left) == {"table3.csv", "table3.json", "table3.svg"}


def test_what_was_finished_before_an_interruption_is_not_computed_again(out, tmp_path, monkeypatch):
    calls = []
    identify_many = SpatialReid.identify_many

    def interrupted(self, batch):
        calls.append(len(batch))
        if len(calls) == 3:
            raise KeyboardInterrupt
        return identify_many(self, batch)

    monkeypatch.setattr(SpatialReid, "identify_many", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, "table2")
    assert set(contents(tmp_path)) == {"sweeps.sqlite"}
    run(tmp_path, "table2")
    assert len(calls) == 3 + 2, "two of four conditions were finished"
    for name in ("table2.csv", "table2.json", "table2.svg"):
        assert contents(tmp_path)[name] == contents(out)[name]
    run(tmp_path, "table2")
    assert len(calls) == 5
    run(tmp_path, "table2", fresh=True)
    assert len(calls) == 9


def test_other_scenes_are_not_taken_for_those_that_are_finished(own_scenes, tmp_path):
    rows = []
    for h1 in ("H1", "M1"):
        for name in own_scenes:
            save_scene(own_scenes[h1 if name == "H1" else name], tmp_path / "mine" / f"{name}.json")
        run(tmp_path, "table2", scenes=tmp_path / "mine")
        rows.append((tmp_path / "table2.json").read_text())
    assert rows[0] != rows[1]
