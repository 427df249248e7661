"""The stress test from end to end: units, numbers, page, files, replay."""

import csv
import json
import re
import sys
from dataclasses import replace

import numpy as np
import pytest

from farm_ar.agents.stress import (
    StressOptions,
    read_failure,
    replay_failure,
    report,
    run_stress,
    summarise,
    write_study,
)
from farm_ar.agents.stress.failures import ReportError
from farm_ar.agents.stress.report import command_of, in_metres, number, page_of
from farm_ar.agents.stress.statistics import share_of
from farm_ar.agents.stress.study import known_case, surprise
from farm_ar.errors import InputError, OptionError
from farm_ar.reid import REIDENTIFIERS, LastKnownReid, SpatialOptions, SpatialReid
from farm_ar.scenes import builtin_scene
from farm_ar.sweeps import Store
from farm_ar.sweeps.unit import code_version, load_function

METHODS = ("spatial", "likelihood", "nearest")
FEW = StressOptions(reids=METHODS, attacks=("analytic", "halton"), queries=150, cases=3, noise_draws=20)
LABELS = builtin_scene("farm").layout.labels


@pytest.fixture(scope="module")
def study():
    return run_stress(FEW)


@pytest.fixture(scope="module")
def summary(study):
    return summarise(study, LABELS)


@pytest.fixture(scope="module")
def folder(study, summary, tmp_path_factory):
    out = tmp_path_factory.mktemp("stress")
    write_study(study, summary, out)
    return out


def test_every_method_has_every_attack_and_the_best_of_them(summary):
    assert [rule.reid for rule in summary.reids] == ["spatial", "likelihood", "nearest"]
    assert summary.notes() == []
    for rule in summary.reids:
        assert [one.attack for one in rule.attacks] == ["analytic", "halton", "best"]
        for case in range(3):
            distances = [one.least[case] for one in rule.attacks[:2] if one.least[case] is not None]
            assert rule.best.least[case] == min(distances, default=None)


def test_certificates_stand_where_a_theorem_does(summary, folder):
    spatial, likelihood, nearest = summary.reids
    written = {rule["reid"]: rule for rule in json.loads((folder / "stress.json").read_text())["rules"]}
    assert written["likelihood"]["bounds"] is None
    assert written["spatial"]["bounds"] == list(spatial.bounds)
    assert likelihood.theorem == "none"
    assert np.isnan(likelihood.bound_median)
    for rule in (spatial, nearest):
        assert rule.theorem != "none"
        assert 1 <= rule.best.tightness < 1.5
        assert rule.bound_t1 <= rule.bound_median


def test_a_failure_always_breaks_the_rule_that_it_was_made_for(summary):
    for rule in summary.reids:
        assert rule.transfer[rule.reid].value == 1.0


def test_the_worst_failure_of_a_case_has_most_wrong_labels_and_of_those_least_distance(study, summary):
    for rule in summary.reids:
        for case, worst in zip(rule.cases, rule.most_wrong, strict=True):
            found = [
                (-row["worst"]["wrong"], row["worst"]["effort"])
                for row in study.attacked
                if (row["reid"], row["case"]) == (rule.reid, case) and row["worst"] is not None
            ]
            wrong, distance = min(found)
            assert worst == (-wrong, distance)


def test_the_game_suffers_from_wrong_labels(summary):
    spatial = summary.reids[0]
    assert spatial.endpoint_error_m > 0.01
    assert spatial.miscounts > 0


def test_a_rule_that_says_how_sure_it_is_is_calibrated(summary):
    likelihood = summary.reids[1]
    assert likelihood.calibration.answers.sum() > 50
    assert 0 <= likelihood.calibration.error <= 1


def test_the_weakest_come_first(summary):
    rule = summary.reids[0]
    distances = [np.inf if weak.least is None else weak.least for weak in rule.weakest]
    assert distances == sorted(distances)
    assert [row[1] for row in rule.labels] == sorted((row[1] for row in rule.labels), reverse=True)
    assert sum(row[1] for row in rule.labels) >= 3


def test_the_page_needs_nothing_else(folder):
    page = (folder / "stress.html").read_text()
    outward = r"src=|href=[\"'](?!#)|url\((?!#)|@import|https?://(?!www\.w3\.org/(?:2000/svg|1999/xlink)\")"
    links = re.findall(outward, page)
    assert links == []
    assert page.count("<svg") > 10
    assert "farm-ar stress --scene farm --compare spatial,likelihood,nearest" in page
    assert "<script" not in page
    for reid in ("spatial", "likelihood", "nearest"):
        part = page.partition(f"{reid}: success against D")[2].partition("</section>")[0]
        assert "<td" in part


def test_a_page_of_one_rule_compares_nothing(study):
    alone = replace(study, options=replace(FEW, reids=("spatial",), attacks=("analytic",)))
    page = page_of(alone, summarise(alone, LABELS))
    assert "Transfer" not in page
    assert "--reid spatial --attack analytic " in command_of(alone)


def test_the_table_has_a_row_per_attack_and_agrees_with_the_study(folder, study):
    with (folder / "stress.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * 3 * 2
    for row, found in zip(rows, study.attacked, strict=True):
        assert (row["least"] == "") == (found["least"] is None)
        if found["least"] is not None:
            assert float(row["least"]) == found["least"]
            assert float(row["wrong"]) > 0
        assert (row["bound"] == "") == (row["reid"] == "likelihood")
        if row["ratio"]:
            assert float(row["ratio"]) >= 1


def test_every_failure_of_the_file_replays_to_the_last_bit(folder):
    failures = json.loads((folder / "stress.json").read_text())["failures"]
    assert {failure["kind"] for failure in failures} == {"cheapest", "worst", "likeliest"}
    for failure in failures[::4]:
        again = replay_failure(read_failure(folder / "stress.json", failure["id"]))
        assert again.same
        assert again.wrong == failure["wrong"] > 0
        pairs = zip(again.truth, again.answer.labels, strict=True)
        misread = [[true, given] for true, given in pairs if true != given]
        assert misread == failure["misread"]


def test_a_failure_that_was_tampered_with_is_not_the_same(folder):
    failure = dict(read_failure(folder / "stress.json", 0))
    assert not replay_failure(failure | {"effort": failure["effort"] + 1e-9}).same


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("[]", "must be a JSON object"),
        ('{"failures": {}}', "must be a list"),
        ('{"failures": []}', "must hold number 0"),
        ('{"failures": [{}]}', "scene: must be a non-empty string"),
        ('{"failures": [7]}', "must be a JSON object"),
        ("", "must"),
    ],
)
def test_a_file_that_is_none_is_refused(tmp_path, content, message):
    path = tmp_path / "stress.json"
    path.write_text(content)
    with pytest.raises(ReportError, match=message):
        read_failure(path, 0)


@pytest.mark.parametrize(
    "damage",
    [
        {"scene": None}, {"scene": 3}, {"scene": "moon"}, {"reid": ["spatial"]}, {"reid": "best"},
        {"jitter": "wild"}, {"jitter": {}}, {"case": -1}, {"case": 1.5}, {"case": True}, {"case": 10**30},
        {"seed": "0"}, {"seed": -1}, {"wrong": None}, {"effort": "much"}, {"effort": None},
        {"position": 3}, {"position": [[0.1, 0.2]]}, {"position": [[0.1]]}, {"position": [[0.1, "x"]]},
        {"yaw": 1}, {"yaw": [0.0]}, {"yaw": ["x"] * 11}, {"yaw": [[0.0]] * 11},
        {"position": [[1e300, 0.0]] * 11}, {"yaw": [1e300] * 11},
    ],
)  # fmt: skip
def test_a_damaged_failure_is_named_in_one_line(folder, tmp_path, damage):
    content = json.loads((folder / "stress.json").read_text())
    content["failures"][0] |= damage
    path = tmp_path / "stress.json"
    path.write_text(json.dumps(content))
    named = "yaw" if damage == {"position": [[0.1, 0.2]]} else next(iter(damage))
    with pytest.raises(InputError, match=named) as problem:
        replay_failure(read_failure(path, 0))
    assert "\n" not in str(problem.value)


def test_what_is_finished_is_not_run_again(tmp_path):
    options = StressOptions(attacks=("halton",), queries=60, cases=2, noise_draws=5)
    path = tmp_path / "store.sqlite"
    first = run_stress(options, path)
    told = []
    with Store(path) as store:
        again = run_stress(options, store, watch=told.append)
    assert all(standing.done == 0 for standing in told)
    assert again.attacked == first.attacked


def test_a_scene_without_the_game_has_no_miscounts():
    options = StressOptions("lab", attacks=("analytic",), queries=80, cases=2, jitter="none", noise_draws=5)
    found = summarise(run_stress(options), builtin_scene("lab").layout.labels)
    assert found.reids[0].miscounts is None
    assert found.reids[0].endpoint_error_m > 0


def test_nothing_within_a_small_budget_is_nothing_to_look_at():
    options = StressOptions(attacks=("halton",), queries=20, cases=2, budget=0.001, noise_draws=5)
    study = run_stress(options)
    found = summarise(study, LABELS)
    assert found.reids[0].best.median == np.inf
    assert "Nothing failed" in page_of(study, found)


class WrongInSome:
    """Reads two labels the wrong way round wherever the camera stands on the left, whatever has moved."""

    def __init__(self, scene):
        self._rule = SpatialReid(scene, SpatialOptions(gate_categories=True))

    def identify(self, snapshot):
        answer = self._rule.identify(snapshot)
        if snapshot.camera.position[0] > 0.6 or len(answer.labels) < 2:
            return answer
        first, second, *others = answer.labels
        return replace(answer, labels=(second, first, *others))


def test_cases_that_are_wrong_before_anything_moves_are_left_out_and_counted(monkeypatch):
    monkeypatch.setitem(REIDENTIFIERS, "wrong", WrongInSome)
    options = StressOptions(
        reids=("wrong", "spatial"), attacks=("analytic",), queries=40, cases=6, noise_draws=5, jitter="none"
    )
    study = run_stress(options)
    out, right = summarise(study, LABELS).reids
    cameras = [row["camera"][0] for row in study.known if row["reid"] == "wrong"]
    kept = tuple(case for case, x in enumerate(cameras) if x > 0.6)
    assert 0 < len(kept) < 6
    assert out.cases == kept
    assert out.wrong_before == 6 - len(kept)
    assert len(out.best.least) == len(kept)
    assert out.best.failed.value < 1 or out.best.median > 0
    assert right.wrong_before == 0
    # Shown to the other one, only failures of cases count in which it was right before.
    found = [row for row in study.attacked if row["reid"] == "spatial" and row["least"] is not None]
    shown = [row["transfer"]["wrong"] > 0 for row in found if row["case"] in kept]
    assert 0 < len(shown) < len(found)
    assert right.transfer["wrong"] == share_of(sum(shown), len(shown))
    drawn = []
    monkeypatch.setattr(report, "cell_chart", lambda cells, *rest: drawn.append(np.sum(cells)) or "")
    page = page_of(study, summarise(study, LABELS))
    assert f"wrong: {6 - len(kept)} of 6 cases are left out" in page
    counted = [np.sum(r["cells"]) for r in study.attacked if r["reid"] == "wrong" and r["case"] in kept]
    assert drawn[0] == sum(counted)


def test_a_method_that_is_wrong_everywhere_has_no_numbers_but_a_page(monkeypatch):
    monkeypatch.setitem(REIDENTIFIERS, "nothing", lambda scene: LastKnownReid(scene, tolerance_m=1e-9))
    options = StressOptions(reids=("nothing",), attacks=("halton",), queries=10, cases=2, noise_draws=2)
    study = run_stress(options)
    known = [row | {"wrong_untouched": 1} for row in study.known]
    study = replace(study, known=known)
    found = summarise(study, LABELS)
    assert found.reids[0].wrong_before == 2
    assert np.isnan(found.reids[0].best.median)
    assert "2 of 2 cases are left out" in page_of(study, found)


def test_the_share_of_noise_is_an_interval_over_cases(study, summary):
    known = [row for row in study.known if row["reid"] == "spatial"]
    share = summary.reids[0].noise
    failures = [row["noise_failures"] for row in known]
    assert share.value == pytest.approx(sum(failures) / sum(row["noise_draws"] for row in known))
    each = [k / 20 for k in failures]
    assert min(each) <= share.low <= share.value <= share.high
    if 0 < sum(failures) < 60:
        assert share.high <= max(each)


def test_the_page_escapes_names(study, summary):
    options = replace(FEW)
    object.__setattr__(options, "scene", "farm")
    named = replace(study, options=options)
    labels = tuple(f"<script>{label}" for label in LABELS)
    page = page_of(named, summarise(named, labels))
    assert "<script" not in page
    assert "&lt;script&gt;" in page


OWN_RULE = """
from farm_ar.reid import NearestReid, LastKnownReid

class MyReid({parent}):
    pass
"""


def test_a_class_in_the_working_folder_is_found_and_its_changes_are_noticed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry not in ("", str(tmp_path))])
    options = {"reids": ("own_rule_here:MyReid",), "attacks": ("halton",), "queries": 10, "cases": 1}
    bounds = []
    for parent in ("NearestReid", "LastKnownReid"):
        (tmp_path / "own_rule_here.py").write_text(OWN_RULE.format(parent=parent))
        for cached in (load_function, code_version):
            cached.cache_clear()
        sys.modules.pop("own_rule_here", None)
        study = run_stress(StressOptions(**options, noise_draws=1), tmp_path / "store.sqlite")
        bounds.append(study.known[0]["bound"])
    assert bounds[0] > 2 * bounds[1]


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"scene": "moon"}, "scene"), ({"reids": ()}, "reid"), ({"attacks": ("random", "random")}, "attack"),
        ({"attacks": ("luck",)}, "attack"), ({"jitter": "wild"}, "jitter"), ({"queries": 0}, "queries"),
        ({"cases": True}, "cases"), ({"budget": 0.0}, "budget"), ({"seed": -1}, "seed"),
    ],
)  # fmt: skip
def test_options_out_of_their_limits_are_refused(wrong, field):
    with pytest.raises(OptionError, match=f"^{field}"):
        StressOptions(**wrong)


def test_surprise_is_half_the_squared_scores():
    case = known_case("farm", 0, "none", 0)
    position, yaw = case.layout.position.copy(), case.layout.yaw.copy()
    position[0] += [0.05, 0.0]  # one SD of everyday disorder
    yaw[1] += np.deg2rad(30.0)  # two
    assert surprise(case, position, yaw) == pytest.approx((1 + 4) / 2)


def test_numbers_as_the_page_writes_them():
    farm = builtin_scene("farm")
    assert [number(v) for v in (0.12345, np.inf, None, np.nan)] == ["0.123", "> budget", "> budget", "–"]
    assert in_metres(0.1, farm) == "14.4 cm"
    assert in_metres(1.0, farm) == "1.44 m"
    assert in_metres(np.inf, farm) == "–"
