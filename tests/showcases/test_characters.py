"""Gates and stairs from pixels."""

import numpy as np

from farm_ar.game_logic.events import Parts
from farm_ar.showcases import ScriptRecorder, load_script
from farm_ar.showcases.characters import look
from farm_ar.showcases.parts_from_pixels import PixelParts, Verdict


def test_pictures_say_how_gate_and_stairs_stand():
    rows = [row for view in range(4) for row in look(0, view, exact=True)]
    gates = [row for row in rows if row["part"] == "gate"]
    assert all(row["right"] for row in gates)
    assert not any(row["wrong"] for row in rows)
    assert sum(row["right"] for row in rows) > len(rows) / 3


def test_what_is_not_to_be_seen_stays_as_it_was_known():
    assert not Verdict(100.0, 3).decided
    assert not Verdict(1.0, 500).decided
    assert Verdict(-20.0, 500).decided
    rows = look(0, 1, exact=True)
    assert all(row["undecided"] for row in rows if row["pixels"] == 0)


def test_the_script_plays_alike_from_pixels():
    script = load_script("characters")
    pixels = PixelParts(script.scene, np.random.default_rng(0))
    events = [ScriptRecorder(script, make_pictures=None, parts=p).play().events for p in (None, pixels)]
    assert events[0] == events[1]
    assert pixels.verdicts["gate", script.scene.layout.index("shed")].decided
    assert Parts().with_gate(0, 1.0).gate_is_open(0)
