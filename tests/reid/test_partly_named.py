"""A scene that says of some objects only what they look like: the others may be anything."""

import json
import pickle

import numpy as np
import pytest

from farm_ar.errors import SceneError
from farm_ar.reid import REIDENTIFIERS, AdaptiveReid, Session, explain, identify
from farm_ar.scenes import (
    Camera,
    Detections,
    FieldOfView,
    Snapshot,
    from_poses,
    load_scene_csv,
    scene_from_dict,
    scene_to_dict,
)

PLACE = np.array([[0.0, 0, 0], [2, 0, 0], [4, 0, 0], [0, 0, 2], [2, 0, 2]])
CATEGORY = ("chair", "chair", None, "table", None)


def scene():
    return from_poses("abcde", PLACE, yaw=np.zeros(5), size=(0.5, 0.8, 0.5), category=CATEGORY)


def seen(category, index, shift=0.05):
    n = len(index)
    place = PLACE[index][:, [0, 2]] + shift
    camera = Camera(np.array([2.0, -3.0]), 0.0, FieldOfView(np.pi, np.pi, 30.0))
    return Snapshot(camera, Detections(category, place, np.full(n, 0.02), np.full((n, 3), 0.5)))


def test_what_has_no_category_may_be_anything_and_what_has_one_nothing_else():
    answer = identify(scene(), seen(("chair", "lamp", "sofa", "table", None), [0, 2, 4, 3, 1]))
    assert answer.labels == ("a", "c", "e", "d", "b")
    assert answer.warnings == ()
    # A lamp at the place of a chair is not the chair.
    row = identify(scene(), seen(("lamp",), [0])).probability[0]
    assert row[[0, 1, 3]] == pytest.approx(0.0, abs=1e-12)
    assert row.sum() == pytest.approx(1.0)
    table = identify(scene(), seen(("table",), [1])).probability[0]
    assert table[[0, 1]] == pytest.approx(0.0, abs=1e-12)


def test_it_goes_through_files_and_tables_and_comes_back(tmp_path):
    data = scene_to_dict(scene())
    assert ["category" in one for one in data["objects"]] == [True, True, False, True, False]
    again = scene_from_dict(json.loads(json.dumps(data)))
    assert again.layout.category == scene().layout.category
    assert again.layout.partly_named
    assert not again.unnamed().layout.partly_named
    (tmp_path / "map.csv").write_text("id,category,x,z\na,chair,0,0\nb,,1,0\n")
    assert load_scene_csv(tmp_path / "map.csv").layout.partly_named


@pytest.mark.parametrize("name", sorted(set(REIDENTIFIERS) - {"adaptive", "spatial-unity"}))
def test_the_other_methods_say_that_they_need_all_or_none(name):
    # spatial-unity, as its program is, does not ask which category a detection has.
    with pytest.raises(
        SceneError,
        match=r"objects\[2\].category: must be given, as other objects have one: only .*, got nothing",
    ):
        REIDENTIFIERS[name](scene()).identify(seen(("chair",), [0]))
    assert REIDENTIFIERS[name](scene().unnamed()).identify(seen((None,), [0])) is not None


def test_it_can_be_explained_pickled_and_learnt_from():
    reid = REIDENTIFIERS["adaptive"](scene())
    assert isinstance(reid, AdaptiveReid)
    snapshot = seen(("chair", "lamp"), [0, 2])
    copy = pickle.loads(pickle.dumps(reid))
    assert copy.identify(snapshot).labels == reid.identify(snapshot).labels == ("a", "c")
    assert explain(reid, snapshot, 1).words().startswith("1 is c, moved 0.07 m")
    session = Session(scene())
    assert session.identify(snapshot).labels == ("a", "c")
    session.confirm()
    assert session.state.learnt.snapshots == 1
    session.commit()
    assert session.scene.layout.category == scene().layout.category
