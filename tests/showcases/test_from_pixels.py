"""The paper's two demonstrations, played wholly from pixels."""

import pytest

from farm_ar.showcases import load_script
from farm_ar.showcases.film import ScriptRecorder
from farm_ar.vision.perception import PixelPerception


@pytest.mark.parametrize("name", ["demonstration-1", "demonstration-2"])
def test_a_demonstration_gives_every_building_its_own_label(name):
    film = ScriptRecorder(load_script(name), make_pictures=None, make_perception=PixelPerception).play()
    exact = ScriptRecorder(load_script(name), make_pictures=None).play()
    given = [row for row in film.detections if row["truth"] is not None]
    assert len(given) >= 0.6 * len(exact.detections)
    wrong = [(row["given"], row["truth"]) for row in film.detections if row["given"] != row["truth"]]
    assert wrong == []
