"""Play without the pause: looks while the hand moves things, animals that go on, ends that glide."""

from itertools import pairwise

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.errors import OptionError
from farm_ar.game_logic.farm_game import TICK_S, FarmGame, Phase
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.game_logic.live import GLIDE_M_S, LiveGame, hidden_by_hand
from farm_ar.game_logic.physics.gripper import HandState
from farm_ar.scenes import builtin_scene
from farm_ar.showcases.live import play, random_script

FARM = builtin_scene("farm")
CAMERA = look_at(np.array([0.35, -0.3]), np.array([0.35, 0.4]), field_of_view("photo"))


def game_of(kind, **named):
    return kind(FARM, CAMERA, np.random.default_rng(0), **named)


def swap(game):
    """Two look-alike coops change places, by way of a third place."""
    layout = FARM.layout
    first, second = layout.index("yellow-coop"), layout.index("blue-coop")
    game.begin_visit(CAMERA)
    home, other = layout.position[first].copy(), layout.position[second].copy()
    for index, to in ((first, np.array([0.62, 0.2])), (second, home), (first, other)):
        game.move(index, to - game.truth.position[index], 0.0)
    return game.end_visit()


def test_a_swap_that_fools_the_pause_does_not_fool_looking_all_the_time():
    script = random_script(FARM, np.random.default_rng(3))  # orange and green change places, in view
    paused, live = (play(script, "spatial", update) for update in ("pause", "live"))
    assert (paused["wrong_labels"], live["wrong_labels"]) == (2, 0)
    assert live["astray"] < paused["astray"]


def test_a_building_that_is_carried_out_of_view_is_lost_either_way():
    script = random_script(FARM, np.random.default_rng(0))  # by way of the corner that nobody looks at
    for update in ("pause", "live"):
        assert play(script, "spatial", update)["wrong_labels"] == 2


def test_animals_stand_still_in_the_pause_and_go_on_without_it():
    paused, live = game_of(FarmGame, carry="lift"), game_of(LiveGame, carry="lift")
    swap(paused)
    swap(live)
    assert paused.clock == 0
    assert live.clock == pytest.approx(live.tabletop.ticks * TICK_S, rel=0.2)
    assert live.clock > 3


def test_ends_glide_and_do_not_jump():
    game = game_of(LiveGame)
    ends = [game.ends]
    game.begin_visit(CAMERA)
    index = FARM.layout.index("red-coop")
    game.move(index, np.array([0.06, -0.08]), 0.0, lambda table: ends.append(game.ends))
    game.end_visit()
    steps = np.linalg.norm(np.diff(ends, axis=0), axis=2)
    assert 0 < steps.max() <= GLIDE_M_S * TICK_S + 1e-12
    game.play(3.0)
    assert np.allclose(game.ends, game.believed.position)
    assert np.allclose(game.believed.position[index], game.truth.position[index])


def test_animals_whose_building_is_in_the_hand_wait_where_they_are_and_then_go_on():
    game, held = game_of(LiveGame), FARM.layout.index("blue-coop")
    other = FARM.layout.index("green-coop")
    game.begin_visit(CAMERA)
    places = {held: [], other: []}

    def watch(table):
        position, goal = game.flock.position, game.flock.goal
        for label, seen in places.items():
            seen.append(position[goal == label][:3].copy())

    begin = game.counters.stranded.copy()
    game.move(held, np.array([0.05, -0.1]), 0.0, watch)
    middle = len(places[held]) // 2
    assert np.array_equal(places[held][middle], places[held][middle + 5])
    assert np.linalg.norm(places[other][middle + 5] - places[other][middle], axis=1).min() > 0.001
    assert game.counters.stranded[held] == begin[held]
    game.end_visit()
    waiting = game.flock.position[game.flock.goal == held][0]
    game.play(0.2)
    assert np.linalg.norm(game.flock.position[game.flock.goal == held][0] - waiting) > 0.01
    before = game.counters.counted[held]
    game.play(6.0)
    assert game.counters.counted[held] > before


def test_no_animal_jumps_meanwhile():
    game = game_of(LiveGame)
    game.begin_visit(CAMERA)
    seen = []

    def watch(table):
        goals = game.flock.goal.tolist()
        seen.append(sorted(zip(goals, map(tuple, game.flock.position.tolist()), strict=True)))

    game.move(FARM.layout.index("blue-coop"), np.array([0.05, -0.1]), 0.0, watch)
    for before, after in pairwise(seen):
        old = np.array([place for _, place in before])
        for _, place in after:  # each stood within a tick's run of there, or has just left the shed
            near = np.linalg.norm(old - place, axis=1).min()
            assert near <= 0.12 * TICK_S * 1.5 or place[1] > 0.5


def test_what_the_hand_holds_or_covers_is_not_seen():
    layout = FARM.layout
    held = layout.index("blue-coop")
    x, z = layout.position[held]
    hand = HandState(position=np.array([x, z]), yaw=0.0, velocity=np.zeros(2), raised=False, gripped=held)
    assert np.flatnonzero(hidden_by_hand(layout, CAMERA, hand)).tolist() == [held]
    assert not hidden_by_hand(layout, CAMERA, None).any()
    eye = np.array([CAMERA.position[0], float(CAMERA.height), CAMERA.position[1]])
    behind = layout.index("yellow-coop")
    middle = np.array([layout.position[behind, 0], layout.size[behind, 1] / 2, layout.position[behind, 1]])
    share = (0.05 - eye[1]) / (middle[1] - eye[1])
    palm = eye + min(share, 0.97) * (middle - eye)  # on the line of sight, just before it
    open_hand = HandState(position=palm[[0, 2]], yaw=0.0, velocity=np.zeros(2), raised=False, gripped=None)
    assert hidden_by_hand(layout, CAMERA, open_hand)[behind]


def test_the_pause_stays_the_default_and_is_as_it_was():
    env = FarmToTableEnv(jitter="none")
    assert type(env.reset(seed=0) and env.world) is FarmGame
    assert "update" not in env.trace()["arguments"]
    live = FarmToTableEnv(jitter="none", update="live")
    live.reset(seed=0)
    assert type(live.world) is LiveGame
    with pytest.raises(OptionError, match="update"):
        FarmToTableEnv(update="later")
    with pytest.raises(OptionError, match="update"):
        FarmToTableEnv(update="live", control="layout", game=False, scene="L1")


def test_a_steered_hand_is_watched_too():
    env = FarmToTableEnv(control="hand", update="live", jitter="none")
    env.reset(seed=0)
    before = env.world.clock
    for _ in range(20):
        env.step(np.array([0.0, 0.5, 0.0, -1.0], np.float32))
    assert env.world.phase is Phase.HAND
    assert env.world.render_state().phase == "play"  # no picture says that they are frozen
    assert env.world.clock - before == pytest.approx(2.0, abs=0.05)  # the animals ran all the time


def test_without_the_pause_nobody_waits():
    script = random_script(FARM, np.random.default_rng(1))
    waited = {update: play(script, "spatial", update)["interrupted_s"] for update in ("pause", "live")}
    assert waited["live"] == 0
    assert waited["pause"] > 5
