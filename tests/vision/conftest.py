"""What several tests of vision need: frames of the farm, and how what was found compares."""

import numpy as np
import pytest

from farm_ar.scenes import builtin_scene
from farm_ar.vision.network import SHIPPED
from farm_ar.vision.perception import PixelPerception


@pytest.fixture(scope="session")
def farm():
    return builtin_scene("farm")


@pytest.fixture(scope="session")
def pixels(farm):
    assert SHIPPED.is_file()
    return PixelPerception(farm)


def compared(perceived, truth):
    """Errors in metres and radians of what was found."""
    found, source = perceived.snapshot.detections, perceived.source
    right = source >= 0
    away = np.linalg.norm(found.position[right] - truth.position[source[right]], axis=1)
    turn = np.angle(np.exp(1j * (found.yaw[right] - truth.yaw[source[right]])))
    return away, np.abs(turn)
