"""Wrong poses from pixels that lead to wrong labels, and what the method's confidence says of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.drawing.game.colours import label_colours
from farm_ar.drawing.game.text import BOLD, text_sprite
from farm_ar.drawing.photos import draw_on_image
from farm_ar.drawing.video import write_png
from farm_ar.envs.delivery.picture import paste
from farm_ar.geometry import wrap
from farm_ar.reid import Identification
from farm_ar.reid.registry import load_reid
from farm_ar.rendering import View, model
from farm_ar.scenes import Camera, Detections, Layout, Scene, Snapshot, builtin_scene
from farm_ar.showcases.result import Image, Report, Row, Shown
from farm_ar.vision.measured_noise import moments_of
from farm_ar.vision.perception import PixelPerception, source_of

METHODS = ("adaptive", "likelihood")

MOVED_M, TURNED_DEG = 0.12, 50.0
"""SDs by which buildings are moved and turned: by so much that labels are in doubt."""

WRONG_DEG, WRONG_M = 20.0, 0.01
"""From which error on a pose counts as wrong."""

WRONG = ("wrong with the true pose, too", "wrong because of a wrong pose")

RED = (255, 66, 66)


@dataclass(frozen=True, eq=False)
class Visit:
    """One visit as the headset saw it, K detections of what really stands there.

    Args:
        method: that gave the labels.
        truth: where everything stood.
        image: the picture.
        view: its camera.
        seen: what was found in it.
        answer: the labels.
        source: (K,) the object that each is of.
        turned: (K,) error of each heading, radians.
        wrong: (K,) whether each label is wrong.
        misled: (K,) whether it is wrong because of a wrong pose: with the true poses it is right.
    """

    method: str
    truth: Layout
    image: Image
    view: View
    seen: Detections
    answer: Identification
    source: IntArray
    turned: FloatArray
    wrong: BoolArray
    misled: BoolArray


def visits(
    scene: Scene, perception: PixelPerception, moment: tuple[Layout, Camera], rng: np.random.Generator
) -> Iterator[Visit]:
    """Take a picture, estimate poses, identify by each method; and with the true poses of what was found."""
    truth, camera = moment
    found, image, view = perception.look(truth, camera, rng)
    seen = found.uncertain
    source = source_of(seen.category, seen.position, truth)
    real, of = source >= 0, source.clip(0)
    true = Detections.trusted(
        **vars(seen)
        | {
            "position": np.where(real[:, None], truth.position[of], seen.position),
            "yaw": np.where(real, truth.yaw[of], seen.yaw),
            "uncertainty": None,
        }
    )
    turned = np.where(real, np.abs(wrap(seen.yaw - truth.yaw[of])), 0.0)
    off = np.where(real, np.linalg.norm(seen.position - truth.position[of], axis=1), 0.0)
    right = [truth.labels[k] if k >= 0 else None for k in source]
    bad = (turned > np.deg2rad(WRONG_DEG)) | (off > WRONG_M)
    for name in METHODS:
        method = load_reid(name)(scene)
        answer, best = (method.identify(Snapshot(camera, one)) for one in (seen, true))
        given = zip(answer.labels, right, strict=True)
        wrong = real & np.array([a is not None and a != b for a, b in given], bool)
        possible = np.array([a == b for a, b in zip(best.labels, right, strict=True)], bool)
        misled = wrong & possible & bad
        yield Visit(name, truth, image, view, seen, answer, source, turned, wrong, misled)


def picture(one: Visit, k: int) -> Image:
    """The headset's image with what was found, the labels' confidences, and what is true of detection k."""
    names, answer = one.truth.labels, one.answer
    colours = dict(zip(names, label_colours(names), strict=True))
    things = [
        (model(str(one.seen.category[i])), one.seen.position[i], float(one.seen.yaw[i]))
        for i in range(len(one.seen))
    ]
    texts = [
        f"{name or 'no label'} {100 * sure:.0f}%"
        for name, sure in zip(answer.labels, answer.confidence, strict=True)
    ]
    tones = [
        RED if one.wrong[i] else (170, 170, 176) if name is None else colours[name]
        for i, name in enumerate(answer.labels)
    ]
    image = np.repeat(np.repeat(one.image, 2, axis=0), 2, axis=1)
    lens = one.view.intrinsics.resized(image.shape[1], image.shape[0])
    view = View(lens, one.view.eye, one.view.yaw, one.view.pitch, one.view.roll)
    drawn = draw_on_image(image, view, things, texts, tones)
    page = np.full((len(drawn) + 40, drawn.shape[1], 3), 255, np.uint8)
    page[40:] = drawn
    said = (
        f"{one.method}: {answer.labels[k]} {100 * answer.confidence[k]:.0f}%; it is {names[one.source[k]]}, "
        f"whose heading is off by {np.rad2deg(one.turned[k]):.0f} degrees"
    )
    paste(page, text_sprite(said, 20, (34, 34, 34), BOLD), 10, 28)
    return page


def table(trials: Sequence[Row]) -> list[Row]:
    """How often labels are right and wrong, and the quartiles of the confidence in them."""
    rows = list[Row]()
    for method, kind in dict.fromkeys(sorted((one["method"], one["label"]) for one in trials)):
        mine = [one["confidence"] for one in trials if (one["method"], one["label"]) == (method, kind)]
        quartiles = " / ".join(f"{100 * value:.0f}%" for value in np.quantile(mine, [0.25, 0.5, 0.75]))
        rows.append(
            {"method": method, "label": kind, "number": len(mine), "confidence, quartiles": quartiles}
        )
    return rows


def show_doubt(out: Path, layouts: int, seed: int, film: bool, report: Report) -> Shown:
    """Count wrong labels and confidences over random visits, and draw a wrong label that is doubted most."""
    scene = builtin_scene("farm")
    perception, trials, chosen = PixelPerception(scene), list[Row](), list[tuple[float, Visit, int]]()
    for number, moment in enumerate(moments_of(scene, layouts, seed, MOVED_M, np.deg2rad(TURNED_DEG))):
        report(f"Visit {number + 1} of {layouts}", number / layouts)
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number, 1)))
        for one in visits(scene, perception, moment, rng):
            for k in np.flatnonzero(one.source >= 0).tolist():
                sure, label = float(one.answer.confidence[k]), one.answer.labels[k]
                kind = "none" if label is None else WRONG[int(one.misled[k])] if one.wrong[k] else "right"
                trials.append({"visit": number, "method": one.method, "label": kind, "confidence": sure})
                if one.misled[k]:
                    chosen.append((sure, one, k))
    shown = Shown("Labels from pixels, and the method's confidence in them", table(trials))
    if trials:
        shown.write(out, "doubt", trials)
    if not chosen:
        shown.notes.append("No wrong pose led to a wrong label in these visits; --layouts takes more.")
        return shown
    path = out / "doubt.png"
    _, one, k = min(chosen, key=lambda case: case[0])
    write_png(path, picture(one, k))
    shown.paths.append(path)
    return shown
