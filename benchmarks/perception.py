"""Poses from pixels: the tables and pictures of docs/perception.md.

    python benchmarks/judging_frames.py FRAMES --count 300
    python benchmarks/judging_frames.py OWN --count 300 --own
    python benchmarks/perception.py FRAMES OWN [--write]

FRAMES are of the second renderer, OWN show the same worlds drawn by farm-ar's. With --write the tables take
their place in the page, and the pictures theirs in docs/images. Times are of one processor.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from judging_props import FARM

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.colours import label_colours
from farm_ar.drawing.game.pixels import paste
from farm_ar.drawing.game.text import BOLD, text_sprite
from farm_ar.drawing.photos import draw_on_image
from farm_ar.geometry import wrap
from farm_ar.reid import identify
from farm_ar.reid.registry import load_reid
from farm_ar.rendering import Instance, Renderer, View, model
from farm_ar.scenes import Camera, FieldOfView, Snapshot
from farm_ar.vision import PoseEstimates
from farm_ar.vision.base import Image
from farm_ar.vision.camera_refinement import Landmarks, refine_camera
from farm_ar.vision.canonical import canonical_image, canonical_view
from farm_ar.vision.estimator import NetworkEstimator
from farm_ar.vision.network import SHIPPED, network_of
from farm_ar.vision.scoring import (
    COLUMNS,
    FLIPPED,
    Frame,
    Matched,
    evaluate,
    farm_meshes,
    frame_files,
    match,
    read_frame,
    scores,
    table_rows,
)

ROOT = Path(__file__).parents[1]
PAGE, IMAGES = ROOT / "docs" / "perception.md", ROOT / "docs" / "images"
CAMERA_OFF_M, CAMERA_OFF_RAD = 0.01, np.deg2rad(0.5)
GREEN, RED = (60, 220, 90), (255, 60, 50)


def main() -> None:
    """Measure, print, and write what the page shows."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("judged", type=Path)
    parser.add_argument("own", type=Path)
    parser.add_argument("--count", type=int)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    parts, kept = {}, []
    for name, folder in (("judged", options.judged), ("own", options.own)):
        for refined in (True, False):
            estimator = NetworkEstimator(refined=refined)
            found, answers = evaluate(estimator, frames_of(folder, options.count), farm_meshes())
            kept = kept or answers
            parts[f"{name}{'' if refined else '-unrefined'}"] = as_table(COLUMNS, table_rows(found)) + (
                f"\n{found.frames} frames; {found.image_ms:.0f} ms an image and {found.thing_ms:.0f} ms an "
                "estimate.\n"
            )
    parts["camera"] = camera_table(options.judged, options.count)
    for name, text in parts.items():
        print(f"{name}\n\n{text}")
    if options.write:
        write_page(parts)
        write_picture(failures(options.judged, options.count, kept), "perception-failures.jpg")
        write_picture(stages(options.judged, options.count), "perception-stages.jpg")


def frames_of(folder: Path, count: int | None) -> Iterator[Frame]:
    """Frames, read one after the other."""
    for file in frame_files(folder, count):
        yield read_frame(file)


def as_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [columns, ["---", *["---:"] * (len(columns) - 1)], *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def camera_table(folder: Path, count: int | None) -> str:
    """Errors where the camera is wrong by a centimetre and half a degree, as it is and refined."""
    estimator, meshes, rows = NetworkEstimator(), farm_meshes(), []
    found: dict[str, list[tuple[Frame, Matched]]] = {"as given": [], "refined": []}
    for number, frame in enumerate(frames_of(folder, count)):
        rng = np.random.default_rng(number)
        given = moved(frame.view, rng)
        still = [k for k in range(len(frame.category)) if frame.fixed[k]]
        placed = [
            Instance(meshes[frame.category[k]], np.insert(frame.position[k], 1, 0.0), float(frame.yaw[k]), k)
            for k in still
        ]
        first = estimator.estimate(frame.image, given, meshes)
        seen = first.detections
        hidden = [
            Instance(meshes[str(seen.category[k])], np.insert(seen.position[k], 1, 0.0), float(seen.yaw[k]))
            for k in range(len(seen))
            if seen.category[k] != "shed"
        ]
        marks = Landmarks.of_table(*FARM.size, placed, 0.016)
        view, _ = refine_camera(frame.image, given, marks, hidden)
        found["as given"].append((frame, match(frame, first)))
        found["refined"].append((frame, match(frame, estimator.estimate(frame.image, view, meshes))))
    for name, kept in found.items():
        row = table_rows(scores(kept))[0]
        rows.append([name, *row[1:7]])
    return as_table(["camera", *COLUMNS[1:7]], rows)


def moved(view: View, rng: np.random.Generator) -> View:
    """A camera by 1 cm somewhere else, turned by half a degree about any axis."""
    shift, turn = (way / np.linalg.norm(way) for way in rng.standard_normal((2, 3)))
    yaw, pitch, roll = CAMERA_OFF_RAD * turn
    return replace(
        view,
        eye=view.eye + CAMERA_OFF_M * shift,
        yaw=view.yaw + yaw,
        pitch=view.pitch + pitch,
        roll=view.roll + roll,
    )


def failures(folder: Path, count: int | None, kept: Sequence[Matched]) -> Image:
    """The worst, cut out: what stands there in green, what was found in red."""
    estimator, meshes, worst = NetworkEstimator(), farm_meshes(), []
    for frame, found in zip(frames_of(folder, count), kept, strict=True):
        for k in np.flatnonzero((frame.visible >= 0.4) & ~frame.fixed):
            name = f"{frame.name}: {frame.category[k]}"
            if not found.found[k]:
                worst.append((2.0 + frame.visible[k], f"{name} missed", frame, int(k)))
            elif found.turned[k] > FLIPPED:
                said = f"{name} by {np.rad2deg(found.turned[k]):.0f} deg"
                worst.append((1.0 + frame.visible[k], said, frame, int(k)))
            else:
                worst.append((found.away[k], f"{name} by {100 * found.away[k]:.1f} cm", frame, int(k)))
    worst.sort(key=lambda one: -one[0])
    tiers = []
    for low in (2.0, 1.0, 0.0):  # missed, turned, moved: the worst of each frame, four frames each
        of_frame = {one[2].name: one for one in reversed(worst) if low <= one[0] < low + 1}
        tiers.append(sorted(of_frame.values(), key=lambda one: -one[0])[:4])
    cells = []
    for one in (one for tier in tiers for one in tier):
        _, words, frame, k = one
        seen = estimator.estimate(frame.image, frame.view, meshes)
        things = [(meshes[frame.category[k]], frame.position[k], float(frame.yaw[k]))]
        near = np.flatnonzero(np.linalg.norm(seen.detections.position - frame.position[k], axis=1) < 0.08)
        things += [pose_of(seen, int(i)) for i in near]
        drawn = draw_outlines(frame.image, frame.view, things, [GREEN, *[RED] * len(near)])
        x, y = frame.view.pixels(np.array([frame.position[k, 0], 0.03, frame.position[k, 1]]))
        left, top = int(np.clip(x - 80, 0, 480)), int(np.clip(y - 60, 0, 240))
        cut = cv2.resize(drawn[top : top + 120, left : left + 160], (320, 240))
        cells.append(titled(np.asarray(cut, np.uint8), words))
    rows = [np.hstack(cells[k : k + 4]) for k in range(0, len(cells) - 3, 4)]
    return np.vstack(rows)


def pose_of(seen: PoseEstimates, k: int) -> tuple[Any, FloatArray, float]:
    """An estimate as `draw_on_image` takes it."""
    one = seen.detections
    return model(str(one.category[k])), one.position[k], float(one.yaw[k])


def draw_outlines(image: Image, view: View, things: Sequence[Any], colours: Sequence[Any]) -> Image:
    """Outlines of things with a tick to their front, no text."""
    drawn = image.copy()
    for (mesh, place, yaw), colour in zip(things, colours, strict=True):
        ids = Renderer([Instance(mesh, np.array([place[0], 0.0, place[1]]), yaw, 1)]).ids(view)[1]
        lines = cv2.findContours((ids == 1).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
        cv2.drawContours(drawn, lines, -1, colour, 1, cv2.LINE_AA)
        ahead = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
        foot = np.array([place[0], 0.0, place[1]])
        ends = view.pixels(np.stack([foot, foot + 0.06 * ahead]))
        cv2.line(drawn, *np.rint(ends).astype(int).tolist(), colour, 1, cv2.LINE_AA)
    return drawn


def stages(folder: Path, count: int | None) -> Image:
    """One snapshot from its image to its labels, in the manner of the paper's Fig. 22."""
    frame = max(frames_of(folder, count), key=farmlike)
    meshes, view = farm_meshes(), frame.view
    canonical = canonical_view(view)
    small = canonical_image(frame.image, view, canonical)
    output = network_of(str(SHIPPED))(small)
    names = network_of(str(SHIPPED)).names
    heat = 1 / (1 + np.exp(-output[: len(names)]))
    glow = small.astype(np.float64) * 0.35
    for layer, tone in zip(heat, ((255, 120, 60), (90, 190, 255), (200, 255, 110)), strict=False):
        grown = cv2.resize(layer, (small.shape[1], small.shape[0]), interpolation=cv2.INTER_LINEAR)
        glow += np.asarray(grown)[..., None] * np.array(tone)
    glow_image = cv2.resize(np.clip(glow, 0, 255).astype(np.uint8), (640, 384))[12:372]
    coarse = NetworkEstimator(refined=False).estimate(frame.image, view, meshes)
    fine = NetworkEstimator().estimate(frame.image, view, meshes)
    panels = [
        titled(frame.image, "1 the image"),
        titled(np.asarray(glow_image, np.uint8), "2 where the network sees what"),
    ]
    for seen, words in ((coarse, "3 poses by the network"), (fine, "4 refined by rendering")):
        things = [pose_of(seen, k) for k in range(len(seen))]
        drawn = draw_outlines(frame.image, view, things, [(255, 240, 90)] * len(things))
        panels.append(titled(drawn, words))
    placed = [
        Instance(mesh, np.array([place[0], 0.0, place[1]]), yaw)
        for mesh, place, yaw in (pose_of(fine, k) for k in range(len(fine)))
    ]
    panels.append(titled(Renderer(placed).draw(view).rgb, "5 what was found, drawn"))
    lens = view.intrinsics
    half = float(np.arctan(lens.width / 2 / lens.fx))
    camera = Camera(
        view.eye[[0, 2]], view.yaw, FieldOfView(half, half, 3.0), view.eye[1], np.array(view.pitch)
    )
    answer = identify(FARM, Snapshot(camera, fine.uncertain), load_reid("likelihood")(FARM))
    colours = dict(zip(FARM.layout.labels, label_colours(FARM.layout.labels), strict=True))
    texts = [
        f"{name or 'no label'} {100 * sure:.0f}%"
        for name, sure in zip(answer.labels, answer.confidence, strict=True)
    ]
    tones = [(170, 170, 176) if name is None else colours[name] for name in answer.labels]
    things = [pose_of(fine, k) for k in range(len(fine))]
    panels.append(
        titled(draw_on_image(frame.image, view, things, texts, tones), "6 labels, by where things stood")
    )
    return np.vstack([np.hstack(panels[k : k + 2]) for k in (0, 2, 4)])


def farmlike(frame: Frame) -> float:
    """How many of a frame's things stand about where the farm has one of their category."""
    layout, near = FARM.layout, 0
    for k, category in enumerate(frame.category):
        same = [i for i in range(len(layout)) if layout.category[i] == category]
        away = np.linalg.norm(layout.position[same] - frame.position[k], axis=1)
        turned = np.abs(wrap(layout.yaw[same] - frame.yaw[k]))
        near += bool(frame.visible[k] > 0.5 and (away + 0.1 * turned).min() < 0.12)
    return near


def titled(image: Image, words: str) -> Image:
    """A picture with a line of text in its corner."""
    drawn = np.ascontiguousarray(image).copy()
    text = text_sprite(words, 15, (255, 255, 255), BOLD, halo=(20, 22, 28))
    paste(drawn, text.pixels, 8 + text.left, len(drawn) - 12 + text.top)
    drawn[-2:], drawn[:, -2:] = 18, 18
    return drawn


def write_picture(picture: Image, name: str) -> None:
    """Into docs/images."""
    cv2.imwrite(str(IMAGES / name), picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 84])


def write_page(parts: dict[str, str]) -> None:
    """Put each table between its marks in the page."""
    page = PAGE.read_text(encoding="utf-8")
    for name, text in parts.items():
        marks = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
        page = re.sub(
            marks, lambda found, text=text: f"{found[1]}\n{text}\n{found[2]}", page, flags=re.DOTALL
        )
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
