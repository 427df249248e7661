"""Whether a re-identifier keeps its contract."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from farm_ar.reid import Identification, Reidentifier
from farm_ar.scenes import (
    PERFECT,
    Camera,
    Detections,
    Detector,
    FieldOfView,
    LayoutNoise,
    Scene,
    Snapshot,
    builtin_scene,
    observe,
)
from farm_ar.testing.comparison import attempt, require

MakeReid = Callable[[Scene], Reidentifier]

SCENES = ("farm", "L1", "M2")
"""The built-in scenes on which a re-identifier is tried by default."""


def check_reidentifier(
    make_reid: MakeReid,
    scenes: Sequence[str | Scene] = SCENES,
    *,
    allow_repeats: bool = False,
    seed: int = 0,
) -> None:
    """Run every check on a re-identifier.

    It must answer any snapshot of its scene: of untouched objects and of disturbed ones, with noise, misses
    and false detections, empty, with more detections than labels, with categories that are not known. Every
    detection gets one entry, a label of the scene or None; no label is given twice; where there is no label
    there is no cost, and where there is one there is; reasons, if any, are text; and the same question gets
    the same answer, from another instance too.

    Args:
        make_reid: makes it for a scene, whose layout is what was last known.
        scenes: scenes, or names of built-in ones.
        allow_repeats: whether a label may be given to several detections.
        seed: of all randomness.

    Raises:
        AssertionError: what broke.
    """
    for one in scenes:
        scene = builtin_scene(one) if isinstance(one, str) else one
        reid = _made(make_reid, scene)
        require(isinstance(reid, Reidentifier), f"{scene.name}: there is no method identify(snapshot)")
        for kind, snapshot in snapshots_of(scene, np.random.default_rng(seed)):
            what = f"{scene.name}, {kind}"
            answer = _answer(reid, snapshot, what)
            _check_answer(answer, snapshot, scene, allow_repeats, what)
            for whose, other in (("second", reid), ("another instance's", _made(make_reid, scene))):
                same = _same(answer, _answer(other, snapshot, what))
                require(same, f"{what}: the {whose} answer differs from the first")


def snapshots_of(scene: Scene, rng: np.random.Generator) -> Iterator[tuple[str, Snapshot]]:
    """Snapshots of many kinds, each with the name of its kind."""
    layout, camera = scene.layout, _camera(scene, rng)
    everywhere = replace(camera, fov=FieldOfView(np.pi, np.pi, 10 * scene.diagonal))
    metres = 0.05 * scene.diagonal
    moved = LayoutNoise.of(translation_sd=metres, rotation_sd_deg=20).disturb(layout, scene.room, rng)
    noisy = Detector(
        position_sd=metres / 5, yaw_sd=0.1, size_sd=0.05, miss_rate=0.2, false_rate=1.0, unknown_rate=0.2
    )
    yield "nothing moved", observe(layout, camera, PERFECT)[0]
    yield "everything in view", observe(moved, everywhere, PERFECT)[0]
    for _ in range(3):
        yield "things moved, with noise", observe(moved, _camera(scene, rng), noisy, rng)[0]
    full = observe(moved, everywhere, PERFECT)[0]
    yield "nothing in view", Snapshot(camera, _some(full.detections, np.zeros(0, dtype=np.int64)))
    twice = np.repeat(np.arange(len(layout)), 2)
    yield "more detections than labels", Snapshot(camera, _some(full.detections, twice))
    unknown = replace(full.detections, category=(None,) * len(layout))
    yield "no category known", Snapshot(camera, unknown)
    nothing = np.full(len(layout), np.nan)
    blind = replace(full.detections, yaw=nothing, size=np.tile(nothing[:, None], 3))
    yield "no heading or size known", Snapshot(camera, blind)


def _camera(scene: Scene, rng: np.random.Generator) -> Camera:
    """A camera that looks at the middle of the place from somewhere around it."""
    points = scene.layout.position if scene.bounds is None else scene.bounds.corners
    angle = rng.uniform(-np.pi, np.pi)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    back = scene.diagonal / 2 * np.array([np.sin(angle), np.cos(angle)])
    return Camera(middle - back, np.asarray(angle), scene.fov)


def _some(detections: Detections, index: np.typing.NDArray[np.int64]) -> Detections:
    return Detections(
        category=tuple(detections.category[i] for i in index),
        position=detections.position[index],
        yaw=detections.yaw[index],
        size=detections.size[index],
        elevation=detections.elevation[index],
    )


def _made(make_reid: MakeReid, scene: Scene) -> Reidentifier:
    with attempt(f"{scene.name}: making it for the scene"):
        return make_reid(scene)


def _answer(reid: Reidentifier, snapshot: Snapshot, what: str) -> Identification:
    with attempt(f"{what}: identify"):
        return reid.identify(snapshot)


def _check_answer(
    answer: Identification, snapshot: Snapshot, scene: Scene, allow_repeats: bool, what: str
) -> None:
    right_type = isinstance(answer, Identification)
    require(right_type, f"{what}: the answer must be an Identification, is {type(answer).__name__}")
    n, given = len(snapshot.detections), [label for label in answer.labels if label is not None]
    entries = len(answer.labels)
    require(entries == n, f"{what}: there must be one entry for each of {n} detections, there are {entries}")
    strange = sorted(set(given) - set(scene.layout.labels))
    require(not strange, f"{what}: labels that the scene does not have: {', '.join(map(str, strange))}")
    twice = sorted({label for label in given if given.count(label) > 1})
    require(allow_repeats or not twice, f"{what}: labels given to several detections: {', '.join(twice)}")
    for k, (label, cost) in enumerate(zip(answer.labels, answer.cost, strict=True)):
        costless = label is None and not np.isnan(cost)
        require(not costless, f"{what}: detection {k} has no label but a cost of {cost}")
        require(not np.isinf(cost), f"{what}: detection {k} has an infinite cost")
        priceless = label is not None and np.isnan(cost)
        require(not priceless, f"{what}: detection {k} has a label but no cost")
    for k, reason in enumerate(answer.reason):
        words = reason is None or (isinstance(reason, str) and reason.strip() != "")
        require(words, f"{what}: the reason of detection {k} must be text or None, is {reason!r}")


def _same(first: Identification, second: Identification) -> bool:
    return first.labels == second.labels and first.cost.tobytes() == second.cost.tobytes()
