"""Which object holds which label, as the environment counts it."""

import numpy as np

from farm_ar.envs import FarmToTableEnv
from farm_ar.game_logic.perception import OraclePerception
from farm_ar.reid import Identification
from farm_ar.scenes import Camera, Detections, Detector, FieldOfView

THERE, BACK = (0.1, 0.0), (-0.1, 0.0)


def belief_of(env):
    return env.world.tracker.belief


def test_of_an_exchanged_pair_each_holds_the_others_label(plain, offsets):
    env = plain()
    env.reset(seed=0)
    env.step(offsets(THERE, BACK))
    np.testing.assert_array_equal(belief_of(env).holder, [1, 0, 2])
    np.testing.assert_array_equal(belief_of(env).wrong, [True, True, False])


def test_a_label_not_seen_keeps_its_holder_and_its_place(plain, offsets, left_only):
    env = plain()
    env.reset(seed=0, options={"camera": left_only})
    # The left coop leaves the view; the right one, not in view, does not move. Nothing is seen at all.
    *_, info = env.step(offsets((0.0, 0.1), (0.0, 0.0)))
    np.testing.assert_array_equal(belief_of(env).holder, [0, 1, 2])
    np.testing.assert_array_equal(belief_of(env).layout.position, [[0.25, 0.3], [0.35, 0.3], [0.3, 0.5]])
    assert (info["wrong_labels"], info["accuracy"]) == (0, 1.0)


def test_one_seen_in_anothers_place_takes_its_label_while_that_ones_keeps_both(plain, offsets):
    env = plain(visits=2)
    env.reset(seed=0)
    # Both go, the left one to where the right one was; then only that place is looked at.
    env.world.move(1, np.array([0.2, 0.3]), 0.0)
    env.world.move(0, np.array([0.1, 0.0]), 0.0)
    env.world.camera = Camera(np.array([0.35, 0.2]), np.array(0.0), FieldOfView(0.2, 0.2, 0.2))
    *_, info = env.step(offsets())
    assert info["wrong_labels"] == 1
    np.testing.assert_array_equal(belief_of(env).holder, [0, 0, 2])
    # Both labels are held by the left coop, the right one wrongly; the left label is believed at home.
    np.testing.assert_array_equal(belief_of(env).wrong, [False, True, False])
    np.testing.assert_allclose(belief_of(env).layout.position[:2], [[0.25, 0.3], [0.35, 0.3]])


def test_a_label_read_from_a_false_detection_is_wrong(pair):
    ghosts = OraclePerception(Detector(miss_rate=1.0, false_rate=30.0))
    env = FarmToTableEnv(scene=pair, control="layout", game=False, jitter="none", perception=ghosts)
    env.reset(seed=0)
    *_, info = env.step(np.zeros(6))
    assert info["wrong_labels"] == 2
    np.testing.assert_array_equal(belief_of(env).holder, [-1, -1, 2])


def test_what_was_wrong_stays_wrong_while_it_is_not_looked_at(plain, offsets):
    env = plain(visits=2)
    env.reset(seed=0)
    *_, info = env.step(offsets(THERE, BACK))
    assert info["wrong_labels"] == 2
    env.world.camera = Camera(np.array([0.3, -2.0]), np.array(np.pi))
    *_, info = env.step(offsets())
    assert (info["wrong_labels"], info["accuracy"]) == (2, 1.0)


def test_a_rule_that_names_nothing_changes_nothing(plain, offsets):
    env = plain(reid="last-known")
    env.reset(seed=0)
    *_, info = env.step(offsets((0.0, 0.05), (0.0, 0.05)))
    # Both were seen, but not where they were last known; the shed was.
    assert info["wrong_labels"] == 0
    assert round(3 * info["accuracy"]) == 1
    np.testing.assert_array_equal(belief_of(env).layout.position[0], [0.25, 0.3])


def test_the_rules_of_ones_own_are_asked(pair):
    asked = []

    class Reversed:
        def __init__(self, scene):
            self.names = scene.layout.labels

        def identify(self, snapshot):
            asked.append(len(snapshot.detections))
            order = {"coop": ["right-coop", "left-coop"], "shed": ["shed"]}
            return Identification(tuple(order[c].pop(0) for c in snapshot.detections.category))

    env = FarmToTableEnv(scene=pair, control="layout", game=False, jitter="none", reid=Reversed)
    env.reset(seed=0)
    _, reward, *_, info = env.step(np.zeros(6))
    assert asked == [3]
    assert (reward, info["wrong_labels"]) == (2.0, 2)


def test_detections_carry_no_identity(pair):
    seen: list[Detections] = []

    class Curious(OraclePerception):
        def perceive(self, truth, camera, rng):
            perceived = super().perceive(truth, camera, rng)
            seen.append(perceived.snapshot.detections)
            return perceived

    env = FarmToTableEnv(scene=pair, control="layout", game=False, jitter="none", perception=Curious())
    env.reset(seed=0)
    env.step(np.zeros(6))
    assert seen[0].ids == ("0", "1", "2")
    assert set(seen[0].category) == {"coop", "shed"}
