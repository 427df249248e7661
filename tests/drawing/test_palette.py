import itertools

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from farm_ar.arrays import FloatArray
from farm_ar.drawing.palette import CATEGORY_COLORS, INK, category_fills

# Machado, Oliveira and Fernandes, 2009, severity 1, on linear RGB.
VISION = {
    "normal": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}


def linear(color: str) -> FloatArray:
    value = np.array(to_rgb(color))
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def oklab(rgb: FloatArray) -> FloatArray:
    """Ottosson, 2020."""
    cones = np.array(
        [
            [0.4122214708, 0.5363325363, 0.0514459929],
            [0.2119034982, 0.6806995451, 0.1073969566],
            [0.0883024619, 0.2817188376, 0.6299787005],
        ]
    )
    opponents = np.array(
        [
            [0.2104542553, 0.7936177850, -0.0040720468],
            [1.9779984951, -2.4285922050, 0.4505937099],
            [0.0259040371, 0.7827717662, -0.8086757660],
        ]
    )
    return opponents @ np.cbrt(cones @ rgb)


@pytest.mark.parametrize("vision", VISION)
def test_fills_stay_apart_for_every_kind_of_colour_vision(vision: str) -> None:
    seen = [oklab(np.clip(VISION[vision] @ linear(color), 0, 1)) for color in (*CATEGORY_COLORS, "#ffffff")]
    # About 0.02 is a just noticeable difference.
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > 0.06


def test_letters_can_be_read_on_every_fill() -> None:
    def luminance(color: str) -> float:
        return float(linear(color) @ [0.2126, 0.7152, 0.0722])

    for color in CATEGORY_COLORS:
        assert (luminance(color) + 0.05) / (luminance(INK) + 0.05) > 3.5


def test_a_fill_depends_on_the_sorted_order_of_the_categories_alone() -> None:
    fills = category_fills(["table", "chair", "sofa", "chair"])
    assert fills == category_fills(["sofa", "table", "chair"])
    assert [fills[name].color for name in ("chair", "sofa", "table")] == list(CATEGORY_COLORS[:3])


def test_many_categories_have_fills_of_their_own() -> None:
    assert len(set(category_fills(f"c{i}" for i in range(48)).values())) == 48
