"""Frames with truth that farm-ar's own renderer did not make: Mitsuba 3, path tracing, unseen rooms.

    python benchmarks/judging_frames.py OUT [--count 60] [--first 0] [--seed 7]        640x360, 16 samples
    python benchmarks/judging_frames.py OUT --own [...]                    the same worlds by our own renderer
    python benchmarks/judging_frames.py OUT --hands [--count 1300]                     320x180, 8 samples

Each frame is NNNN.png and NNNN.json: the camera as `farm-ar identify --camera` takes it, and what stands
there. Frames that are there already are kept, so that a run can go on where another stopped. Half of the
frames with --hands have a hand. Needs: pip install '.[judge]'
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from judging_props import HAND, Paint, Thing
from judging_worlds import World, draw_world

from farm_ar.arrays import FloatArray
from farm_ar.rendering import HOLOLENS_2, Instance, Intrinsics, Light, Mesh, Renderer, Sensor, View
from farm_ar.scenes.files import degrees

DEPTH = 3
"""Bounces of light, and the last surface."""

SENSOR_NOISE = 4.0
"""SD of 255, on top of the path tracer's own of about 8."""

_TEXTURE_PX = 192
_WIDER = 3
"""How many times wider and higher than the picture is that in which a whole thing is counted."""


def main() -> None:
    """Make the frames that are not there yet."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--hands", action="store_true")
    parser.add_argument("--own", action="store_true", help="the same worlds, drawn by farm-ar's own renderer")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    lens, samples = (HOLOLENS_2.resized(320, 180), 8) if options.hands else (HOLOLENS_2, 16)
    for number in range(options.first, options.first + options.count):
        name = f"{number:04d}"
        if (options.out / f"{name}.json").exists():
            continue
        rng = np.random.default_rng([options.seed, number, int(options.hands)])
        world = draw_world(lens, rng, options.hands and number % 2 == 1)
        if options.own:
            rgb = Sensor().expose(drawn_by_farm_ar(world, rng), rng)
        else:
            rgb = Sensor(noise=SENSOR_NOISE).expose(render(world, samples, seed=number), rng)
        _write(options.out, name, rgb, truth_of(world, f"{name}.png"))
        print(f"{number + 1 - options.first} of {options.count}", flush=True)


def drawn_by_farm_ar(world: World, rng: np.random.Generator) -> npt.NDArray[np.uint8]:
    """(H, W, 3) the world's picture by the farm's own renderer: its colours, no patterns, one sun."""
    placed = []
    for thing in world.things:
        tones = np.array([thing.paint[tuple(row)].colour for row in np.rint(thing.mesh.colour).astype(int)])
        mesh = Mesh(thing.mesh.corners, tones, thing.mesh.part, thing.mesh.parts)
        indoors = float(np.ptp(thing.mesh.bounds, axis=0).max()) < 1.5  # walls would keep the sun out
        placed.append(Instance(mesh, np.zeros(3), number=thing.number, casts_shadow=indoors))
    toward = np.array([rng.uniform(-1, 1), rng.uniform(0.6, 1.5), rng.uniform(-1, 0.3)])
    return Renderer(placed, Light(toward), smooth=True).draw(world.view).rgb


def truth_of(world: World, image: str) -> dict[str, Any]:
    """What a frame's JSON says: camera, intrinsics, and of each thing its pose and which share is seen."""
    view, lens = world.view, world.view.intrinsics
    seen = shares_seen(world.things, view)
    objects = [
        {
            "category": category,
            "x": float(place[0]),
            "z": float(place[1]),
            "yaw_deg": degrees(yaw),
            "size_whd": size.tolist(),
            "visible": round(seen.get(k + 1, (0.0, 0))[0], 4),
            "pixels": seen.get(k + 1, (0.0, 0))[1],
            "touching": world.touching[k],
            "fixed": category == "shed",
        }
        for k, (category, place, yaw, size) in enumerate(world.objects)
    ]
    camera = world.camera
    return {
        "image": image,
        "camera": {
            "x": float(camera.position[0]),
            "y": float(view.eye[1]),
            "z": float(camera.position[1]),
            "yaw_deg": degrees(camera.yaw),
            "pitch_deg": degrees(camera.pitch),
        },
        "intrinsics": {name: getattr(lens, name) for name in ("fx", "fy", "cx", "cy", "width", "height")},
        "objects": objects,
        "hand_pixels": seen.get(HAND, (0.0, 0))[1],
    }


def shares_seen(things: list[Thing], view: View) -> dict[int, tuple[float, int]]:
    """By number, the share of a thing's pixels that the picture shows, and how many those are.

    The whole is what a wider picture would show of the thing alone, with nothing before it.
    """
    at = np.zeros(3)
    instances = [Instance(thing.mesh, at, number=thing.number) for thing in things]
    ids = Renderer(instances).ids(view)[1]
    lens = view.intrinsics
    wide = Intrinsics(
        lens.fx,
        lens.fy,
        lens.cx + lens.width * (_WIDER - 1) / 2,
        lens.cy + lens.height * (_WIDER - 1) / 2,
        _WIDER * lens.width,
        _WIDER * lens.height,
    )
    wider = View(wide, view.eye, view.yaw, view.pitch, view.roll)
    found = {}
    for number in sorted({thing.number for thing in things} - {0}):
        alone = Renderer([one for one in instances if one.number == number])
        whole = int((alone.ids(wider)[1] == number).sum())
        shown = int((ids == number).sum())
        found[number] = (shown / max(whole, 1), shown)
    return found


def render(world: World, samples: int, seed: int = 0, depth: int = DEPTH) -> npt.NDArray[np.uint8]:
    """(H, W, 3) the world's picture by path tracing, exposed and as a screen shows it."""
    light = trace(world, samples, seed, depth)
    height = len(light)
    level = float(np.median(light[height // 4 : 3 * height // 4].mean(axis=-1)))
    value = light * (_linear(np.array(world.exposure)) / max(level, 1e-6))
    value = np.where(value > 0.7, 0.7 + 0.3 * (1 - np.exp(-(value - 0.7) / 0.3)), value)  # a soft shoulder
    picture: npt.NDArray[np.uint8] = np.rint(255 * _encoded(np.clip(value, 0, 1))).astype(np.uint8)
    return picture


def trace(world: World, samples: int, seed: int, depth: int) -> FloatArray:
    """(H, W, 3) the light that reaches each pixel, linear."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    view, lens = world.view, world.view.intrinsics
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": depth},
        "sensor": {
            "type": "perspective",
            "fov_axis": "x",
            "fov": float(np.rad2deg(2 * np.arctan(lens.width / 2 / lens.fx))),
            "near_clip": 0.01,
            "far_clip": 100.0,
            "principal_point_offset_x": 0.5 - (lens.cx + 0.5) / lens.width,
            "principal_point_offset_y": 0.5 - (lens.cy + 0.5) / lens.height,
            "to_world": mi.ScalarTransform4f(_to_world(view)),
            "film": {
                "type": "hdrfilm",
                "width": lens.width,
                "height": lens.height,
                "pixel_format": "rgb",
                "rfilter": {"type": "gaussian"},
            },
            "sampler": {"type": "multijitter", "sample_count": samples},
        },
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": [0.02, 0.02, 0.02]}},
    }
    groups: dict[Paint, list[tuple[FloatArray, FloatArray]]] = {}
    for thing in world.things:
        colours = np.rint(thing.mesh.colour).astype(int)
        for colour, paint in thing.paint.items():
            faces = (colours == colour).all(axis=1)
            groups.setdefault(paint, []).append((thing.mesh.corners[faces], thing.local[faces]))
    for k, (paint, parts) in enumerate(groups.items()):
        corners, local = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
        scene[f"paint-{k}"] = _shape(
            mi, f"paint-{k}", corners, _places(local) / paint.period, _surface(mi, paint)
        )
    for k, (corner, first, second, radiance) in enumerate(world.lamps):
        square = np.array(
            [
                [corner, corner + first, corner + first + second],
                [corner, corner + first + second, corner + second],
            ]
        )
        lamp = {"type": "area", "radiance": {"type": "rgb", "value": radiance.tolist()}}
        for side, faces in enumerate((square, square[:, ::-1])):
            scene[f"lamp-{k}-{side}"] = _shape(
                mi, f"lamp-{k}-{side}", faces, np.zeros((2, 3, 2)), {"type": "diffuse"}, lamp
            )
    picture = np.array(mi.render(mi.load_dict(scene), spp=samples, seed=seed), dtype=np.float64)
    return picture[..., :3]


def _to_world(view: View) -> npt.NDArray[np.float32]:
    """Mitsuba's camera looks along +z with +x to its left; its world is right-handed, so our x is turned."""
    right, down, forward = view.rotation
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = -right, -down, forward, view.eye
    matrix[0] *= -1
    return matrix.astype(np.float32)


def _shape(
    mi: Any,
    name: str,
    corners: FloatArray,
    uv: FloatArray,
    bsdf: dict[str, Any],
    lamp: dict[str, Any] | None = None,
) -> Any:
    """Triangles (F, 3, 3) as one of Mitsuba's meshes."""
    count = 3 * len(corners)
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "twosided", "bsdf": bsdf} if lamp is None else bsdf)
    if lamp is not None:
        properties["emitter"] = mi.load_dict(lamp)
    mesh = mi.Mesh(name, count, len(corners), has_vertex_texcoords=True, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = (corners * [-1.0, 1.0, 1.0]).astype(np.float32).ravel()
    parameters["faces"] = np.arange(count, dtype=np.uint32).reshape(-1, 3)[:, ::-1].ravel()
    parameters["vertex_texcoords"] = uv.astype(np.float32).ravel()
    parameters.update()
    return mesh


def _places(local: FloatArray) -> FloatArray:
    """(F, 3, 2) metres along each face's plane: its corners without the axis that it faces most."""
    normal = np.abs(np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])).argmax(axis=1)
    kept = np.array([(2, 1), (0, 2), (0, 1)])[normal]
    found: FloatArray = np.take_along_axis(local, kept[:, None, :].repeat(3, axis=1), axis=2)
    return found


def _surface(mi: Any, paint: Paint) -> dict[str, Any]:
    """A paint as one of Mitsuba's surfaces."""
    colour = _linear(np.array(paint.colour) / 255)
    if paint.pattern == "plain":
        reflectance: dict[str, Any] = {"type": "rgb", "value": colour.tolist()}
    else:
        tile = np.clip(colour * (1 + paint.contrast * pattern(paint)[..., None]), 0.0, 0.95).astype(
            np.float32
        )
        reflectance = {"type": "bitmap", "bitmap": mi.Bitmap(tile), "raw": True, "wrap_mode": "repeat"}
    if not paint.rough:
        return {"type": "diffuse", "reflectance": reflectance}
    return {"type": "principled", "base_color": reflectance, "roughness": paint.rough**0.5}


def pattern(paint: Paint) -> FloatArray:
    """(S, S) a tile that repeats, of mean 0, most of it from -1 to 1."""
    rng, side = np.random.default_rng(paint.seed), _TEXTURE_PX
    noise = rng.standard_normal((side, side))
    row, column = np.mgrid[:side, :side] / side
    if paint.pattern == "grain":
        tile = _blurred(noise, 1.0, 24.0)
    elif paint.pattern == "speckle":
        tile = _blurred(noise, 1.5, 1.5)
    elif paint.pattern == "planks":
        tile = (
            0.5 * _blurred(noise, 20.0, 1.0)
            - 2.0 * ((column * 4) % 1 < 0.06)
            + 0.4 * rng.standard_normal(4)[(column * 4).astype(int)]
        )
    elif paint.pattern == "weave":
        tile = np.sin(16 * np.pi * row) * np.sin(16 * np.pi * column) + 0.3 * _blurred(noise, 1.0, 1.0)
    else:
        tile = _blurred(noise, 16.0, 16.0)
    tile = tile - tile.mean()
    return np.asarray(tile / max(2 * tile.std(), 1e-9))


def _blurred(noise: FloatArray, down: float, across: float) -> FloatArray:
    """Noise, smoothed over its edges, of SD 1."""
    from scipy.ndimage import gaussian_filter

    smooth: FloatArray = gaussian_filter(noise, (down, across), mode="wrap")
    return smooth / smooth.std()


def _linear(value: FloatArray) -> FloatArray:
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def _encoded(value: FloatArray) -> FloatArray:
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)


def _write(folder: Path, name: str, rgb: npt.NDArray[np.uint8], truth: dict[str, Any]) -> None:
    """The picture first: a frame counts when its JSON is there."""
    cv2.imwrite(str(folder / f"{name}.png"), rgb[..., ::-1])
    part = folder / f"{name}.json.part"
    part.write_text(json.dumps(truth), encoding="utf-8")
    part.replace(folder / f"{name}.json")


if __name__ == "__main__":
    main()
