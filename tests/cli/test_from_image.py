"""`farm-ar identify --image`: from an image, its camera and meshes to labels."""

import json

import cv2
import numpy as np
import pytest

from farm_ar.drawing.photos import draw_on_image
from farm_ar.rendering import HOLOLENS_2, Instance, Renderer, View, model
from farm_ar.rendering.modelling import write
from farm_ar.scenes import save_scene
from farm_ar.scenes.builtin import builtin_scene

FARM = builtin_scene("farm")
EYE = {"x": 0.6, "y": 0.45, "z": -0.32, "yaw_deg": 0.0, "pitch_deg": -28.0}
VIEW = View(HOLOLENS_2, np.array([0.6, 0.45, -0.32]), 0.0, np.deg2rad(-28.0))

ESTIMATOR = """
import numpy as np
from farm_ar.scenes import Detections
from farm_ar.scenes.builtin import builtin_scene
from farm_ar.vision import PoseEstimates, PoseEstimator, check_question

class Knows(PoseEstimator):
    def estimate(self, image, camera, meshes):
        check_question(image, camera, meshes)
        layout = builtin_scene("farm").layout
        near = np.argsort(layout.position[:, 1])[:6]
        names = tuple(layout.category[i] for i in near)
        seen = Detections(names, layout.position[near] + 0.004, layout.yaw[near], layout.size[near])
        nan = np.full(6, np.nan)
        return PoseEstimates(seen, np.tile(1e-4 * np.eye(3), (6, 1, 1)), np.ones(6), nan, nan)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "knowing.py").write_text(ESTIMATOR)
    layout = FARM.layout
    standing = []
    for i in range(len(layout)):
        mesh = model(layout.category[i]).fitted(*layout.size[i])
        standing.append(Instance(mesh, np.insert(layout.position[i], 1, 0.0), layout.yaw[i]))
    cv2.imwrite("snap.png", Renderer(standing).draw(VIEW).rgb[..., ::-1])
    lens = {name: getattr(HOLOLENS_2, name) for name in ("fx", "fy", "cx", "cy", "width", "height")}
    (tmp_path / "cam.json").write_text(json.dumps({"camera": EYE, "intrinsics": lens}))
    save_scene(FARM, tmp_path / "before.json")
    (tmp_path / "meshes").mkdir()
    for name in ("coop", "hutch", "shed"):
        write(model(name), tmp_path / "meshes" / f"{name}.glb")
    return tmp_path


ASKED = ("identify", "--image", "snap.png", "--camera", "cam.json", "--scene", "before.json")
ASKED += ("--meshes", "meshes", "--estimator", "knowing:Knows")


def test_labels_come_from_an_image_and_are_drawn_on_it(run, folder):
    answer = json.loads(run(*ASKED, "--plot", "out.png", "--json").stdout)
    near = np.argsort(FARM.layout.position[:, 1])[:6]
    assert answer["labels"] == [FARM.layout.labels[i] for i in near]
    drawn, before = cv2.imread("out.png"), cv2.imread("snap.png")
    assert drawn.shape == before.shape
    assert 500 < (drawn != before).any(axis=-1).sum() < 0.3 * before[..., 0].size


def test_what_is_wrong_with_the_image_its_camera_or_the_meshes_is_said_in_a_line(mistake, folder):
    def without(option):
        at = ASKED.index(option)
        return ASKED[:at] + ASKED[at + 2 :]

    assert "--snapshot: must be given, or --image instead" in mistake(*without("--image"))
    assert "--camera: must be given with --image" in mistake(*without("--camera"))
    assert "--meshes: must be given with --image" in mistake(*without("--meshes"))
    assert "--meshes: must not be given without --image" in mistake(
        "identify", "--scene", "farm", "--snapshot", "before.json", "--meshes", "meshes"
    )
    assert "must end in .png or .jpg" in mistake(*ASKED, "--plot", "out.svg")
    cv2.imwrite("snap.png", np.zeros((20, 30, 3), np.uint8))
    assert "image: must be 640 x 360 pixels as the camera's intrinsics say, got '30 x 20'" in mistake(*ASKED)
    (folder / "snap.png").write_bytes(b"no image")
    assert "snap.png: image: must be a PNG or JPEG" in mistake(*ASKED)
    (folder / "meshes" / "hutch.glb").unlink()
    assert "category 'hutch'" in mistake(*ASKED) or "PNG" in mistake(*ASKED)


def test_an_outline_follows_the_thing_and_its_text_stands_above():
    image = np.full((360, 640, 3), 90, np.uint8)
    thing = (model("coop"), np.array([0.6, 0.3]), 0.4)
    drawn = draw_on_image(image, VIEW, [thing], ["yellow-coop 93%"], [(250, 208, 28)])
    assert (image == 90).all()
    changed = (drawn != image).any(axis=-1)
    ids = Renderer([Instance(thing[0], np.array([0.6, 0.0, 0.3]), 0.4, 1)]).ids(VIEW)[1] == 1
    inside = np.asarray(cv2.erode(ids.astype(np.uint8), np.ones((9, 9), np.uint8)), bool)
    around = np.asarray(cv2.dilate(ids.astype(np.uint8), np.ones((3, 3), np.uint8)), bool) & ~np.asarray(
        cv2.erode(ids.astype(np.uint8), np.ones((3, 3), np.uint8)), bool
    )
    assert not changed[inside].any()
    assert changed[around].mean() > 0.9
    top = np.flatnonzero(ids.any(axis=1))[0]
    assert changed[: top - 4].any()
    behind = draw_on_image(image, VIEW, [(model("coop"), np.array([0.6, -2.0]), 0.0)], ["x"], [(1, 2, 3)])
    assert (behind == image).all()
