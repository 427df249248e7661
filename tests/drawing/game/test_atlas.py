"""Many drawings at once, and drawings made into sprites."""

import cv2
import numpy as np
import pytest

from farm_ar.drawing.game import animals
from farm_ar.drawing.game.atlas import Atlas
from farm_ar.drawing.game.overlays import tint_area
from farm_ar.drawing.game.pixels import _mix, _mix_pixel, paste, paste_all, paste_in_space
from farm_ar.drawing.game.sprites import paste_art, sprite_of

RED, BLUE = (220, 40, 40), (40, 60, 220)
MEADOW = np.full((60, 80, 3), 120, np.uint8)


def meadow():
    return MEADOW.copy()


def atlas_of(*arts, largest=1 << 20):
    atlas = Atlas(lambda size: 400.0 + 100.0 * size, largest)
    return atlas, np.array([atlas.number(art) for art in arts])


def test_an_atlas_draws_what_its_drawings_one_by_one_would_be():
    arts = [animals.chicken(RED), animals.bunny(BLUE)]
    atlas, numbers = atlas_of(*arts)
    places, yaws = np.array([(20.3, 30.8), (26.6, 31.1), (78.0, 2.0)]), np.array([0.3, -2.0, 1.0])
    one_by_one, at_once = meadow(), meadow()
    for k, (x, y) in enumerate(places):
        paste_art(one_by_one, arts[k % 2], x, y, 500.0, yaws[k])
    atlas.paste(at_once, numbers[[0, 1, 0]], places, yaws, size=np.array([1, 1, 1]))
    assert np.array_equal(at_once, one_by_one)
    assert not np.array_equal(at_once, meadow())


def test_a_drawing_has_one_number_and_drawing_nothing_changes_nothing():
    atlas, numbers = atlas_of(animals.chicken(RED), animals.chicken(BLUE), animals.chicken(RED))
    assert numbers[0] == numbers[2] != numbers[1]
    image = meadow()
    none = np.zeros(0, np.int64)
    atlas.paste(image, none, np.zeros((0, 2)))
    atlas.paste_in_space(
        image, np.zeros((60, 80), np.float32), none, np.zeros((0, 2)), none, np.zeros(0), True
    )
    assert np.array_equal(image, meadow())


def test_an_atlas_that_has_forgotten_its_sprites_makes_them_again():
    rng = np.random.default_rng(0)
    forgetful, numbers = atlas_of(animals.chicken(RED), animals.bunny(BLUE), largest=3000)
    patient, _ = atlas_of(animals.chicken(RED), animals.bunny(BLUE))
    for _ in range(30):
        art, place, yaw = rng.choice(numbers, 20), rng.uniform(0, 60, (20, 2)), rng.uniform(-3, 3, 20)
        images = [meadow(), meadow()]
        for atlas, image in zip((forgetful, patient), images, strict=True):
            atlas.paste(image, art, place, yaw)
        assert np.array_equal(*images)


def sprites():
    """Two squares of 4 by 4, opaque red and half transparent blue, in one store."""
    red, blue = np.full((4, 4, 4), 255, np.uint8), np.full((4, 4, 4), 128, np.uint8)
    red[..., 1:3] = 0
    blue[..., :2] = 0
    return np.concatenate([red.reshape(-1), blue.reshape(-1)]), np.array([(0, 4, 4), (64, 4, 4)])


@pytest.mark.parametrize("run", [paste_all, paste_all.py_func])
def test_sprites_from_one_store_lie_one_over_the_other(run):
    store, shape = sprites()
    image, expected = meadow(), meadow()
    run(image, store, shape, np.array([(10, 10), (12, 11)]))
    for k, (left, top) in enumerate([(10, 10), (12, 11)]):
        paste(expected, store[64 * k : 64 * k + 64].reshape(4, 4, 4), left, top)
    assert np.array_equal(image, expected)
    assert image[11, 11].tolist() == [255, 0, 0]
    assert image[11, 12].tolist() == [127, 0, 128]


@pytest.mark.parametrize("run", [paste_in_space, paste_in_space.py_func])
def test_what_is_nearer_hides_a_sprite_and_a_solid_one_hides_what_comes_later(run):
    store, shape = sprites()
    image, away = meadow(), np.full((60, 80), np.inf, np.float32)
    away[:, 12:] = 1.0
    where, far, near = np.array([(10, 10)]), np.array([2.0], np.float32), np.array([1.5], np.float32)
    run(image, away, store, shape[:1], where, far, True)
    assert image[11, 11].tolist() == [255, 0, 0]
    assert image[11, 12].tolist() == [120, 120, 120]
    assert away[11, 11:13].tolist() == [2.0, 1.0]
    run(image, away, store, shape[1:], where, np.array([3.0], np.float32), False)
    assert image[11, 11].tolist() == [255, 0, 0]
    run(image, away, store, shape[1:], where, near, False)
    assert image[11, 11].tolist() == [127, 0, 128]
    assert away[11, 11] == 2.0
    run(image, away, store, shape[:1], np.array([(-2, 58)]), far, True)
    assert image[59, 0].tolist() == [255, 0, 0]


@pytest.mark.parametrize("run", [paste_in_space, paste_in_space.py_func])
@pytest.mark.parametrize(("distance", "shown"), [(0.999, True), (1.0, True), (1.001, False), (1.03, False)])
def test_a_millimetre_decides_what_is_nearer(run, distance, shown):
    store, shape = sprites()
    image, away = meadow(), np.full((60, 80), 1.0, np.float32)
    run(image, away, store, shape[:1], np.array([(10, 10)]), np.array([distance], np.float32), True)
    assert (image[11, 11].tolist() == [255, 0, 0]) is shown
    assert away[11, 11] == pytest.approx(min(distance, 1.0))


def test_what_is_drawn_as_a_sprite_looks_as_if_it_were_drawn_directly():
    def draw(image):
        cv2.line(image, (10, 10), (50, 40), RED, 3, cv2.LINE_AA)
        tint_area(image, np.array([(20.0, 5.0), (60.0, 5.0), (60.0, 50.0)]), BLUE, 0.4)

    direct, pasted = meadow(), meadow()
    draw(direct)
    sprite = sprite_of(draw, 80, 60)
    paste(pasted, sprite.pixels, sprite.left, sprite.top)
    assert np.abs(direct.astype(int) - pasted).max() <= 2
    assert sprite.pixels.shape[0] < 50
    assert sprite_of(lambda image: None, 80, 60).pixels.shape == (1, 1, 4)


@pytest.mark.parametrize("run", [_mix_pixel, _mix_pixel.py_func])
def test_a_pixel_is_mixed_by_its_opacity_rounded_to_the_nearest(run):
    for alpha in (0, 1, 100, 128, 254, 255):
        below, above = np.array([9, 0, 100, 255], np.uint8), np.array([0, alpha, alpha // 2, alpha], np.uint8)
        expected = [above[k] + round(int(below[k + 1]) * (255 - alpha) / 255) for k in range(3)]
        run(below, 1, above, 0)
        assert below.tolist() == [9, *(min(int(value), 255) for value in expected)]


@pytest.mark.parametrize("run", [_mix, _mix.py_func])
def test_a_colour_is_mixed_into_values_by_256ths(run):
    values = np.array([0, 100, 255], np.uint8)
    run(values, np.array([200 * 128] * 3, np.uint16), 128)
    assert values.tolist() == [100, 150, 227]
