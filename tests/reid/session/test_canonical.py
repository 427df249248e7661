"""What a session keeps of a snapshot is what comes back from a file, whether it was written there or not."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.reid.session.known import canonical, from_file
from farm_ar.scenes import Camera, Detections, FieldOfView, Snapshot
from farm_ar.scenes.uncertainty import Uncertainty
from farm_ar.scenes.worlds import World


def same(one: object, other: object) -> bool:
    """Whether two records have the same fields, arrays to the last bit."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return (one.shape, one.dtype, one.tobytes()) == (other.shape, other.dtype, other.tobytes())
    if hasattr(one, "__dataclass_fields__"):
        names = [field.name for field in fields(one)]  # type: ignore[arg-type]
        return type(one) is type(other) and all(same(getattr(one, n), getattr(other, n)) for n in names)
    return type(one) is type(other) and one == other


@given(
    seed=st.integers(0, 2**32 - 1),
    odd=st.sampled_from(["plain", "tilted", "broken", "unsure", "unknown", "empty"]),
)
def test_a_snapshot_is_kept_as_it_comes_back_from_a_file(seed: int, odd: str) -> None:
    rng = np.random.default_rng(seed)
    n = 0 if odd == "empty" else 3
    position, yaw = rng.normal(0, 10, (n, 2)), rng.uniform(-20, 20, n)
    broken = (None, "lost", None) if odd == "broken" else (None,) * n
    if odd == "broken":
        position[1] = np.nan
    seen = Detections(
        category=("chair", None, "table")[:n],
        position=position,
        yaw=np.where(rng.random(n) < 0.5, np.nan, yaw) if odd == "unknown" else yaw,
        size=np.full((n, 3), np.nan) if odd == "unknown" else rng.uniform(0.1, 1, (n, 3)),
        elevation=rng.normal(0, 1, n),
        confidence=rng.random(n),
        track_id=("a", None, "b")[:n],
        broken=broken,
        tilt=rng.normal(0, 0.2, (n, 2)) if odd == "tilted" else None,
        uncertainty=Uncertainty.unknown(n) if odd == "unsure" else None,
    )
    up = float(rng.uniform(0, 1))
    fov = FieldOfView(*rng.uniform(0, 3, 2), 4.0, *((up, 0.3) if rng.random() < 0.5 else (None, None)))
    height = np.asarray(1.6) if rng.random() < 0.5 else None
    camera = Camera(rng.normal(0, 5, 2), np.asarray(rng.uniform(-9, 9)), fov, height, np.asarray(0.1))
    one = Snapshot(camera, seen, 3.5, World(frame="ros"), ("range_m",))
    assert same(canonical(one), from_file(one))
