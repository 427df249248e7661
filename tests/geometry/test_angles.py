import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.geometry import direction, heading, wrap
from farm_ar.geometry.angles import wrap_angle

angles = st.floats(-1000, 1000)


@given(angles)
def test_wrapping_gives_the_same_direction_in_the_half_open_turn(angle: float) -> None:
    wrapped = float(wrap(angle))
    assert -math.pi <= wrapped < math.pi
    assert math.remainder(wrapped - angle, math.tau) == pytest.approx(0, abs=1e-12)


@given(st.floats(-math.pi, math.pi, exclude_max=True))
def test_an_angle_in_the_turn_is_left_exactly_as_it_is(angle: float) -> None:
    assert float(wrap(angle)) == angle


@given(angles | st.floats(allow_nan=False, allow_infinity=False))
def test_kernels_wrap_to_the_same_bits(angle: float) -> None:
    for one in (wrap_angle, wrap_angle.py_func):  # type: ignore[attr-defined]
        assert float(one(angle)) == float(wrap(angle))


@pytest.mark.parametrize(
    ("angle", "expected"),
    [
        (math.pi, -math.pi),
        (-math.pi, -math.pi),
        (3 * math.pi, -math.pi),
        (math.tau, 0.0),
        (1.5 * math.pi, -0.5 * math.pi),
        (math.nextafter(math.pi, 0), math.nextafter(math.pi, 0)),
        (math.nextafter(-math.pi, -4), math.nextafter(math.pi, 0)),
    ],
)
def test_the_seam_belongs_to_minus_pi(angle: float, expected: float) -> None:
    assert float(wrap(angle)) == pytest.approx(expected, abs=1e-15)
    assert float(wrap(angle)) < math.pi


@pytest.mark.parametrize(
    ("x", "z", "yaw_deg"),
    [(0, 1, 0), (1, 1, 45), (1, 0, 90), (-1, 0, -90), (1, -1, 135), (-1, -1, -135), (0, 0, 0)],
)
def test_heading_turns_clockwise_from_forward(x: float, z: float, yaw_deg: float) -> None:
    assert np.rad2deg(heading(np.array([x, z]))) == pytest.approx(yaw_deg)


@given(st.floats(-3.1, 3.1), st.floats(0.01, 100))
def test_heading_undoes_direction_at_any_length(yaw: float, length: float) -> None:
    assert float(heading(length * direction(yaw))) == pytest.approx(yaw, abs=1e-9)


def test_batch_dimensions_come_first() -> None:
    yaw = np.linspace(-3, 3, 6).reshape(2, 3)
    assert direction(yaw).shape == (2, 3, 2)
    np.testing.assert_allclose(heading(direction(yaw)), yaw)
    np.testing.assert_allclose(wrap(yaw + 4 * np.pi), yaw)
