"""What the service takes at most."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, fields

from farm_ar.errors import OptionError
from farm_ar.scenes.documents import NOTES
from farm_ar.service.refusals import TOO_LARGE, RefusedError


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
        most_text: characters of a string: a label, a category, an id, a name.
        most_history: decisions of a session that can be undone; older ones are final.
        most_sessions: kept.
        most_waiting: requests that wait for one session.
        most_requests: under way at once.
        most_connections: open at once; on those beyond it one request is answered, with "come again".
        most_listeners: of one session, on WebSockets.
        body_s: seconds for a body to arrive.
        answer_s: seconds after which a request is answered with "come again".

    Raises:
        OptionError: one is not positive, or counts something and is no whole number.
    """

    most_bytes: int = 4 * 2**20
    most_image_bytes: int = 16 * 2**20
    most_pixels: int = 2**24
    most_objects: int = 2000
    most_detections: int = 500
    most_fused: int = 32
    most_text: int = 256
    most_history: int = 50
    most_sessions: int = 1000
    most_waiting: int = 16
    most_requests: int = 256
    most_connections: int = 512
    most_listeners: int = 64
    body_s: float = 10.0
    answer_s: float = 30.0

    def __post_init__(self) -> None:
        for one in fields(self):
            value, counts = getattr(self, one.name), one.type == "int"
            right = isinstance(value, int if counts else int | float) and not isinstance(value, bool)
            if not right or not value > 0:
                expected = "must be positive" + (" and a whole number" * counts)
                raise OptionError(one.name, expected, value)


def check_texts(body: bytes, data: Mapping[str, object], most: int) -> None:
    """See that no string in a body is too long; notes for people may be, which nobody reads.

    Args:
        body: JSON.
        data: what it holds.
        most: characters.

    Raises:
        RefusedError: one is, or the name of a field.
    """
    if b"\\" not in body and max(map(len, body.split(b'"'))) <= most:
        return
    waiting = deque[tuple[str, object]]((name, data[name]) for name in data if name not in NOTES)
    _check_names("body", data, most)
    while waiting:
        place, value = waiting.popleft()
        if isinstance(value, str):
            if len(value) > most:
                expected = f"must be at most {most} characters, not {len(value)}"
                raise RefusedError(TOO_LARGE, place, expected, value)
        elif isinstance(value, dict):
            _check_names(place, value, most)
            waiting.extend((f"{place}.{name}", one) for name, one in value.items())
        elif isinstance(value, list):
            some = ((i, one) for i, one in enumerate(value) if isinstance(one, str | dict | list))
            waiting.extend((f"{place}[{i}]", one) for i, one in some)


def _check_names(place: str, value: Mapping[str, object], most: int) -> None:
    for name in value:
        if len(name) > most:
            expected = f"must have names of at most {most} characters, not {len(name)}"
            raise RefusedError(TOO_LARGE, place, expected, name)
