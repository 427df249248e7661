"""The network as ONNX, and what its user has to know beside it."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import torch

from farm_ar.vision.canonical import HEIGHT, WIDTH
from farm_ar.vision.training.network import Network


def write_model(network: Network, out: Path, categories: dict[str, list[float]]) -> None:
    """Write `out` (*.onnx), and *.json beside it.

    Args:
        network: in evaluation mode.
        out: the file.
        categories: width, height, depth of each, in the order of the network's channels.
    """
    temporary = out.with_name(out.name + ".tmp")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            network,
            (torch.zeros(1, 3, HEIGHT, WIDTH),),
            str(temporary),
            input_names=["image"],
            output_names=["found"],
            dynamo=False,
        )
    temporary.replace(out)
    beside = out.with_suffix(".json")
    known = json.loads(beside.read_text()) if beside.exists() else {}
    beside.write_text(json.dumps(known | {"categories": categories}, indent=1) + "\n")
