"""Which failures are shown."""

from types import SimpleNamespace

from farm_ar.agents.stress.failures import GALLERY, gallery


def row(case, distance, misread, wrong=None, surprise=1.0):
    failure = {"effort": distance, "wrong": wrong or len(misread), "misread": misread, "surprise": surprise}
    return {"reid": "spatial", "case": case, "attack": "a", "cheapest": failure, "worst": failure}


def shown_of(rows, known=()):
    study = SimpleNamespace(options=SimpleNamespace(reids=("spatial",)), attacked=rows, known=known)
    kinds = {}
    for one in gallery(study):
        kinds.setdefault(one.kind, []).append(one)
    return kinds


def test_the_extreme_of_each_kind_comes_first():
    rows = [row(c, 0.1 * (c + 1), [["a", "b"]], wrong=c + 1, surprise=20 - c) for c in range(20)]
    shown = shown_of(rows)
    assert shown["cheapest"][0].row["case"] == 0
    assert shown["worst"][0].row["case"] == 19
    assert shown["likeliest"][0].row["case"] == 19
    assert all(len(each) == GALLERY for each in shown.values())


def test_cases_are_not_shown_again_while_there_are_others():
    rows = [row(c, 0.1 + 0.01 * c, [["a", "b"]], surprise=c) for c in range(40)]
    shown = shown_of(rows)
    cases = [one.row["case"] for each in shown.values() for one in each]
    # The extremes are the same case here.
    assert len(set(cases)) == len(cases) - 2


def test_other_ways_of_being_misread_come_before_more_of_the_same():
    same, swap, none = [["a", "b"]], [["a", "b"], ["b", "a"]], [["a", None]]
    rows = [row(c, 0.1 + 0.01 * c, same) for c in range(8)] + [row(8, 0.19, swap), row(9, 0.2, none)]
    rows += [row(c, 1.0 + c, same) for c in range(10, 20)]
    ways = [len(one.failure["misread"]) for one in shown_of(rows)["cheapest"]]
    assert 2 in ways
    assert any(one.failure["misread"] == none for one in shown_of(rows)["cheapest"])


def test_there_may_be_fewer_cases_than_places():
    shown = shown_of([row(0, 0.1, [["a", "b"]])])
    assert [len(each) for each in shown.values()] == [1, 1, 1]


def test_what_is_wrong_before_anything_moves_is_no_failure():
    known = [{"reid": "spatial", "case": c, "wrong_untouched": int(c == 0)} for c in range(3)]
    shown = shown_of([row(c, 0.1 * c, [["a", "b"]]) for c in range(3)], known)
    assert {one.row["case"] for each in shown.values() for one in each} == {1, 2}
