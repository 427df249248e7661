"""Streams of random numbers in kernels give the bits of NumPy's generators."""

import numpy as np
import pytest
from hypothesis import settings

from farm_ar.envs.batched import streams
from farm_ar.envs.batched.numpy_functions import DATA, arctan2, room_for_call

COUNT = 4000 * settings().max_examples


def pair(seed):
    generator = np.random.default_rng(seed)
    return generator, streams.streams_of([generator])


@pytest.mark.parametrize("seed", [0, 2**64 - 1, 123456789])
def test_a_stream_gives_what_the_generator_gives(seed):
    generator, stream = pair(seed)
    numbers = np.empty(COUNT)
    streams.fill_uniform(stream[0], numbers)
    np.testing.assert_array_equal(numbers, generator.random(COUNT))
    streams.fill_normal(stream[0], numbers)  # so many that the ziggurat's tail is met
    np.testing.assert_array_equal(numbers, generator.normal(size=COUNT))
    assert np.abs(numbers).max() > 3.6541528853610088


def test_normal_numbers_drawn_at_once_are_those_drawn_one_by_one():
    generator, stream = pair(8)
    for count in (7, 50):
        numbers = np.empty((COUNT // 200, 6, 3))
        streams.draw_normals(stream[0], numbers, count)
        np.testing.assert_array_equal(numbers, generator.normal(size=(len(numbers), count, 3))[:, :6])
    assert streams.uniform(stream[0]) == generator.random()


def test_whole_numbers_and_orders_use_up_halves_of_words_alike(rng):
    generator, stream = pair(3)
    for count in rng.integers(1, 2**31, size=2000) % np.exp2(rng.integers(1, 31, size=2000)).astype(int) + 1:
        assert streams.below(stream[0], int(count)) == generator.integers(count)
        values = np.arange(count % 13)
        streams.shuffle(stream[0], values)
        np.testing.assert_array_equal(values, generator.permutation(np.arange(count % 13)))
        assert streams.uniform(stream[0]) == generator.random()
    assert streams.as_generator(stream[0]).bit_generator.state == generator.bit_generator.state


def test_a_generator_that_holds_half_a_word_goes_on_with_it():
    generator = np.random.default_rng(5)
    generator.integers(7)
    stream = streams.streams_of([generator])
    assert generator.bit_generator.state["has_uint32"] == 1
    again = streams.as_generator(stream[0])
    assert again.bit_generator.state == generator.bit_generator.state
    assert streams.below(stream[0], 1000) == generator.integers(1000)


def test_the_arctangent_is_numpys_to_the_last_bit(rng):
    points = np.concatenate(
        [rng.normal(size=(3000, 2)), [[0, 0], [0, -1], [-0.0, -1], [1, 0], [1e-300, 1e300]]]
    )
    work = room_for_call()
    own = [arctan2(y, x, *work, DATA) for y, x in points.tolist()]
    np.testing.assert_array_equal(own, [float(np.arctan2(y, x)) for y, x in points.tolist()])
