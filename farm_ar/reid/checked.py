"""`identify`: one snapshot of one scene, checked before, with what cannot be identified set aside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import OptionError
from farm_ar.reid.alignment import Alignment, Pose, align, other_unit
from farm_ar.reid.answers import Assurance, Identification
from farm_ar.reid.base import Reidentifier, as_reidentifier
from farm_ar.reid.plausibility import Finding, check, set_aside
from farm_ar.reid.plausibility.finding import some
from farm_ar.reid.plausibility.quiet import LOUD, quiet
from farm_ar.reid.registry import load_reid
from farm_ar.scenes import NO_CATEGORY, WORLD_FRAMES, Detections, Scene, Snapshot
from farm_ar.scenes.worlds import frame_hint

IN_A_FRAME = ("frame",)
"""Findings that say nothing new where the frame was looked for."""

NOWHERE = ("frame", "mirrored", "units", "camera", "view", "bounds")
"""Findings that mean nothing where it was not found with certainty."""

FRAMES = ("map", "unknown")
"""In which frame a snapshot may be: the map's, or one that is to be found."""

MISLEADING = ("units", "sizes")
"""Findings after which no thing is taken for another detected again: their footprints mean nothing."""


def identify(
    scene: Scene,
    snapshot: Snapshot,
    reid: str | Reidentifier | Callable[[Scene], Reidentifier] = "adaptive",
    frame: str = "map",
    checks: bool = True,
    anchor: tuple[Pose, Pose] | None = None,
) -> Identification:
    """The label of each detection, or None with a reason; and warnings of what cannot be right.

    Detections that cannot be identified are set aside: of a category that the scene lacks, with a broken
    pose, or of a thing that is detected twice. Sizes that cannot be right are not used. The rest goes to the
    method, and the answers come back in the order of the detections, with NaN for the cost, the margin and
    the probabilities of those set aside.

    Args:
        scene: the reference layout and its place.
        snapshot: what was seen.
        reid: a method's name, what makes one for a scene, or one that is made.
        frame: "map" if the snapshot is in the scene's frame; "unknown" to find the motion between the two.
        checks: whether scene and snapshot are checked, for `warnings`.
        anchor: one pose (x, z, yaw), metres and radians, in the snapshot's frame and in the scene's, from
            which the motion between the two is then found.

    Raises:
        OptionError: the method or the frame is not known, or the method is made for another scene.
        SnapshotError: the method refuses the snapshot, or the anchor is not two poses.
    """
    return identify_in_frame(scene, snapshot, reid, frame, checks, anchor).identification


class InFrame(NamedTuple):
    """An answer, with the frame that was found for it.

    Args:
        identification: the answer.
        snapshot: in the scene's frame.
        alignment: from the snapshot's frame to the scene's; None where it was not asked for.
    """

    identification: Identification
    snapshot: Snapshot
    alignment: Alignment | None


def identify_in_frame(
    scene: Scene,
    snapshot: Snapshot,
    reid: str | Reidentifier | Callable[[Scene], Reidentifier] = "adaptive",
    frame: str = "map",
    checks: bool = True,
    anchor: tuple[Pose, Pose] | None = None,
) -> InFrame:
    """What `identify` gives, and the snapshot in the scene's frame, which takes the same arguments."""
    known_frame(frame)
    method = _method_of(reid, scene)
    snapshot = _without_strange_categories(scene, snapshot)
    named = snapshot.detections.category
    place, snapshot = _plainly(scene, snapshot)
    findings: tuple[Finding, ...] = ()
    sure, said, alignment = 1.0, list[str](), None
    nothing = quiet(place, snapshot, checks) if frame == "map" and anchor is None else LOUD
    if nothing.check and nothing.aside:
        whole = _named(snapshot, named)
        answer = method.identify(whole)
        return InFrame(_explained(answer, scene, whole, np.arange(len(named))), whole, None)
    if frame == "unknown" or anchor is not None:
        given, alignment = snapshot, align(place, snapshot, anchor)
        snapshot = replace(alignment.apply(snapshot), world=scene.world)
        sure, said = alignment.confidence, _doubts(alignment, anchor)
        unit = other_unit(place, given, alignment)
        said = said if unit is None else [unit, *said]
    whole = _named(snapshot, named)
    if checks and not nothing.check:
        findings = check(place, snapshot)
        said += [one.said for one in findings if one.kind not in _unsaid(alignment)]
    sure *= float(np.prod([1 - one.doubt for one in findings]))
    snapshot, reasons = _usable(place, snapshot, findings)
    snapshot = _named(snapshot, named)
    kept = np.flatnonzero([reason is None for reason in reasons])
    answer = method.identify(snapshot if len(kept) == len(reasons) else some(snapshot, kept))
    # If the snapshot does not mean what it says, every answer is as probable as any other.
    any_answer = (1 - sure) / (len(answer.candidates or scene.layout) + 1)
    answer = _explained(answer, scene, snapshot, kept)
    return InFrame(_whole(answer, kept, reasons, tuple(said), (sure, any_answer)), whole, alignment)


def known_frame(frame: str) -> None:
    """See that it is one of `FRAMES`.

    Raises:
        OptionError: it is not; says where a world's frame is given if it is one.
    """
    if frame in FRAMES:
        return
    expected = f"must be one of {', '.join(FRAMES)}"
    if frame in WORLD_FRAMES or frame_hint(frame):
        expected += "; the frame of a file's axes is a field of the file, or frame of World in Python"
    raise OptionError("frame", expected, frame)


def usable(scene: Scene, snapshot: Snapshot) -> tuple[Snapshot, tuple[str | None, ...]]:
    """The snapshot without what `identify` does not use of it, and N reasons for what it sets aside, or None.

    Args:
        scene: the reference layout and its place.
        snapshot: what was seen, in the scene's frame.
    """
    snapshot = _without_strange_categories(scene, snapshot)
    place, plain = _plainly(scene, snapshot)
    found, reasons = _usable(place, plain, check(place, plain))
    return _named(found, snapshot.detections.category), reasons


def _without_strange_categories(scene: Scene, snapshot: Snapshot) -> Snapshot:
    """The snapshot; without categories where the scene names none."""
    if scene.layout.names_categories:
        return snapshot
    return _named(snapshot, (None,) * len(snapshot.detections))


def _named(snapshot: Snapshot, category: tuple[str | None, ...]) -> Snapshot:
    """The snapshot with other categories."""
    if category is snapshot.detections.category:
        return snapshot
    return replace(
        snapshot, detections=Detections.trusted(**vars(snapshot.detections) | {"category": category})
    )


def _plainly(scene: Scene, snapshot: Snapshot) -> tuple[Scene, Snapshot]:
    """Both as they are checked and aligned: without categories where the scene has some objects' only."""
    if not scene.layout.partly_named:
        return scene, snapshot
    return scene.unnamed(), _named(snapshot, (None,) * len(snapshot.detections))


def _usable(
    scene: Scene, snapshot: Snapshot, findings: tuple[Finding, ...]
) -> tuple[Snapshot, tuple[str | None, ...]]:
    footprints = not any(one.kind in MISLEADING for one in findings)
    reasons = set_aside(scene, snapshot, again=footprints)
    wrong = [i for one in findings if one.kind == "sizes" for i in one.detections]
    return _without_sizes(snapshot, wrong), reasons


def _explained(answer: Identification, scene: Scene, snapshot: Snapshot, kept: IntArray) -> Identification:
    """The answer to the detections kept, with a reason for each to which the method gave no label."""
    if None not in answer.labels:
        return answer
    category = dict(zip(scene.layout.labels, scene.layout.category, strict=True))
    left = {category[name] for name in answer.candidates if name in category and name not in answer.labels}
    reasons = list(answer.reason)
    for k, (i, label) in enumerate(zip(kept, answer.labels, strict=True)):
        mine = snapshot.detections.category[i]
        if label is None and reasons[k] is None:
            free = left if mine is None else left & {mine, NO_CATEGORY}
            taken = bool(answer.candidates) and not free
            reasons[k] = "all labels that it may have are given to others" if taken else _unfit(answer, k)
    return replace(answer, reason=tuple(reasons))


def _unfit(answer: Identification, k: int) -> str:
    """Why detection k has none of the labels that are left."""
    if answer.probability is None or answer.probability[k, :-1].max(initial=0.0) <= answer.probability[k, -1]:
        return "no label fits it"
    j = int(answer.probability[k, :-1].argmax())
    sure = answer.probability[k, j]
    return f"its likeliest label, {answer.candidates[j]}, has a probability of {sure:.2f} only"


def _method_of(reid: Any, scene: Scene) -> Reidentifier:
    if isinstance(reid, str):
        return load_reid(reid)(scene)
    if isinstance(reid, Reidentifier) and not isinstance(reid, type):
        if not _knows(scene, getattr(reid, "scene", scene)):
            expected = "must be made for this scene: its labels stand elsewhere, or are others"
            raise OptionError("reid", expected, reid)
        return as_reidentifier(reid, scene)
    if callable(reid):
        made = reid(scene)
        if isinstance(made, Reidentifier):
            return as_reidentifier(made, scene)
    raise OptionError("reid", "must be a name, a Reidentifier, or what makes one for a scene", reid)


def _knows(scene: Scene, other: Scene) -> bool:
    """Whether another scene has the same layout."""
    if other is scene or other.layout is scene.layout:
        return True
    mine, theirs = vars(scene.layout), vars(other.layout)
    names = [field.name for field in fields(scene.layout)]
    return all(
        np.array_equal(mine[name], theirs[name], equal_nan=True)
        if isinstance(mine[name], np.ndarray)
        else mine[name] == theirs[name]
        for name in names
    )


def _doubts(found: Alignment, anchor: tuple[Pose, Pose] | None) -> list[str]:
    """What is to be said of a frame that was found."""
    if anchor is not None and not found.anchored:
        sure = f"with a probability of {found.confidence:.0%}"
        return [f"the anchor is not believed: what stands where says that the frame is another one, {sure}"]
    if found.certain:
        return []
    others = f", as {len(found.alternatives)} others may be" if found.alternatives else ""
    sure = f"the snapshot's frame is right with a probability of {found.confidence:.0%}{others}"
    return [f"{sure}: {found.reason}; anchor=... takes one pose known in both frames"]


def _unsaid(found: Alignment | None) -> tuple[str, ...]:
    """The kinds of findings that are not named after a frame was looked for."""
    if found is None:
        return ()
    return IN_A_FRAME if found.certain else NOWHERE


def _without_sizes(snapshot: Snapshot, wrong: list[int]) -> Snapshot:
    """The snapshot, with the sizes of some detections not known."""
    if not wrong:
        return snapshot
    size = snapshot.detections.size.copy()
    size[wrong] = np.nan
    return replace(snapshot, detections=Detections.trusted(**vars(snapshot.detections) | {"size": size}))


def _whole(
    answer: Identification,
    kept: IntArray,
    reasons: tuple[str | None, ...],
    said: tuple[str, ...],
    odds: tuple[float, float],
) -> Identification:
    """The answer to some of the detections as one to all; odds that it counts, and of any if it does not."""
    n = len(reasons)
    labels: list[str | None] = [None] * n
    why = list(reasons)
    for i, label, reason in zip(kept, answer.labels, answer.reason, strict=True):
        labels[i], why[i] = label, reason
    assurance = partial(_assured, answer, kept, n, said, odds)
    sure, any_answer = odds
    doubted = sure < 1 and _expects_errors(answer)
    return replace(
        answer,
        labels=tuple(labels),
        cost=_placed(1 - sure * (1 - answer.cost) - any_answer if doubted else answer.cost, kept, n),
        assurance=assurance,
        reason=tuple(why),
    )


def _expects_errors(answer: Identification) -> bool:
    """Whether the costs are expected errors, 1 less the probability of the label given."""
    if answer.probability is None:
        return False
    place = {name: j for j, name in enumerate(answer.candidates)}
    given = [(i, place[label]) for i, label in enumerate(answer.labels) if label is not None]
    row, column = np.array(given, dtype=np.int64).reshape(-1, 2).T
    right = answer.probability[row, column]
    return bool(np.allclose(answer.cost[row], 1 - right, rtol=0.0, atol=1e-9))


def _placed(values: FloatArray, kept: IntArray, n: int) -> FloatArray:
    """Values of those kept among all N, NaN for the rest."""
    result = np.full((n, *values.shape[1:]), np.nan)
    result[kept] = values
    return result


def _assured(
    answer: Identification, kept: IntArray, n: int, said: tuple[str, ...], odds: tuple[float, float]
) -> Assurance:
    runner_up: list[str | None] = [None] * n
    for i, label in zip(kept, answer.runner_up, strict=True):
        runner_up[i] = label
    certified = answer.certified
    if certified is not None:
        certified = replace(certified, detections=tuple(int(kept[i]) for i in certified.detections))
    (sure, any_answer), probability = odds, answer.probability
    scale = sure if sure < 1 and _expects_errors(answer) else 1.0
    return Assurance(
        margin=_placed(scale * answer.margin, kept, n),
        runner_up=tuple(runner_up),
        confidence=sure * _placed(answer.confidence, kept, n) + any_answer,
        probability=None if probability is None else sure * _placed(probability, kept, n) + any_answer,
        gone=answer.gone,
        certified=certified,
        warnings=(*said, *answer.warnings),
    )
