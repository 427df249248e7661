"""Tracks that go on: evidence for the same label, but for switches and jumps."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.reid import Identification, Session
from farm_ar.reid.answers import Assurance
from farm_ar.reid.session.tracks import Track, hints, with_tracks
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot

ALL_ROUND = FieldOfView(np.pi, np.pi, 1e6)
ROW = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
METHODS = ["adaptive", "likelihood", "spatial", "nearest"]


def scene(n=4):
    layout = Layout(tuple("abcd"[:n]), ("chair",) * n, ROW[:n], np.full(n, np.nan), np.full((n, 3), 0.3))
    return Scene("row", (4.0, 4.0), layout)


def look(place, tracks, origin=(0.0, 0.0)):
    n = len(place)
    seen = Detections(
        ("chair",) * n, np.asarray(place) + origin, np.full(n, np.nan), np.full((n, 3), 0.3), track_id=tracks
    )
    return Snapshot(Camera(np.array([1.5, -4.0]), 0.0, ALL_ROUND), seen)


def swapping(steps=20):
    """Two of four things change places, past each other, step by step."""
    for share in np.linspace(0, 1, steps):
        angle = np.pi * share
        middle, arm = np.array([0.5, 0.0]), 0.5 * np.array([np.cos(angle), 0.6 * np.sin(angle)])
        yield np.array([middle - arm, middle + arm, ROW[2], ROW[3]])


@pytest.mark.parametrize("reid", METHODS)
def test_labels_follow_tracks_where_two_look_alikes_change_places(reid):
    session = Session(scene(), reid)
    tracks = ("t1", "t2", "t3", "t4")
    for place in swapping():
        answer = session.identify(look(place, tracks))
    assert answer.labels == ("a", "b", "c", "d")
    # Without tracks the same last snapshot is identified by its places.
    other = Session(scene(), reid)
    assert other.identify(look(place, (None,) * 4)).labels == ("b", "a", "c", "d")


def test_the_stated_rate_is_how_fast_tracks_are_forgotten():
    def followed(rate):
        session = Session(scene(), switch_rate=rate)
        for place in swapping(15):
            answer = session.identify(look(place, ("t1", "t2", "t3", "t4")))
        return answer

    sure, doubtful = followed(0.001), followed(0.02)
    assert sure.labels == doubtful.labels == ("a", "b", "c", "d")
    assert sure.confidence[0] > doubtful.confidence[0]
    assert doubtful.confidence[0] > 0.98**15 - 0.02
    assert followed(1.0).labels == ("b", "a", "c", "d")


def test_a_jump_breaks_a_track_and_moving_with_the_rest_is_none():
    session = Session(scene())
    tracks = ("t1", "t2", "t3", "t4")
    session.identify(look(ROW, tracks))
    session.confirm()
    # The names of two tracks are swapped at once: both jump by a spacing while the rest stands still.
    answer = session.identify(look(ROW[[1, 0, 2, 3]], tracks))
    assert answer.labels == ("b", "a", "c", "d")
    session = Session(scene())
    session.identify(look(ROW, tracks))
    session.confirm()
    # All go one place on: by the picture three of them are another one's.
    assert session.identify(look(ROW + np.array([1.0, 0.0]), tracks)).labels == ("a", "b", "c", "d")


def test_a_confirmed_label_goes_on_with_its_track():
    session = Session(scene(), switch_rate=0.02)
    tracks = ("t1", "t2", "t3", "t4")
    session.identify(look(ROW, tracks))
    session.confirm(("b", "a", "c", None))
    answer = session.identify(look(ROW + 0.01, tracks))
    assert answer.labels == ("b", "a", "c", None)
    assert (answer.confidence[:3] >= 0.97).all()
    assert session.identify(look(ROW, ("u1", "u2", "u3", "u4"))).labels == ("a", "b", "c", "d")


def test_a_label_that_a_track_holds_is_not_given_to_what_stands_in_its_place():
    session = Session(scene(2), switch_rate=0.02)
    session.identify(look(ROW[:2], ("t1", "t2")))
    session.confirm()
    for x in (0.2, 0.4, 0.6, 0.8):
        session.identify(look([[0.0, x], [1.0, x]], ("t1", "t2")))
    answer = session.identify(look([[0.0, 0.8], [1.0, 0.8], [0.0, 0.0]], ("t1", "t2", None)))
    assert answer.labels[:2] == ("a", "b")
    assert answer.labels[2] is None


def test_what_a_track_holds_is_left_out_of_what_others_may_be():
    picture = np.array([[0.5, 0.4, 0.1], [0.6, 0.3, 0.1]])
    answer = Identification(("b", "a"), candidates=("a", "b"), assurance=Assurance(probability=picture))
    now = look(ROW[:2], ("t1", None)).detections
    found, _ = with_tracks(answer, None, ("a", "b"), now, {0: Track((0.0, 0.0), True, {"a": 1.0})}, 0.02)
    # Of 0.6, 0.3 and 0.1 what is not held: 1% of a, 99.2% of b, all of none; in 2% it is the picture.
    rest = np.array([0.6 * 0.01, 0.3 * 0.992, 0.1])
    assert found.probability[1] == pytest.approx(0.98 * rest / rest.sum() + 0.02 * picture[1])
    assert found.labels == ("a", "b")


def test_what_a_track_holds_is_told_of_a_detection_that_the_method_is_not_asked_about():
    picture = np.array([[np.nan] * 3, [0.6, 0.3, 0.1]])
    answer = Identification((None, "a"), candidates=("a", "b"), assurance=Assurance(probability=picture))
    now = look(ROW[:2], ("t1", None)).detections
    found, _ = with_tracks(answer, answer, ("a", "b"), now, {0: Track((0.0, 0.0), True, {"a": 1.0})}, 0.02)
    rest = np.array([0.6 * 0.02, 0.3, 0.1])  # the track holds a with 98%
    assert found.probability[1] == pytest.approx(0.98 * rest / rest.sum() + 0.02 * picture[1])
    assert found.labels == ("a", "b")


def test_a_detection_set_aside_keeps_what_was_confirmed_of_its_track():
    session = Session(scene())
    session.identify(look(ROW, ("t1", "t2", "t3", "t4")))
    session.confirm()
    now = look([(0.0, 0.4), *ROW[1:]], ("t1", "t2", "t3", "t4"))
    strange = replace(now.detections, category=("sofa", "chair", "chair", "chair"))
    answer = session.identify(replace(now, detections=strange))
    assert answer.labels == ("a", "b", "c", "d")


def test_a_broken_pose_ends_its_track_and_no_other():
    session = Session(scene())
    tracks = ("t1", "t2", "t3", "t4")
    session.identify(look(ROW, tracks))
    session.confirm()
    position = ROW.copy()
    position[0] = np.nan
    lost = replace(look(ROW, tracks).detections, position=position, broken=("x: no", None, None, None))
    answer = session.identify(replace(look(ROW, tracks), detections=lost))
    assert answer.labels == (None, "b", "c", "d")
    assert answer.reason[0] == "its pose is broken: x: no"
    assert [track is None for track in session.state.look.tracks] == [True, False, False, False]
    assert session.state.look.tracks[1].held


def test_hints_are_log_odds_for_the_labels_of_held_tracks():
    now = look(ROW[:2], ("t1", "t2")).detections
    going = {0: Track((0.0, 0.0), True, {"a": 0.9}), 1: Track((1.0, 0.0), False, {"b": 1.0})}
    found = hints(("a", "b"), now, going)
    assert set(found) == {"0"}
    assert found["0"] == pytest.approx([np.log(9), -20])


def test_a_track_that_stands_still_learns_from_a_better_look():
    """The first look sees one of two twins half way, the second both: the picture decides."""
    session = Session(scene(2))
    session.identify(look([[0.5, 0.0]], ("t1",)))
    for _ in range(3):
        answer = session.identify(look([[0.5, 0.0], [0.0, 0.0]], ("t1", "t2")))
    fresh = Session(scene(2)).identify(look([[0.5, 0.0], [0.0, 0.0]], (None, None)))
    assert answer.labels == fresh.labels
    assert answer.confidence == pytest.approx(fresh.confidence)


def test_looking_often_at_one_picture_does_not_make_it_surer():
    session, place = Session(scene()), ROW + np.array([0.0, 0.35])
    first = session.identify(look(place, ("t1", "t2", "t3", "t4")))
    for _ in range(5):
        last = session.identify(look(place, ("t1", "t2", "t3", "t4")))
    assert last.confidence == pytest.approx(first.confidence)


def test_snapshots_without_tracks_are_answered_by_the_method_alone():
    class Fixed:
        def __init__(self, scene):
            self.scene = scene

        def identify(self, snapshot):
            return self.answer

    Fixed.answer = Identification(("a", None, "c", "d"))
    session = Session(scene(), Fixed)
    assert session.identify(look(ROW, (None,) * 4)).labels == ("a", None, "c", "d")
