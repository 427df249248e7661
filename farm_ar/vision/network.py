"""The trained network as it is used: read from ONNX and run by OpenCV."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.errors import OptionError, escaped
from farm_ar.vision.base import Image
from farm_ar.vision.canonical import HEIGHT, WIDTH

SHIPPED = Path(__file__).parent / "models" / "farm.onnx"
"""The network of the farm's buildings."""


class PoseNetwork:
    """A network from its file.

    Args:
        path: of the file *.onnx; *.json stands beside it.

    Raises:
        OptionError: there are no such files, or they are not of a network that was trained here.
    """

    def __init__(self, path: str | Path = SHIPPED) -> None:
        path = Path(path)
        source = escaped(str(path))
        beside = path.with_suffix(".json")
        if not (path.is_file() and beside.is_file()):
            expected = "must be a file *.onnx with *.json beside it, as farm-ar vision train makes them"
            raise OptionError("model", expected, source)
        try:
            known: dict[str, Any] = json.loads(beside.read_text())
            self.sizes = {str(name): np.array(size, float) for name, size in known["categories"].items()}
            self.calibration: dict[str, Any] = known.get("calibration", {})
            self._net = cv2.dnn.readNetFromONNX(np.frombuffer(path.read_bytes(), np.uint8))
        except (ValueError, KeyError, TypeError, AttributeError, cv2.error) as problem:
            expected = "must be of a network that farm-ar vision train made"
            raise OptionError("model", expected, f"{type(problem).__name__}", source) from None
        self.names = tuple(self.sizes)

    def __call__(self, image: Image) -> npt.NDArray[np.float32]:
        """The output (C, h, w) for a canonical image."""
        if image.shape != (HEIGHT, WIDTH, 3):
            raise ValueError(f"must be ({HEIGHT}, {WIDTH}, 3), got {image.shape}")
        self._net.setInput(cv2.dnn.blobFromImage(image, 1 / 255))
        return np.asarray(self._net.forward()[0], np.float32)


@lru_cache(maxsize=8)
def network_of(path: str) -> PoseNetwork:
    """A network, read once."""
    return PoseNetwork(path)
