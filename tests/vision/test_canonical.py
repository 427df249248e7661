"""The canonical camera: pixels go where the geometry of the two cameras says."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.rendering import HOLOLENS_2, Intrinsics, View
from farm_ar.vision.canonical import (
    HEIGHT,
    WIDTH,
    azimuth,
    canonical_image,
    canonical_view,
    homography,
    on_plane,
)


def camera(roll=0.0, lens=HOLOLENS_2, yaw=0.3):
    return View(lens, np.array([0.4, 0.5, -0.3]), yaw, -0.6, roll)


@given(st.floats(-0.6, 0.6), st.floats(-3, 3), st.floats(-0.2, 0.2), st.floats(0.5, 1.2))
def test_a_point_of_the_plane_is_the_same_through_both_cameras(roll, yaw, x, z):
    view = camera(roll, yaw=yaw)
    other = canonical_view(view)
    ahead = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    place = view.eye[[0, 2]] + np.array([x, z]) @ ahead
    point = np.array([place[0], 0.0, place[1]])
    pixel, there = view.pixels(point), other.pixels(point)
    moved = homography(view, other) @ [*pixel, 1.0]
    np.testing.assert_allclose(moved[:2] / moved[2], there, atol=1e-6)
    np.testing.assert_allclose(on_plane(other, there), place, atol=1e-9)
    np.testing.assert_allclose(on_plane(view, pixel), place, atol=1e-9)


def test_azimuth_is_the_heading_of_what_stands_to_the_right():
    view = camera()
    assert azimuth(view, view.eye[[0, 2]] + [1.0, 0.0]) == pytest.approx(np.pi / 2)
    assert azimuth(view, view.eye[[0, 2]] + [0.0, 2.0]) == pytest.approx(0.0)


def test_what_lies_above_the_horizon_is_nowhere_on_the_plane():
    level = View(HOLOLENS_2, np.array([0.0, 0.5, 0.0]))
    assert np.isnan(on_plane(level, np.array([320.0, 10.0]))).all()


@pytest.mark.parametrize("roll", [0.0, 0.25])
@pytest.mark.parametrize(("width", "height"), [(640, 360), (1280, 720), (320, 180), (640, 480), (360, 640)])
def test_a_mark_in_an_image_is_found_where_it_belongs(width, height, roll):
    view = camera(roll, Intrinsics.of_view(width, height, 1.129))
    image = np.zeros((height, width, 3), np.uint8)
    mark = np.array([0.55 * width, 0.45 * height])
    cv2.circle(image, np.rint(mark).astype(int).tolist(), max(width // 60, 3), (255, 255, 255), -1)
    canonical = canonical_view(view)
    bright = canonical_image(image, view, canonical)[..., 0] > 128
    row, column = np.argwhere(bright).mean(axis=0)
    moved = homography(view, canonical) @ [*np.rint(mark), 1.0]
    np.testing.assert_allclose([column, row], moved[:2] / moved[2], atol=0.5)


def test_the_headsets_image_fills_the_canonical_one_but_for_a_few_rows():
    view = camera()
    white = np.full((360, 640, 3), 255, np.uint8)
    rows = canonical_image(white, view, canonical_view(view))[:, WIDTH // 2, 0]
    assert (rows[8:-8] == 255).all()
    assert (rows[:5] < 255).all()
    assert canonical_view(view).intrinsics.fx == pytest.approx(HOLOLENS_2.fx / 2)
    assert len(rows) == HEIGHT


def test_a_wide_image_is_made_smaller_and_kept_whole():
    view = camera(lens=Intrinsics.of_view(800, 450, 1.6))
    canonical = canonical_view(view)
    corners = np.array([[0, 0, 1.0], [799, 449, 1.0]]) @ homography(view, canonical).T
    corners = corners[:, :2] / corners[:, 2:]
    assert (corners > -5).all()
    assert (corners < [WIDTH + 5, HEIGHT + 5]).all()
