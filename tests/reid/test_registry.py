from __future__ import annotations

import sys

import numpy as np
import pytest

from farm_ar.errors import OptionError
from farm_ar.reid import REIDENTIFIERS, DistanceReid, NearestReid, SpatialReid, load_reid, reid_factory
from farm_ar.scenes import PERFECT, Camera, FieldOfView, builtin_scene, observe

OWN = """
from farm_ar.reid import NearestReid

class Mine(NearestReid):
    pass

class Nothing:
    def __init__(self, scene):
        pass
"""

BROKEN = """
from farm_ar.reid import Identification

class Mine:
    def __init__(self, scene):
        pass

    def identify(self, snapshot):
        return ANSWER

class WithoutScene:
    def identify(self, snapshot):
        pass
"""


def test_the_names_keep_categories_apart_but_for_the_synthetic_experiments_rule() -> None:
    scene = builtin_scene("farm")
    gated = {}
    for name in ("spatial", "spatial-ungated", "distance"):
        made = load_reid(name)(scene)
        assert isinstance(made, SpatialReid)
        gated[name] = made.options.gate_categories
    assert gated == {"spatial": True, "spatial-ungated": False, "distance": True}
    assert isinstance(load_reid("distance")(scene), DistanceReid)
    assert NearestReid(scene).gate_categories


def test_a_class_of_ones_own_is_found_by_name_in_the_working_folder(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry not in ("", str(tmp_path))])
    (tmp_path / "own_registry_rule.py").write_text(OWN)
    made = load_reid("own_registry_rule:Mine")(builtin_scene("farm"))
    assert isinstance(made, NearestReid)
    assert type(made).__name__ == "Mine"
    with pytest.raises(
        OptionError, match=r"^--reid: must be called with a scene and give something with ident"
    ):
        load_reid("own_registry_rule:Nothing", "--reid")(builtin_scene("farm"))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "best",
            f"^reid: must be one of {', '.join(sorted(REIDENTIFIERS))}, or module:Class of your own, got",
        ),
        ("farm_ar.scenes:Scene.name", "^reid: must name a class at the top of farm_ar.scenes"),
        ("farm_ar.reid.spatial:Nobody", "at the top of farm_ar.reid.spatial, one of .*SpatialReid"),
        ("farm_ar.no_such_module:Nobody", "there is no farm_ar.no_such_module, got"),
        ("farm_ar.reid:__all__", "must name a class at the top of farm_ar.reid, which defines none, got"),
        (":Nobody", "or module:Class of your own"),
    ],
)
def test_names_of_nothing_are_refused(name, message) -> None:
    with pytest.raises(OptionError, match=message):
        load_reid(name)


def test_an_environment_takes_a_name_or_a_function_but_no_module() -> None:
    assert reid_factory("spatial") is REIDENTIFIERS["spatial"]
    assert reid_factory(NearestReid) is NearestReid
    with pytest.raises(OptionError, match=r"^reid: must be one of adaptive, .*, last-known, .*, got 'a:B'"):
        reid_factory("a:B")
    with pytest.raises(OptionError, match="or a function from a Scene to a Reidentifier, got 7"):
        reid_factory(7)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ("[None] * 11", "must return an Identification"),
        ("Identification((None,), [0.0])", "must return a label, or None, for each of 11 detections"),
        ("Identification(('x',) * 11, [0.0] * 11)", "must return labels of the scene, got 'x'"),
    ],
)
def test_answers_of_ones_own_class_that_are_none_are_refused(tmp_path, monkeypatch, answer, message) -> None:
    (tmp_path / "own_broken.py").write_text(BROKEN.replace("ANSWER", answer))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    monkeypatch.delitem(sys.modules, "own_broken", raising=False)
    scene = builtin_scene("farm")
    camera = Camera((0.6, -0.3), 0.0, FieldOfView(np.pi / 2, np.pi / 2, 3.0))
    made = load_reid("own_broken:Mine")(scene)
    with pytest.raises(OptionError, match=message):
        made.identify(observe(scene.layout, camera, PERFECT)[0])
    with pytest.raises(OptionError, match="must take a scene"):
        load_reid("own_broken:WithoutScene")(scene)
