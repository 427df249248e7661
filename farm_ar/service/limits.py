"""What the service takes at most."""

from __future__ import annotations

from dataclasses import dataclass, fields

from farm_ar.errors import OptionError


@dataclass(frozen=True)
class ServiceLimits:
    """What the service takes at most; what is beyond is refused at once.

    Args:
        most_bytes: of a request's body.
        most_image_bytes: of a body with an image.
        most_pixels: of an image.
        most_objects: in a layout.
        most_detections: in a snapshot, of all where several are fused.
        most_fused: snapshots that are fused.
        most_sessions: kept.
        most_waiting: requests that wait for one session.
        most_requests: under way at once.
        most_listeners: of one session, on WebSockets.
        body_s: seconds for a body to arrive.
        answer_s: seconds after which a request is answered with "come again".

    Raises:
        OptionError: one is not positive.
    """

    most_bytes: int = 4 * 2**20
    most_image_bytes: int = 16 * 2**20
    most_pixels: int = 2**24
    most_objects: int = 2000
    most_detections: int = 500
    most_fused: int = 32
    most_sessions: int = 1000
    most_waiting: int = 16
    most_requests: int = 256
    most_listeners: int = 64
    body_s: float = 10.0
    answer_s: float = 30.0

    def __post_init__(self) -> None:
        for one in fields(self):
            if not getattr(self, one.name) > 0:
                raise OptionError(one.name, "must be positive", getattr(self, one.name))
