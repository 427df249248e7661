"""Scripts that are written move by move, and how they leave things."""

import numpy as np
import pytest

from farm_ar.showcases import ScriptError, ScriptRecorder, load_script
from farm_ar.showcases.draft import Draft, MoveError
from farm_ar.showcases.film import outcome


def test_what_is_written_is_a_script_that_can_be_saved_and_loaded(tmp_path):
    draft = Draft(gaze="S4", seed=7)
    draft.begin_visit()
    draft.add("orange-coop to 0.9 0.3 turn -40")
    draft.begin_visit()
    draft.add("white-hutch by -0.1 0.05")
    draft.add("white-hutch turn 15")
    path = tmp_path / "mine.toml"
    path.write_text(draft.text())
    script = load_script(path)
    assert (script.gaze, script.seed, draft.visits) == ("S4", 7, 2)
    first, (second, third) = script.visits[0].moves[0], script.visits[1].moves
    assert (first.building, first.to, first.by) == ("orange-coop", (0.9, 0.3), None)
    assert first.turn == pytest.approx(np.deg2rad(-40))
    assert (second.by, second.turn) == ((-0.1, 0.05), 0.0)
    assert (third.by, third.turn) == ((0.0, 0.0), pytest.approx(np.deg2rad(15)))


@pytest.mark.parametrize(
    "line",
    [
        "blue-coop",
        "blue-coop to",
        "blue-coop to 0.4",
        "blue-coop to 0.4 x",
        "blue-coop to 0.4 nan",
        "blue-coop to 0.4 0_3",
        "blue-coop to 0.4 \u0661",
        "blue-coop over 0.4 0.3",
        "blue-coop to 0.4 0.3 by 0.1 0.1",
        "blue-coop turn 10 turn 20",
        "blue-coop by 0.1 0.1 30",
    ],
)
def test_a_line_that_says_no_move_is_refused_and_not_kept(line):
    draft = Draft()
    draft.begin_visit()
    before = draft.text()
    with pytest.raises(MoveError, match="move: must be BUILDING to X Z"):
        draft.add(line)
    assert draft.text() == before


@pytest.mark.parametrize("line", ["shed by 0.1 0.1", "pink-coop by 0.1 0.1", "blue-coop to 3 0.1"])
def test_a_move_that_cannot_be_made_is_refused_and_not_kept(line):
    draft = Draft()
    draft.begin_visit()
    before = draft.text()
    with pytest.raises(ScriptError, match=r"visits\[0\].moves\[0\]"):
        draft.add(line)
    assert draft.text() == before


def test_a_gaze_that_is_no_site_is_refused_at_once():
    with pytest.raises(ScriptError, match="gaze: must be one of sweep, S1"):
        Draft(gaze="S9")


def test_the_outcome_is_that_of_the_film_without_its_pictures():
    script = load_script("demonstration-2")
    film, state = outcome(script, to_the_end=True)
    whole = ScriptRecorder(script, make_pictures=None).play()
    assert film.detections == whole.detections
    assert film.counters == whole.counters
    assert film.frames == whole.frames
    short, soon = outcome(script)
    assert short.detections == whole.detections
    assert short.frames == whole.frames - 30 * script.ending + 1
    assert soon.seconds < state.seconds
    assert not state.wrong.any()
