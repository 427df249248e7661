"""The game: what happens when, who knows what, and what is counted."""

import numpy as np
import pytest

from farm_ar.errors import OptionError, SceneError
from farm_ar.game_logic.farm_game import HAND_AWAY_S, FarmGame, Phase
from farm_ar.game_logic.headset import FIELDS_OF_VIEW, look_at
from farm_ar.geometry import inside_footprint
from farm_ar.scenes import Camera, Layout, builtin_scene

FARM = builtin_scene("farm")
PHOTO = FIELDS_OF_VIEW["photo"]
EYE = np.array([0.6, -0.3])
AT_S1 = look_at(EYE, np.array([0.33, 0.45]), PHOTO)
AT_S4 = look_at(EYE, np.array([0.90, 0.45]), PHOTO)


def new_game(camera: Camera = AT_S1, **arguments) -> FarmGame:
    return FarmGame(FARM, camera, np.random.default_rng(0), **arguments)


def carry(game: FarmGame, label: str, to: tuple[float, float], turn: float = 0.0) -> None:
    index = game.truth.index(label)
    game.move(index, np.array(to) - game.truth.position[index], turn)


def test_at_first_nothing_is_believed_wrongly_and_animals_are_under_way():
    game = new_game()
    assert game.phase is Phase.PLAY
    assert game.tracker.belief.wrong_labels == 0
    assert len(game.flock) >= 10
    assert game.counters.counted.sum() == 0


def test_undisturbed_every_animal_gets_into_the_building_of_its_colour():
    game = new_game()
    game.play(30.0)
    assert game.counters.counted[game.truth.movable].min() >= 20
    assert game.miscounts == 0


def test_no_animal_moves_while_the_hand_is_visible():
    game = new_game()
    game.begin_visit()
    before = game.flock.position
    game.play(5.0)
    carry(game, "yellow-coop", (0.2, 0.2))
    np.testing.assert_array_equal(game.flock.position, before)
    assert game.clock == 0.0
    game.end_visit()
    game.play(0.5)
    assert not np.array_equal(game.flock.position[: len(before)], before)


def test_only_a_snapshot_moves_knowledge_from_the_table_to_the_belief():
    game = new_game()
    game.begin_visit()
    carry(game, "cyan-hutch", (0.52, 0.17))
    yellow = game.truth.index("cyan-hutch")
    np.testing.assert_array_equal(game.believed.position[yellow], FARM.layout.position[yellow])
    game.end_visit()
    np.testing.assert_allclose(game.believed.position[yellow], game.truth.position[yellow])


def test_a_building_moved_out_of_view_keeps_its_believed_place_and_strands_its_animals():
    game = new_game(AT_S1)
    index = game.truth.index("green-coop")  # not in view when the player faces S1
    game.begin_visit()
    carry(game, "green-coop", (1.1, 0.15))
    game.end_visit()
    np.testing.assert_array_equal(game.believed.position[index], FARM.layout.position[index])
    game.play(20.0)
    assert game.counters.stranded[index] > 5
    assert game.counters.counted[index] == 0
    assert game.tracker.belief.wrong_labels == 0


def test_swapped_labels_send_animals_into_each_others_buildings():
    class Confused:
        """Takes each coop for the next one."""

        def __init__(self, scene):
            self.scene = scene

        def identify(self, snapshot):
            from farm_ar.reid import Identification, SpatialOptions, SpatialReid

            right = SpatialReid(self.scene, SpatialOptions(gate_categories=True)).identify(snapshot).labels
            swap = {"yellow-coop": "blue-coop", "blue-coop": "yellow-coop"}
            return Identification(tuple(swap.get(name, name) for name in right))

    game = new_game(AT_S1, make_reid=Confused)
    game.begin_visit()
    game.end_visit()
    assert game.tracker.belief.wrong_labels == 2
    game.play(20.0)
    yellow, blue = game.truth.index("yellow-coop"), game.truth.index("blue-coop")
    assert game.counters.misplaced[yellow] > 5
    assert game.counters.misplaced[blue] > 5
    assert game.counters.misplaced.sum() == game.counters.misplaced[[yellow, blue]].sum()


def test_after_a_snapshot_only_the_ends_of_the_paths_move():
    game = new_game()
    game.begin_visit()
    carry(game, "yellow-coop", (0.12, 0.36))
    before, curves, goals = game.flock.position, game.flock.curve, game.flock.goal
    sighting = game.end_visit()
    np.testing.assert_allclose(game.flock.position, before, atol=1e-12)
    changed = sighting.changed[goals]
    assert changed.any()
    np.testing.assert_allclose(game.flock.curve[~changed], curves[~changed])
    np.testing.assert_allclose(game.flock.curve[changed, 3], game.believed.position[goals[changed]])


def test_a_visit_to_a_still_table_identifies_everything_in_view():
    game = new_game(AT_S4)
    game.begin_visit()
    sighting = game.end_visit()
    assert sighting.accuracy == 1.0
    assert not sighting.changed.any()


def test_steering_begins_a_visit_when_the_hand_comes_into_view_and_ends_it_half_a_second_after_it_left():
    game = new_game(AT_S1)
    game.bring_hand()
    still = np.zeros(2)
    _, sighting = game.tick(still, 0.0, False)
    assert game.phase is Phase.PLAY
    for _ in range(30):
        game.tick(np.array([-0.2, 1.0]), 0.0, False)
    assert game.phase is Phase.HAND
    frozen = game.clock
    ticks_away = 0
    for _ in range(300):
        _, sighting = game.tick(np.array([0.3, -1.4]), 0.0, False)
        hand = game.tabletop.hand
        if hand is not None and not game.sees_hand():
            ticks_away += 1
        if sighting is not None:
            break
    assert sighting is not None
    assert ticks_away == pytest.approx(HAND_AWAY_S * 60, abs=1)
    assert game.clock == frozen
    assert game.phase is Phase.PLAY


def test_a_hand_that_takes_a_building_out_of_view_is_still_on_its_visit():
    game = new_game(AT_S1)
    game.begin_visit()
    blue = game.truth.index("blue-coop")
    game.tabletop.bring_hand(game.truth.position[blue])
    assert game.tabletop.grip(blue)
    for _ in range(120):
        _, sighting = game.tick(np.array([1.0, -0.1]), 0.0, True)
        assert sighting is None
    hand = game.tabletop.hand
    assert hand is not None
    assert hand.gripped == blue
    away = Camera(np.array([0.6, -0.3]), np.float64(-1.2), PHOTO, np.array(0.45), np.array(-0.5))
    game.camera = away
    for _ in range(60):
        _, sighting = game.tick(np.zeros(2), 0.0, True)
        assert sighting is None
    assert game.phase is Phase.HAND


def test_a_steered_hand_does_not_grip_what_is_out_of_view():
    game = new_game(AT_S1)
    green = game.truth.index("green-coop")
    game.tabletop.bring_hand(game.truth.position[green], raised=True)
    game.tick(np.zeros(2), 0.0, True)
    hand = game.tabletop.hand
    assert hand is not None
    assert hand.gripped is None


def test_a_withdrawn_hand_ends_its_visit_with_a_snapshot():
    game = new_game(AT_S1)
    game.bring_hand()
    assert game.withdraw_hand()[1] is None
    game.bring_hand()
    for _ in range(40):
        game.tick(np.array([-0.2, 1.0]), 0.0, False)
    assert game.phase is Phase.HAND
    assert game.withdraw_hand()[1] is not None
    assert game.tabletop.hand is None


def test_many_short_plays_are_one_long_play():
    long, short = new_game(), new_game()
    long.play(6.0)
    for _ in range(60):
        short.play(0.1)
    np.testing.assert_array_equal(long.counters.counted, short.counters.counted)
    assert len(long.flock) == len(short.flock)


def test_the_same_seed_plays_the_same_game():
    def played() -> list[bytes]:
        game = new_game()
        game.play(2.0)
        game.begin_visit()
        carry(game, "magenta-hutch", (0.3, 0.3), 0.4)
        game.end_visit()
        game.play(2.0)
        return [np.asarray(values).tobytes() for values in game.state().values()]

    assert played() == played()


def test_a_layout_other_than_the_scenes_own_is_known_to_the_game_from_the_start():
    shifted: Layout = FARM.layout.with_poses(
        np.where(
            FARM.layout.fixed[:, None], FARM.layout.position, FARM.layout.position + np.array([0.02, 0.0])
        ),
        FARM.layout.yaw,
    )
    game = new_game(layout=shifted)
    np.testing.assert_array_equal(game.believed.position, shifted.position)
    game.play(10.0)
    assert game.miscounts == 0


def test_a_scene_without_a_shed_is_refused():
    lab = builtin_scene("lab")
    with pytest.raises(SceneError, match="objects: must hold a fixed one, the shed"):
        FarmGame(lab, AT_S1, np.random.default_rng(0))


def test_animals_that_are_in_a_building_are_not_on_the_table():
    game = new_game()
    game.play(7.3)
    truth = game.truth
    for animal, goal in zip(game.flock.position, game.flock.goal, strict=True):
        assert not inside_footprint(animal, truth.position[goal], truth.yaw[goal], truth.size[goal])


class Blind:
    """Sees a hand only when told to."""

    seen = False

    def sees_hand(self, view):
        return self.seen


def test_the_half_second_begins_only_when_an_unseen_hand_has_let_go():
    detector = Blind()
    game = new_game(AT_S1, hand_detector=detector)
    blue = game.truth.index("blue-coop")
    game.tabletop.bring_hand(game.truth.position[blue], raised=True)
    game.begin_visit()
    for _ in range(20):
        assert game.tick(np.zeros(2), 0.0, False)[1] is None
    for _ in range(60):
        assert game.tick(np.zeros(2), 0.0, True)[1] is None
    ticks = 1
    while game.tick(np.zeros(2), 0.0, False)[1] is None:
        ticks += 1
    assert ticks == round(HAND_AWAY_S * 60)


def test_what_slides_on_when_the_hand_is_withdrawn_is_motion_too():
    game = new_game(AT_S1)
    blue = game.truth.index("blue-coop")
    start = game.truth.position[blue]
    game.begin_visit()
    game.tabletop.bring_hand(start)
    game.tabletop.grip(blue)
    metres = sum(game.tick(np.array([0.8, 0.0]), 0.0, True)[0].metres for _ in range(15))
    slid = game.withdraw_hand()[0].metres
    assert slid > 0.01
    assert metres + slid >= np.linalg.norm(game.truth.position[blue] - start) - 1e-9


def test_more_animals_can_be_sent_out_and_none():
    many, none = new_game(animals_a_second=75.0), new_game(animals_a_second=0.0)
    assert len(many.flock) > 200
    many.play(4.0)
    assert 200 < len(many.flock) < 450
    assert many.miscounts == 0
    none.play(10.0)
    assert len(none.flock) == 0
    assert none.counters.counted.sum() == 0


def test_what_stands_elsewhere_at_once_strands_its_animals_until_a_snapshot_sees_it():
    game = new_game()
    game.play(1.0)
    yellow = game.truth.index("yellow-coop")
    position = game.truth.position.copy()
    position[yellow] = (0.2, 0.15)
    game.rearrange(game.truth.with_poses(position, game.truth.yaw))
    assert game.tracker.belief.layout.position[yellow].tolist() != [0.2, 0.15]
    game.play(10.0)
    assert game.counters.stranded[yellow] > 0
    game.end_visit()
    np.testing.assert_allclose(game.believed.position[yellow], (0.2, 0.15), atol=1e-9)
    stranded = game.counters.stranded[yellow]
    game.play(10.0)
    assert game.counters.stranded[yellow] == stranded


@pytest.mark.parametrize("seconds", [-1.0, 1e308, np.nan])
def test_time_and_animals_have_limits(seconds):
    with pytest.raises(OptionError, match="seconds"):
        new_game().play(seconds)
    with pytest.raises(OptionError, match="animals_a_second"):
        new_game(animals_a_second=seconds)
