"""How a layout gets untidy."""

import numpy as np
import pytest

from farm_ar.errors import OptionError
from farm_ar.scenes import Gaussian, Layout, LayoutNoise

ROOM = (10.0, 6.0)
LAYOUT = Layout(
    ("a", "b", "shed"),
    ("chair", "chair", "shed"),
    [(5, 3), (4, 2), (9, 5)],
    [0.5, -1, 2],
    np.ones((3, 3)),
    [0, 0.1, 0.2],
    [False, False, True],
)
MANY = (20_000,)


def test_without_noise_nothing_moves(rng):
    left = LayoutNoise().disturb(LAYOUT, ROOM, rng)
    np.testing.assert_array_equal(left.position, LAYOUT.position)
    np.testing.assert_array_equal(left.yaw, LAYOUT.yaw)


def test_translation_has_the_mean_and_the_sd_asked_for_in_x_and_z_independently(rng):
    left = LayoutNoise(translation=Gaussian(0.2, 0.3)).disturb(LAYOUT, ROOM, rng, MANY)
    shift = (left.position - LAYOUT.position)[:, :2].reshape(-1, 4)
    np.testing.assert_allclose(shift.mean(axis=0), 0.2, atol=4 * 0.3 / np.sqrt(MANY[0]))
    np.testing.assert_allclose(shift.std(axis=0), 0.3, rtol=4 / np.sqrt(2 * MANY[0]))
    correlation = np.corrcoef(shift.T) - np.eye(4)
    np.testing.assert_allclose(correlation, 0, atol=4 / np.sqrt(MANY[0]))
    np.testing.assert_array_equal(left.yaw, np.broadcast_to(LAYOUT.yaw, left.yaw.shape))


def test_rotation_has_the_mean_and_the_sd_asked_for(rng):
    left = LayoutNoise(rotation=Gaussian(-0.1, 0.5)).disturb(LAYOUT, ROOM, rng, MANY)
    turn = (left.yaw - LAYOUT.yaw)[:, :2]
    np.testing.assert_allclose(turn.mean(axis=0), -0.1, atol=4 * 0.5 / np.sqrt(MANY[0]))
    np.testing.assert_allclose(turn.std(axis=0), 0.5, rtol=4 / np.sqrt(2 * MANY[0]))
    np.testing.assert_array_equal(left.position, np.broadcast_to(LAYOUT.position, left.position.shape))


def test_the_papers_notation_is_metres_and_degrees():
    noise = LayoutNoise.of(0.3, 90)
    assert noise == LayoutNoise(Gaussian(0, 0.3), Gaussian(0, np.pi / 2))


def test_nothing_leaves_the_room_and_what_would_stops_at_the_wall(rng):
    left = LayoutNoise(translation=Gaussian(0, 5)).disturb(LAYOUT, ROOM, rng, (2000,))
    x, z = left.position[..., :2, 0], left.position[..., :2, 1]
    assert (x.min(), x.max(), z.min(), z.max()) == (0, 10, 0, 6)
    # P(5 + N(0, 5) < 0) = P(N < -1) = 0.159
    assert np.mean(left.position[:, 0, 0] == 0) == pytest.approx(0.159, abs=0.03)


def test_a_place_without_walls_stops_nothing(rng):
    left = LayoutNoise(translation=Gaussian(-50, 1)).disturb(LAYOUT, None, rng)
    assert (left.position[LAYOUT.movable] < -40).all()


def test_what_is_added_to_a_heading_is_kept_within_a_full_turn_either_way(rng):
    left = LayoutNoise(rotation=Gaussian(0, 20)).disturb(LAYOUT, ROOM, rng, (2000,))
    turn = (left.yaw - LAYOUT.yaw)[:, :2]
    assert turn.min() == pytest.approx(-2 * np.pi)
    assert turn.max() == pytest.approx(2 * np.pi)
    assert np.mean(np.abs(turn) < 6.28) > 0.2


def test_fixed_objects_do_not_move(rng):
    left = LayoutNoise.of(2, 90).disturb(LAYOUT, ROOM, rng, (50,))
    assert (left.position[:, 2] == LAYOUT.position[2]).all()
    assert (left.yaw[:, 2] == LAYOUT.yaw[2]).all()
    assert (left.position[:, :2] != LAYOUT.position[:2]).any(axis=-1).all()


def test_a_fixed_object_outside_the_room_stays_there(rng):
    layout = LAYOUT.with_poses([(5, 3), (4, 2), (12, -1)], LAYOUT.yaw)
    assert LayoutNoise.of(1, 1).disturb(layout, ROOM, rng).position[2].tolist() == [12, -1]


def test_fixing_an_object_does_not_change_what_happens_to_the_others():
    free = Layout(LAYOUT.labels, LAYOUT.category, LAYOUT.position, LAYOUT.yaw, LAYOUT.size)
    noise = LayoutNoise.of(0.3, 30)
    one = noise.disturb(LAYOUT, ROOM, np.random.default_rng(1))
    other = noise.disturb(free, ROOM, np.random.default_rng(1))
    np.testing.assert_array_equal(one.position[:2], other.position[:2])
    np.testing.assert_array_equal(one.yaw[:2], other.yaw[:2])


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not():
    def left(seed: int) -> bytes:
        layout = LayoutNoise.of(0.3, 30).disturb(LAYOUT, ROOM, np.random.default_rng(seed), (7,))
        return layout.position.tobytes() + layout.yaw.tobytes()

    assert left(1) == left(1)
    assert left(1) != left(2)


@pytest.mark.parametrize(
    ("of_layout", "asked", "expected"),
    [((), (), ()), ((), (4, 2), (4, 2)), ((5,), (), (5,)), ((5,), (3, 1), (3, 5)), ((5,), (0, 1), (0, 5))],
)
def test_the_batch_is_what_was_asked_for_broadcast_with_the_layouts_own(rng, of_layout, asked, expected):
    layout = LAYOUT.with_poses(np.ones((*of_layout, 3, 2)), np.ones((*of_layout, 3)))
    left = LayoutNoise.of(0.1, 10).disturb(layout, ROOM, rng, asked)
    assert left.batch_shape == expected
    assert left.position.shape == (*expected, 3, 2)
    assert (left.labels, left.category) == (LAYOUT.labels, LAYOUT.category)
    np.testing.assert_array_equal(left.elevation, LAYOUT.elevation)


def test_no_two_layouts_of_a_batch_are_the_same(rng):
    left = LayoutNoise.of(0.1, 10).disturb(LAYOUT, ROOM, rng, (20,))
    assert len({layout.tobytes() for layout in left.position[:, :2]}) == 20


def test_a_layout_without_objects_can_be_disturbed(rng):
    left = LayoutNoise.of(0.1, 10).disturb(Layout((), (), [], [], []), ROOM, rng, (3,))
    assert left.position.shape == (3, 0, 2)


@pytest.mark.parametrize(
    ("mean", "sd", "message"),
    [
        (np.nan, 0, "mean: must be finite, got nan"),
        (np.inf, 0, "mean: must be finite, got inf"),
        (0, -0.1, "sd: must be a number not below 0, got -0.1"),
        (0, np.nan, "sd: must be a number not below 0, got nan"),
        (0, np.inf, "sd: must be a number not below 0, got inf"),
    ],
)
def test_a_distribution_that_cannot_be_is_refused(mean, sd, message):
    with pytest.raises(OptionError, match=message):
        Gaussian(mean, sd)
