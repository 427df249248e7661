"""The network: convolutions down to a sixteenth and up to a quarter of the image, and a head."""

from __future__ import annotations

import torch
from torch import nn

from farm_ar.vision.heads import REGRESSED

CHANNELS = (24, 48, 64, 88)
"""At a half, a quarter, an eighth and a sixteenth of the image."""


class Network(nn.Module):
    """From images (B, 3, H, W), 0 to 1, to heat of categories and what else `heads` names, (B, C, H/4, W/4).

    Args:
        categories: how many there are.
        channels: at each level.
    """

    def __init__(self, categories: int, channels: tuple[int, int, int, int] = CHANNELS) -> None:
        super().__init__()
        half, quarter, eighth, sixteenth = channels
        self.stem = nn.Sequential(_conv(3, half, 2), _conv(half, quarter, 2), _Block(quarter))
        self.eighth = nn.Sequential(_conv(quarter, eighth, 2), _Block(eighth), _Block(eighth))
        self.sixteenth = nn.Sequential(_conv(eighth, sixteenth, 2), _Block(sixteenth), _Block(sixteenth, 2))
        self.up_eighth = nn.Conv2d(sixteenth, eighth, 1)
        self.mix_eighth = _conv(eighth, eighth)
        self.up_quarter = nn.Conv2d(eighth, quarter, 1)
        self.mix_quarter = _Block(quarter)
        self.head = nn.Sequential(_conv(quarter, eighth), nn.Conv2d(eighth, categories + REGRESSED, 1))
        last = self.head[1]
        assert isinstance(last, nn.Conv2d)
        assert last.bias is not None
        nn.init.zeros_(last.bias)
        nn.init.constant_(last.bias[:categories], -4.0)

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        """The output of a batch."""
        quarter = self.stem(4 * image - 2)
        eighth = self.eighth(quarter)
        sixteenth = self.sixteenth(eighth)
        eighth = self.mix_eighth(eighth + _doubled(self.up_eighth(sixteenth)))
        quarter = self.mix_quarter(quarter + _doubled(self.up_quarter(eighth)))
        found: torch.Tensor = self.head(quarter)
        return found


class _Block(nn.Module):
    """Two convolutions whose result is added."""

    def __init__(self, channels: int, reach: int = 1) -> None:
        super().__init__()
        self.first = _conv(channels, channels, reach=reach)
        self.second = nn.Sequential(
            nn.Conv2d(channels, channels, 3, padding=1, bias=False), nn.BatchNorm2d(channels)
        )

    def forward(self, value: torch.Tensor) -> torch.Tensor:
        return torch.relu(value + self.second(self.first(value)))


def _conv(incoming: int, outgoing: int, stride: int = 1, reach: int = 1) -> nn.Sequential:
    conv = nn.Conv2d(incoming, outgoing, 3, stride, padding=reach, dilation=reach, bias=False)
    return nn.Sequential(conv, nn.BatchNorm2d(outgoing), nn.ReLU(inplace=True))


def _doubled(value: torch.Tensor) -> torch.Tensor:
    return nn.functional.interpolate(value, scale_factor=2.0, mode="nearest")
