"""Frames of the headset with their labels."""

import numpy as np
import pytest

from farm_ar.experiments.headset_frames import PIXELS, Frame, changing, chosen, fig13, identified
from farm_ar.experiments.real_rooms import Case, walks_of
from farm_ar.experiments.setting import Setting
from farm_ar.rendering import Intrinsics, View
from farm_ar.scenes import builtin_scene


@pytest.fixture(scope="module")
def report():
    return fig13(Setting(layouts=1, quick=True))


def test_every_room_has_two_frames_and_each_label_its_colour(report):
    panels = report.figure.axes
    assert len(panels) == 6
    for axes in panels:
        for text in axes.texts:
            a, b = text.get_text().split(" → ")
            green = text.get_bbox_patch().get_facecolor()[:3] == pytest.approx(
                (0x1F / 255, 0x8A / 255, 0x3B / 255)
            )
            assert green == (a == b)
    shown = [tuple(text.get_text().split(" → ")) for axes in panels for text in axes.texts]
    assert shown == [(row["true"], row["given"]) for row in report.rows]


def test_labels_stand_inside_the_picture_as_their_chairs_do(report):
    for axes in report.figure.axes:
        for text in axes.texts:
            x, y = text.get_position()
            assert 0 < x < PIXELS[0]
            assert -40 < y < PIXELS[1]


def test_the_picture_is_the_detectors_view():
    """All corners of what counts are inside the picture that is drawn from the true pose."""
    room = builtin_scene("classroom")
    walked = walks_of(0, Case("classroom", 30), 0.3, 1, 0.5)
    batch, layout = walked.snapshots, walked.layouts
    for frame in identified(room, walked)[:12]:
        camera = walked.cameras.at((0, frame.number))
        view = View.of(camera, Intrinsics.of_view(*PIXELS, camera.fov.left + camera.fov.right))
        for label in batch.true_labels(frame.number, room.layout.labels):
            i = room.layout.labels.index(label)
            half, yaw = layout.size[i] / 2, layout.yaw[0, i]
            turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
            for side, front, up in np.ndindex(2, 2, 2):
                x, z = layout.position[0, i] + turn @ (half[[0, 2]] * [2 * side - 1, 2 * front - 1])
                column, row = view.pixels(np.array([x, 2 * half[1] * up, z]))
                assert -1 <= column <= PIXELS[0]
                assert -1.5 <= row <= PIXELS[1] + 0.5


def test_frames_are_chosen_by_how_many_labels_they_have():
    frames = [
        Frame(0, ("a",), ("a",)),
        Frame(1, ("a", "b"), ("a", "b")),
        Frame(2, ("b", "c", "d"), ("c", "b", "d")),
    ]
    assert chosen(frames) == (frames[1], frames[2])
    assert changing(frames) == (1, 4)
