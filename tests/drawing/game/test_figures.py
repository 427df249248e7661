"""The headset's animals: models, seen from where the eye is."""

import numpy as np
import pytest

from farm_ar.drawing.game.atlas import Atlas
from farm_ar.drawing.game.figures import TILTS, animal, directions
from farm_ar.drawing.game.pinhole import Pinhole, upright_scale
from farm_ar.rendering import model
from farm_ar.scenes.builtin import FACING_S1

GREEN = (34, 160, 62)


def shown(sprite):
    """(h, w) opacity, 0 to 1."""
    return sprite.pixels[..., 3] / 255


def test_a_figure_is_as_large_as_its_model_and_stands_on_its_foot():
    for kind in ("chicken", "bunny"):
        figure = animal(kind, GREEN)[0]  # from the side: its height is the model's
        sprite = figure.sprite(1000.0, 90.0, 0, 0)
        tall = 1000.0 * figure.mesh.bounds[1, 1]
        assert figure.mesh.bounds[1, 1] > model(kind).bounds[1, 1]
        assert shown(sprite).sum(axis=0).max() <= tall + 4
        assert len(sprite.pixels) == pytest.approx(tall, abs=5)
        assert sprite.top + len(sprite.pixels) == pytest.approx(0, abs=3)


def test_what_turns_right_is_the_mirror_of_what_turns_left_and_its_beak_is_ahead():
    side = animal("chicken", GREEN)[2]
    right, left = side.sprite(900.0, 90.0, 0, 0), side.sprite(900.0, 270.0, 0, 0)
    ahead, back = side.sprite(900.0, 0.0, 0, 0), side.sprite(900.0, 180.0, 0, 0)
    beak = np.array([240, 170, 40])

    def yellow(sprite):
        near = np.abs(sprite.pixels[..., :3].astype(int) - beak * 0.9).max(axis=-1) < 50
        rows, columns = np.nonzero(near & (sprite.pixels[..., 3] > 200))
        high = rows < 0.5 * len(sprite.pixels)  # the legs are yellow, too
        return columns[high] + sprite.left

    assert yellow(right).mean() > 5
    assert yellow(left).mean() < -5
    assert len(yellow(back)) > len(
        yellow(ahead)
    )  # heading 180 degrees away from the eye's ray: it faces the eye


def test_the_coat_has_the_labels_colour():
    pixels = animal("bunny", GREEN)[3].sprite(800.0, 45.0, 1, 0).pixels
    inside = pixels[pixels[..., 3] == 255][:, :3].astype(int)
    greener = (inside[:, 1] > 1.5 * inside[:, 0]) & (inside[:, 1] > 1.5 * inside[:, 2])
    assert greener.mean() > 0.5


def test_directions_follow_the_ray_from_the_eye():
    view = Pinhole.of(FACING_S1, 480, 480)
    eye, level = view.eye[[0, 2]], view.eye[1]
    ahead = np.array([np.sin(0.7), np.cos(0.7)])
    places = np.array([eye + level * ahead, eye + 1e-3 * ahead, eye + 50.0 * ahead])
    tilt, turn = directions(view, places, np.array([0.7, 0.9, 0.7 + np.pi]))
    assert tilt.tolist() == [4, TILTS - 1, 0]  # 45 degrees rounds to 40: halves go to the even step
    np.testing.assert_allclose(turn, [0.0, 0.2, np.pi], atol=1e-9)


def test_the_atlas_turns_figures_and_leaves_drawings_upright():
    atlas = Atlas(upright_scale)
    number = atlas.number(animal("chicken", GREEN)[3])
    images = []
    for yaw in (np.pi / 2, -np.pi / 2):
        image, away = np.zeros((80, 80, 3), np.uint8), np.full((80, 80), 9.0, np.float32)
        size = np.array([round(np.log(900.0) / np.log(1.03))])
        place = np.array([[40.0, 60.0]])
        atlas.paste_in_space(
            image, away, np.array([number]), place, size, np.array([1.0]), False, np.array([yaw])
        )
        images.append(image.astype(int))
    assert (images[0] != images[1]).any()
    columns = [np.nonzero(image.any(axis=(0, 2)))[0] - 40 for image in images]
    assert columns[0].max() == pytest.approx(-columns[1].min(), abs=2)
