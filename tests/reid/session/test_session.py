"""Sessions: decisions, their undoing, new and lost objects, frames, and what is learnt."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.errors import OptionError, SessionError
from farm_ar.reid import AdaptiveReid, Identification, RigidMotion, Session, identify
from farm_ar.reid.alignment import moved
from farm_ar.reid.answers import Assurance
from farm_ar.reid.session import Aligned, Committed, Confirmed, Corrected, SessionReid
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot
from farm_ar.scenes.layout import NO_CATEGORY

ALL_ROUND = FieldOfView(np.pi, np.pi, 1e6)
PLACE = np.array([[0.0, 0.0], [2.0, 0.5], [4.0, -1.0], [1.0, 3.0]])
YAW = np.array([0.1, 1.0, -2.0, 3.0])
CHAIRS = ("chair",) * 3 + ("table",)


def scene(place=PLACE, yaw=YAW, category=CHAIRS, fixed=None):
    n = len(place)
    labels = tuple(f"o{i}" for i in range(n))
    layout = Layout(labels, category, place, yaw, np.full((n, 3), 0.5), fixed=fixed)
    return Scene("room", (6.0, 5.0), layout)


def seen(place=PLACE, yaw=YAW, category=CHAIRS, tracks=None, fov=ALL_ROUND, ids=None):
    n = len(place)
    detections = Detections(category, place, yaw, np.full((n, 3), 0.5), track_id=tracks, ids=ids)
    return Snapshot(Camera(np.array([2.0, -4.0]), 0.0, fov), detections)


def test_what_was_confirmed_becomes_the_layout_at_the_commit():
    session = Session(scene())
    now = PLACE + np.array([[0.3, 0.1], [0, 0], [-0.2, 0.2], [0, 0]])
    answer = session.identify(seen(now, YAW + 0.05))
    assert answer.labels == ("o0", "o1", "o2", "o3")
    session.confirm(answer)
    assert session.scene.layout.position == pytest.approx(PLACE)
    session.commit()
    assert session.scene.layout.position == pytest.approx(now)
    assert session.scene.layout.yaw == pytest.approx(YAW + 0.05)
    assert session.scene.layout.labels == ("o0", "o1", "o2", "o3")


def test_a_correction_takes_a_label_from_the_detection_that_had_it():
    session = Session(scene())
    session.identify(seen(ids=("a", "b", "c", "d")))
    session.correct({"a": "o1"})
    assert session.state.look.labels == ("o1", None, "o2", "o3")
    session.correct({"b": "o0", "d": None})
    assert session.state.look.labels == ("o1", "o0", "o2", None)
    session.confirm()
    session.commit()
    assert session.scene.layout.position[:2] == pytest.approx(PLACE[[1, 0]])


def test_decisions_are_undone_the_last_one_first():
    session = Session(scene())
    anchor = ((0.0, 0.0, 0.0), (1.0, 1.0, np.pi / 2))
    session.align(seen(np.zeros((0, 2)), np.zeros(0), ()), anchor)
    session.identify(seen())
    session.correct({"0": "new"})
    session.confirm()
    session.commit()
    session.identify(seen())
    kinds = [Committed, Confirmed, Corrected, Aligned]
    for kind in kinds:
        assert isinstance(session.undo(), kind)
    assert session.state.frame is None
    assert session.scene.layout.labels == ("o0", "o1", "o2", "o3")
    with pytest.raises(SessionError, match="undo"):
        session.undo()
    assert session.state.look is not None


def test_only_the_last_of_snapshots_without_a_decision_is_kept():
    session = Session(scene())
    for shift in (0.0, 0.01, 0.02):
        session.identify(seen(PLACE + shift))
    assert len(session.events) == 1
    session.confirm()
    session.identify(seen(PLACE))
    assert len(session.events) == 3
    session.undo()
    assert len(session.events) == 1
    assert session.state.look.snapshot.detections.position == pytest.approx(PLACE)


def test_confirming_twice_is_once_and_other_labels_are_refused():
    session = Session(scene())
    answer = session.identify(seen())
    session.confirm()
    state = session.state
    session.confirm()
    session.confirm(answer)
    session.confirm(list(answer.labels))
    assert session.state is state
    with pytest.raises(SessionError, match="undo that"):
        session.confirm(("o1", "o0", "o2", "o3"))
    with pytest.raises(SessionError, match="undo that"):
        session.correct({"0": "o1"})


@pytest.mark.parametrize(
    ("step", "words"),
    [
        (lambda s: s.confirm(), "must have identified a snapshot"),
        (lambda s: s.correct({"0": "o1"}), "must have identified a snapshot"),
        (lambda s: s.commit(), "must have confirmed a snapshot"),
        (lambda s: s.undo(), "must have a decision to undo"),
    ],
)
def test_steps_that_need_another_before_say_which(step, words):
    session = Session(scene())
    with pytest.raises(SessionError, match=words):
        step(session)
    assert session.events == ()


@pytest.mark.parametrize(
    ("step", "words"),
    [
        (lambda s: s.correct({"9": "o1"}), r"detection: must be one of 0, 1, 2, 3, got '9'"),
        (lambda s: s.correct({"0": ""}), "non-empty string"),
        (lambda s: s.correct({"0": 7}), "non-empty string"),
        (lambda s: s.correct({"0": ["o1"]}), "non-empty string"),
        (lambda s: s.correct({"0": "o1", "1": "o1"}), "two detections"),
        (lambda s: s.correct(["o1"]), "by the ids"),
        (lambda s: s.correct({"2": "fresh"}), "has no category"),
        (lambda s: s.confirm(("o1",)), "each of 4 detections, got 1"),
        (lambda s: s.confirm(("o1", "o1", None, None)), "two detections"),
        (lambda s: s.confirm("o0o1"), "must be the label of each"),
        (lambda s: s.confirm((None, None, "fresh", None)), "has no category"),
    ],
)
def test_labels_that_cannot_be_given_are_refused_and_change_nothing(step, words):
    session = Session(scene())
    session.identify(seen(category=("chair", "chair", None, "table")))
    state = session.state
    with pytest.raises(SessionError, match=words):
        step(session)
    assert session.state is state


def test_a_new_label_enrols_the_object_where_it_was_detected():
    session = Session(scene())
    place = np.vstack([PLACE, [[5.0, 4.0]]])
    session.identify(seen(place, np.append(YAW, 0.7), (*CHAIRS, "lamp")))
    session.correct({"4": "my lamp"})
    assert "my lamp" not in session.scene.layout.labels
    session.confirm()
    layout = session.scene.layout
    assert (layout.labels[-1], layout.category[-1]) == ("my lamp", "lamp")
    assert layout.position[-1] == pytest.approx([5.0, 4.0])
    assert session.identify(seen(place, np.append(YAW, 0.7), (*CHAIRS, "lamp"))).labels[-1] == "my lamp"
    session.commit()
    assert "my lamp" in session.scene.layout.labels


def test_a_place_with_no_objects_is_filled_by_naming_them():
    session = Session(scene(np.zeros((0, 2)), np.zeros(0), ()))
    assert session.identify(seen()).labels == (None,) * 4
    session.confirm(("a", "b", "c", "t"))
    session.commit()
    assert session.scene.layout.labels == ("a", "b", "c", "t")
    assert session.identify(seen(PLACE + 0.01)).labels == ("a", "b", "c", "t")


def test_what_is_not_where_it_was_in_view_is_lost_until_it_is_found():
    fixed = np.array([False, True, False, False])
    session = Session(scene(fixed=fixed))
    rest = [2, 3]
    session.identify(seen(PLACE[rest], YAW[rest], ("chair", "table")))
    session.confirm(("o2", "o3"))
    assert session.lost == ()
    session.commit()
    assert session.lost == ("o0",)  # and not the fixed one, which the detector missed
    assert "o0" in session.scene.layout.labels
    session.identify(seen())
    session.confirm(("o0", "o1", "o2", "o3"))
    assert session.lost == ()
    session.undo()
    assert session.lost == ("o0",)


def test_what_is_out_of_view_is_not_lost_and_stays_where_it_was():
    session = Session(scene())
    narrow = FieldOfView(0.15, 0.15, 20.0)
    session.identify(seen(PLACE[[1, 3]], YAW[[1, 3]], ("chair", "table"), fov=narrow))
    session.confirm(("o1", "o3"))
    session.commit()
    assert session.lost == ()
    assert session.scene.layout.position == pytest.approx(PLACE)


def test_what_is_fixed_stays_where_it_was():
    session = Session(scene(fixed=np.array([True, False, False, False])))
    session.identify(seen(PLACE + 0.1))
    session.confirm(("o0", "o1", "o2", "o3"))
    session.commit()
    assert session.scene.layout.position == pytest.approx(np.vstack([PLACE[:1], PLACE[1:] + 0.1]))


def test_in_play_each_answer_is_believed_and_learnt_from():
    reid, known = SessionReid(AdaptiveReid), scene()
    session = Session(scene())
    for shift in (0.05, 0.1, 0.15):
        one = seen(PLACE + shift)
        answer, expected = reid(known).identify(one), session.identify(one)
        assert answer.labels == expected.labels
        assert answer.probability == pytest.approx(expected.probability)
        session.confirm()
        session.commit()
        known = session.scene
    plain = AdaptiveReid(known).identify(seen(PLACE + 0.4)).probability
    learnt = reid(known).identify(seen(PLACE + 0.4)).probability
    assert learnt[:, -1] == pytest.approx(session.identify(seen(PLACE + 0.4)).probability[:, -1])
    assert (learnt[:, -1] < 0.9 * plain[:, -1]).all()  # nothing was new in three snapshots


def test_a_session_takes_the_frame_of_the_day_if_it_is_certain():
    rng = np.random.default_rng(3)
    place, yaw = rng.uniform(0, 6, (12, 2)), rng.uniform(-3, 3, 12)
    names = tuple(rng.choice(["chair", "stool", "lamp"], 12))
    session = Session(scene(place, yaw, names))
    motion = RigidMotion(np.zeros(2), np.array([300.0, -50.0]), np.array(2.0))
    today = moved(seen(place, yaw, names), motion.inverse())
    assert session.align(today).certain
    assert session.identify(today).labels == tuple(f"o{i}" for i in range(12))
    session.confirm()
    session.commit()
    assert session.scene.layout.position == pytest.approx(place, abs=1e-6)
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    other = Session(scene(square, np.zeros(4), ("chair",) * 4))
    assert not other.align(moved(seen(square, np.full(4, np.nan), ("chair",) * 4), motion)).certain
    assert other.state.frame is None


def test_tracks_do_not_lift_the_doubt_about_a_snapshot_that_cannot_be_right():
    rng = np.random.default_rng(0)
    place, yaw, n = rng.uniform(0, 6, (10, 2)), rng.uniform(-3, 3, 10), 10
    tracks = tuple(f"t{i}" if i < 3 else None for i in range(n))
    session = Session(scene(place, yaw, ("chair",) * n))
    session.identify(seen(place, yaw, ("chair",) * n, tracks))
    session.confirm()
    answer = session.identify(seen(place * 100, yaw, ("chair",) * n, tracks))
    assert any("centimetres" in warning for warning in answer.warnings)
    assert (answer.confidence[:3] > 0.9).all()  # the tracks themselves went on
    assert answer.confidence[3:].max() < 0.3


def test_what_tracks_held_in_another_frame_is_not_believed():
    motion = RigidMotion(np.zeros(2), np.array([1.0, 0.5]), np.array(0.6))
    tracks = ("a", "b", "c", "d")
    right = seen(tracks=tracks)
    elsewhere = moved(right, motion)
    session = Session(scene())
    without = session.identify(right).confidence
    session.identify(elsewhere)
    assert session.align(elsewhere).certain
    assert session.identify(elsewhere).confidence == pytest.approx(without, abs=1e-6)
    session.identify(right)
    session.undo()
    assert session.identify(right).confidence == pytest.approx(without, abs=1e-6)


def test_where_the_place_names_no_categories_those_of_detections_tell_nothing():
    session = Session(scene(category=(NO_CATEGORY,) * 4))
    motion = RigidMotion(np.zeros(2), np.array([3.0, 4.0]), np.array(0.7))
    assert session.align(moved(seen(), motion)).certain
    session.undo()
    more = seen(np.vstack([PLACE, [[8.0, 8.0]]]), np.append(YAW, 0.0), (*CHAIRS, "chair"))
    assert session.identify(more).labels == ("o0", "o1", "o2", "o3", None)
    session.correct({"4": "new"})
    session.confirm()
    assert session.state.learnt is not None
    assert session.state.learnt.snapshots == 1
    assert session.identify(more).labels == ("o0", "o1", "o2", "o3", "new")


def test_nothing_is_learnt_of_what_identify_does_not_use():
    rng = np.random.default_rng(1)
    place, yaw, size = rng.uniform(0, 6, (10, 2)), rng.uniform(-3, 3, 10), rng.uniform(0.3, 0.9, (10, 3))
    layout = Layout(tuple(f"o{i}" for i in range(10)), ("chair",) * 10, place, yaw, size)
    camera = Camera(np.array([2.0, -4.0]), 0.0, ALL_ROUND)

    def learnt(sizes, again=False):
        rows = [*range(10), 0] if again else [*range(10)]
        detections = Detections(("chair",) * len(rows), place[rows], yaw[rows], sizes[rows])
        session = Session(Scene("room", (6.0, 6.0), layout))
        session.identify(Snapshot(camera, detections))
        session.confirm()
        return session.state.learnt.to_json()

    assert learnt(100 * size) == learnt(np.full((10, 3), np.nan))
    assert learnt(size, again=True) == learnt(size)


def test_only_the_adaptive_method_learns():
    for reid, learns in (("adaptive", True), (AdaptiveReid, True), ("likelihood", False), ("spatial", False)):
        session = Session(scene(), reid)
        session.identify(seen(PLACE + 0.05))
        session.confirm()
        assert (session.state.learnt is not None) == learns
        session.undo()
        assert session.state.learnt is None


def test_what_is_learnt_is_what_the_method_learns_of_the_confirmed_labels():
    session = Session(scene())
    one = seen(PLACE + 0.05)
    session.identify(one)
    session.confirm()
    reid = AdaptiveReid(scene())
    first = reid.learn(one, ("o0", "o1", "o2", "o3"))
    assert session.state.learnt.to_json() == first.to_json()
    session.identify(one)
    session.confirm(("o1", "o0", "o2", None))
    second = AdaptiveReid(scene(), disorder=first).learn(one, ("o1", "o0", "o2", None))
    assert session.state.learnt.to_json() == second.to_json()
    assert session.identify(one).probability == pytest.approx(
        AdaptiveReid(scene(), disorder=second).identify(one).probability
    )


def test_a_new_object_of_a_new_category_does_not_stop_the_learning():
    session = Session(scene())
    place = np.vstack([PLACE, [[5.0, 4.0]]])
    session.identify(seen(place[:4], YAW, CHAIRS))
    session.confirm()
    assert session.state.learnt.snapshots == 1
    with_lamp = seen(place, np.append(YAW, 0.0), (*CHAIRS, "lamp"))
    session.identify(with_lamp)
    session.confirm((*session.state.look.labels[:4], "lamp 1"))
    assert session.state.learnt.snapshots == 2


def broken(snapshot, i, reason="x: must be a number, got None"):
    found = snapshot.detections
    position = found.position.copy()
    position[i] = np.nan
    reasons = tuple(reason if k == i else None for k in range(len(found)))
    return replace(snapshot, detections=replace(found, position=position, broken=reasons))


def test_one_broken_pose_costs_no_more_than_itself_in_a_saved_session_too(tmp_path):
    snapshot = broken(seen(PLACE + 0.1, YAW), 1)
    alone = identify(scene(), snapshot)
    session = Session(scene())
    answer = session.identify(snapshot)
    assert answer.labels == alone.labels == ("o0", None, "o2", "o3")
    assert answer.reason == alone.reason
    with pytest.raises(SessionError, match=r"labels\[1\]: must be None: the pose of detection 1"):
        session.correct({"1": "o1"})
    session.save(tmp_path / "session.json")
    again = Session.load(tmp_path / "session.json")
    found = again.state.look.snapshot.detections
    assert found.broken == snapshot.detections.broken
    assert np.isnan(found.position[1]).all()
    again.confirm()
    again.commit()
    assert again.scene.layout.position[1] == pytest.approx(PLACE[1])
    assert again.scene.layout.position[0] == pytest.approx(PLACE[0] + 0.1)


def test_answers_that_are_probably_wrong_are_named_when_they_are_confirmed(tmp_path):
    # Two twins, both seen between their places: either way is as probable.
    two = scene(PLACE[:2], np.full(2, np.nan), ("chair",) * 2)
    between = seen(
        PLACE[:2] * 0 + [[0.9, 0.3], [1.1, 0.2]], np.full(2, np.nan), ("chair",) * 2, ids=("a", "b")
    )
    session = Session(two, reid=Unsure)
    session.identify(between)
    session.save(tmp_path / "session.json")
    assert session.confirm() == ("a",)
    assert session.confirm() == ()
    again = Session.load(tmp_path / "session.json", reid=Unsure)
    again.correct({"a": "o0"})
    assert again.confirm() == ()
    again.undo()
    again.undo()
    assert again.confirm(["o0", "o1"]) == ()
    again.undo()
    assert again.confirm(Unsure(two).identify(between)) == ("a",)


class Unsure:
    """Says o0 and o1, the first with less confidence than not."""

    def __init__(self, scene):
        self.scene = scene

    def identify(self, snapshot):
        return Identification(("o0", "o1"), assurance=Assurance(confidence=np.array([0.4, 0.6])))


def test_a_label_of_another_category_is_given_only_by_force():
    session = Session(scene())
    session.identify(seen(ids=("a", "b", "c", "d")))
    with pytest.raises(SessionError, match=r"labels\[0\]: must be of category chair, as detection a is;"):
        session.correct({"a": "o3"})
    with pytest.raises(SessionError, match=r"got 'o3, a table'"):
        session.confirm(("o3", "o1", "o2", "o0"))
    session.correct({"a": "o3"}, force=True)
    assert session.state.look.labels == ("o3", "o1", "o2", None)
    session.confirm()  # what was forced before needs no force again
    session.undo()
    session.confirm(("o3", "o1", "o2", "o0"), force=True)
    assert session.state.look.labels == ("o3", "o1", "o2", "o0")


def test_one_object_no_objects_in_view_and_far_coordinates():
    session = Session(scene(PLACE[:1] + 1e6 - 5, YAW[:1], ("chair",)))
    session.identify(seen(np.zeros((0, 2)), np.zeros(0), ()))
    session.confirm()
    session.commit()
    with pytest.raises(SessionError, match="since the last commit"):
        session.commit()
    session.identify(seen(PLACE[:1] + 1e6 - 5, YAW[:1], ("chair",)))
    session.confirm(("o0",))
    session.commit()
    assert session.scene.layout.position[0] == pytest.approx(PLACE[0] + 1e6 - 5)
    assert isinstance(session.identify(seen(np.zeros((0, 2)), np.zeros(0), ())), Identification)


@pytest.mark.parametrize("rate", [-0.1, 1.5, np.nan, True])
def test_a_rate_of_switches_is_a_probability(rate):
    with pytest.raises(OptionError, match="switch_rate"):
        Session(scene(), switch_rate=rate)


def test_a_method_that_is_not_known_is_refused():
    with pytest.raises(OptionError, match="reid"):
        Session(scene(), reid="guess")


AWAY = ((0.0, 0.0, 0.0), (0.25, -1.0, 0.7))
"""An anchor: one pose in the snapshots' frame and in the map's."""


def _untidy():
    """A session in another frame that has lost o0, with tracks, of which the last look is not committed."""
    session = Session(scene())
    session.align(_there(0.0), AWAY, at_least=0.0)
    for shift in (0.05, 0.1):
        session.identify(_there(shift))
        session.confirm(("o1", "o2", "o3"))
        if shift < 0.1:
            session.commit()
    return session


def _there(shift, tracks=("a", "b", "c")):
    """All things but the first, in the frame of the session."""
    here = RigidMotion(np.zeros(2), np.array(AWAY[1][:2]), np.array(AWAY[1][2]))
    return moved(seen(PLACE[1:] + shift, YAW[1:], CHAIRS[1:], tracks), here.inverse())


def test_what_is_final_is_known_and_not_undone(tmp_path):
    """Frame, learning, lost things, tracks and what is not committed are as where all is kept."""
    settled = _untidy()
    settled.settle(4)
    assert settled.events == ()
    settled.save(tmp_path / "settled.json")
    for session in (settled, Session.load(tmp_path / "settled.json")):
        kept = _untidy()
        with pytest.raises(SessionError, match="must have a decision to undo"):
            session.undo()
        assert session.lost == kept.lost == ("o0",)
        assert session.state.viewed == kept.state.viewed == {"o0", "o1", "o2", "o3"}
        assert session.state.learnt.to_json() == kept.state.learnt.to_json()
        assert session.state.frame.x == pytest.approx(kept.state.frame.x, abs=1e-12)
        for step in range(2):
            answer, expected = (one.identify(_there(0.3 * step)) for one in (session, kept))
            assert answer.labels == expected.labels == ("o1", "o2", "o3")
            np.testing.assert_allclose(answer.confidence, expected.confidence, rtol=1e-6)
        session.commit()
        kept.commit()
        places = session.scene.layout.position
        np.testing.assert_allclose(places, kept.scene.layout.position, atol=1e-9)
        np.testing.assert_allclose(places, np.vstack([PLACE[:1], PLACE[1:] + 0.1]), atol=1e-9)


def test_the_last_decisions_can_be_undone_when_those_before_are_final():
    session = _untidy()
    session.settle(3)
    assert isinstance(session.undo(), Confirmed)
    np.testing.assert_allclose(
        session.scene.layout.position, np.vstack([PLACE[:1], PLACE[1:] + 0.05]), atol=1e-9
    )
    with pytest.raises(SessionError, match="must have a decision to undo"):
        session.undo()


@pytest.mark.parametrize("decisions", [-1, 5])
def test_no_more_is_final_than_was_decided(decisions):
    with pytest.raises(SessionError, match="decisions: must be from 0 to 4"):
        _untidy().settle(decisions)
