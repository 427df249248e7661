"""The paper's own chain (appendix A): masks by SAM, categories by CLIP, poses from silhouettes.

Every mask that SAM finds from a grid of points is compared by CLIP with pictures of the meshes; what looks
like one gets the pose whose silhouette, rendered differentiably, is nearest to the mask. The weights do not
come with farm-ar, and its accuracy is unknown.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import torch

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.errors import OptionError
from farm_ar.geometry import bearing, wrap
from farm_ar.rendering import Instance, Intrinsics, Mesh, Renderer, View
from farm_ar.scenes import Detections
from farm_ar.vision.base import Image, PoseEstimates, PoseEstimator, check_question, size_of
from farm_ar.vision.canonical import on_plane

FILES = ("config.json", "model.safetensors")
"""What a folder of weights holds."""

VARIABLES = {"SAM": ("FARM_AR_SAM", "facebook/sam-vit-base"), "CLIP": ("FARM_AR_CLIP", "clip-ViT-B-32")}
"""Of the environment, which name the folders; and a model that fits."""

_SAM_MEAN, _SAM_SD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
_CLIP_MEAN, _CLIP_SD = (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)
_ACROSS = 48
"""Cells of the picture in which silhouettes are compared, each way."""


@dataclass(frozen=True)
class ChainOptions:
    """What is kept of what the networks say.

    Args:
        points: of the grid, each way.
        least_iou: by which SAM must trust a mask.
        overlap: intersection over union of two masks' boxes from which on the lesser one goes.
        alike: cosine of CLIP's embeddings from which on a mask shows a category.
        yaws: headings from which silhouettes are fitted.
        steps: of each fit.
        position_sd: that is said of places, metres.
        yaw_sd: and of headings, radians.
    """

    points: int = 16
    least_iou: float = 0.88
    overlap: float = 0.7
    alike: float = 0.8
    yaws: int = 8
    steps: int = 60
    position_sd: float = 0.01
    yaw_sd: float = 0.3


class PaperEstimator(PoseEstimator):
    """SAM, CLIP and silhouettes.

    Args:
        sam: folder with SAM's weights; by default the environment's variable `FARM_AR_SAM` names it.
        clip: that with CLIP's; `FARM_AR_CLIP`.
        options: what is kept.

    Raises:
        OptionError: a folder is not there, or lacks a file.
    """

    def __init__(
        self,
        sam: str | Path | None = None,
        clip: str | Path | None = None,
        options: ChainOptions | None = None,
    ) -> None:
        folders = {"SAM": _folder("SAM", sam), "CLIP": _folder("CLIP", clip)}
        from transformers import CLIPModel, SamModel

        self._sam: Any = SamModel.from_pretrained(folders["SAM"], local_files_only=True)
        self._clip: Any = CLIPModel.from_pretrained(folders["CLIP"], local_files_only=True)
        self._options = options or ChainOptions()
        self._known: dict[str, tuple[Mesh, torch.Tensor]] = {}

    def estimate(self, image: Image, camera: View, meshes: Mapping[str, Mesh]) -> PoseEstimates:
        """The poses of all objects of some categories that an image shows."""
        check_question(image, camera, meshes)
        rows: list[tuple[str, FloatArray, float]] = []
        for mask in self.masks(image):
            name, alike = self.category(image, mask, meshes)
            pose = fit_silhouette(mask, camera, meshes[name], self._options) if name else None
            if pose is not None:
                rows.append((name, pose, alike))
        pose = np.array([one[1] for one in rows]).reshape(-1, 3)
        order = np.argsort(bearing(camera.eye[[0, 2]], np.asarray(camera.yaw), pose[:, :2]), kind="stable")
        names = tuple(rows[k][0] for k in order)
        n, pose = len(rows), pose[order]
        size = np.array([size_of(meshes[name]) for name in names]).reshape(-1, 3)
        score = np.array([rows[k][2] for k in order])
        sds = (self._options.position_sd, self._options.position_sd, self._options.yaw_sd)
        detections = Detections(names, pose[:, :2], wrap(pose[:, 2]), size, confidence=score.clip(0, 1))
        nothing = np.full(n, np.nan)
        return PoseEstimates(
            detections, np.tile(np.diag(np.square(sds)), (n, 1, 1)), np.ones(n), nothing, nothing
        )

    @torch.no_grad()
    def masks(self, image: Image) -> list[BoolArray]:
        """(H, W) masks of what stands out, by SAM from a grid of points, without repeated ones."""
        height, width = image.shape[:2]
        across = int(self._sam.config.vision_config.image_size)
        scale = across / max(height, width)
        small = (max(round(width * scale), 1), max(round(height * scale), 1))
        square = np.zeros((across, across, 3), np.float32)
        resized = cv2.resize(image, small, interpolation=cv2.INTER_AREA).astype(np.float32) / 255
        square[: small[1], : small[0]] = (resized - _SAM_MEAN) / _SAM_SD
        embedded = self._sam.get_image_embeddings(_batch(square))
        share = (np.arange(self._options.points) + 0.5) / self._options.points
        points = np.stack(np.meshgrid(share * small[0], share * small[1]), axis=-1).reshape(-1, 2)
        found: list[tuple[float, BoolArray]] = []
        for part in np.array_split(points, max(1, len(points) // 64)):
            asked = torch.from_numpy(part.astype(np.float32))[None, :, None]
            said = self._sam(image_embeddings=embedded, input_points=asked)
            for logits, sure in zip(said.pred_masks[0].numpy(), said.iou_scores[0].numpy(), strict=True):
                k = int(sure.argmax())
                if sure[k] >= self._options.least_iou:
                    whole = cv2.resize(logits[k], (across, across))[: small[1], : small[0]]
                    found.append((float(sure[k]), np.asarray(cv2.resize(whole, (width, height)) > 0, bool)))
        return suppress(found, self._options.overlap)

    @torch.no_grad()
    def category(self, image: Image, mask: BoolArray, meshes: Mapping[str, Mesh]) -> tuple[str, float]:
        """The category that a mask looks like, and how alike it is; empty where it looks like none."""
        mine = self._embedded([_cut_out(image, mask)])[0]
        alike = {name: float((self._pictures(name, mesh) @ mine).max()) for name, mesh in meshes.items()}
        best = max(alike, key=lambda name: alike[name])
        return (best, alike[best]) if alike[best] >= self._options.alike else ("", alike[best])

    def _pictures(self, name: str, mesh: Mesh) -> torch.Tensor:
        """(V, D) embeddings of a mesh as it looks from all sides, made once."""
        kept = self._known.get(name)
        if kept is None or kept[0] is not mesh:
            pictures = []
            for yaw in 2 * np.pi * np.arange(8) / 8:
                away = 3.0 * float(size_of(mesh).max())
                eye = np.array([0.0, 0.7 * away, -away])
                view = View(Intrinsics.of_view(96, 96, 0.5), eye, 0.0, -float(np.arctan(0.7)))
                drawn = Renderer([Instance(mesh, np.zeros(3), float(yaw), 1)]).draw(view)
                pictures.append(_cut_out(drawn.rgb, drawn.ids == 1))
            kept = self._known[name] = (mesh, self._embedded(pictures))
        return kept[1]

    def _embedded(self, pictures: list[Image]) -> torch.Tensor:
        """(N, D) unit vectors."""
        across = int(self._clip.config.vision_config.image_size)
        ready = [
            (cv2.resize(one, (across, across), interpolation=cv2.INTER_AREA) / 255 - _CLIP_MEAN) / _CLIP_SD
            for one in pictures
        ]
        said = self._clip.get_image_features(pixel_values=torch.cat([_batch(one) for one in ready]))
        found: torch.Tensor = getattr(said, "pooler_output", said)
        return torch.nn.functional.normalize(found, dim=-1)


def suppress(found: list[tuple[float, BoolArray]], overlap: float) -> list[BoolArray]:
    """Masks without those whose box is about a better one's, the best first (non-maximum suppression)."""
    kept: list[tuple[FloatArray, BoolArray]] = []
    for _, mask in sorted(found, key=lambda one: -one[0]):
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        if not len(rows):
            continue
        box = np.array([rows[0], columns[0], rows[-1] + 1.0, columns[-1] + 1.0])
        if all(_shared(box, other) <= overlap for other, _ in kept):
            kept.append((box, mask))
    return [mask for _, mask in kept]


def _shared(one: FloatArray, other: FloatArray) -> float:
    """Intersection over union of two boxes: first row and column, last ones."""
    inner = np.minimum(one[2:], other[2:]) - np.maximum(one[:2], other[:2])
    both = float(np.prod(np.maximum(inner, 0)))
    return both / (float(np.prod(one[2:] - one[:2]) + np.prod(other[2:] - other[:2])) - both)


def fit_silhouette(mask: BoolArray, camera: View, mesh: Mesh, options: ChainOptions) -> FloatArray | None:
    """(3,) x, z and yaw of the thing whose silhouette is nearest to a mask; None where it shows no place.

    The silhouette is a soft one: points of the mesh's surface, each a blot in the picture.
    """
    rows, columns = np.nonzero(mask)
    tall = float(mesh.bounds[1, 1])
    raised = View(camera.intrinsics, camera.eye - [0.0, tall / 2, 0.0], camera.yaw, camera.pitch, camera.roll)
    if len(rows) < 20 or raised.eye[1] <= 0:
        return None
    start = on_plane(raised, np.array([columns.mean(), rows.mean()]))
    away = float(np.linalg.norm(start - camera.eye[[0, 2]]))
    if not np.isfinite(away) or away > 40 * float(size_of(mesh).max()):
        return None
    span = 1.5 * max(float(np.ptp(rows)), float(np.ptp(columns)), 8.0)
    corner = np.array([columns.min() + columns.max() - span, rows.min() + rows.max() - span]) / 2
    cell = span / _ACROSS
    line = np.arange(_ACROSS) * cell + cell / 2
    places = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2) + corner
    at = np.rint(places).astype(np.int64)
    inside = ((at >= 0) & (at < [mask.shape[1], mask.shape[0]])).all(axis=1)
    wanted = np.zeros(len(at))
    wanted[inside] = mask[at[inside, 1], at[inside, 0]]
    fits = [
        _fit(np.array([*start, yaw]), wanted[inside], places[inside], camera, _surface(mesh), cell, options)
        for yaw in 2 * np.pi * np.arange(options.yaws) / options.yaws
    ]
    best = min(fits, key=lambda one: one[0])
    return best[1] if np.isfinite(best[1]).all() else None


def _surface(mesh: Mesh, count: int = 400) -> torch.Tensor:
    """(P, 3) points on a mesh, evenly by area; the same ones each time."""
    rng = np.random.default_rng(0)
    corners = mesh.corners
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    face = rng.choice(len(corners), count, p=area / area.sum())
    share = rng.dirichlet(np.ones(3), count)
    return torch.from_numpy(np.einsum("pi,pij->pj", share, corners[face]))


def _fit(
    start: FloatArray,
    wanted: FloatArray,
    places: FloatArray,
    camera: View,
    points: torch.Tensor,
    cell: float,
    options: ChainOptions,
) -> tuple[float, FloatArray]:
    """Mean square difference of mask and silhouette where the descent from a pose ends, and that pose."""
    lens, turn = camera.intrinsics, torch.from_numpy(np.array(camera.rotation))
    eye, target, grid, pose = (
        torch.from_numpy(np.array(one, dtype=np.float64)) for one in (camera.eye, wanted, places, start)
    )
    scale = torch.tensor([0.004, 0.004, 0.08], dtype=torch.float64)
    change = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    descent, loss = torch.optim.Adam([change], lr=0.5), torch.tensor(np.inf)
    for _ in range(options.steps):
        x, z, yaw = (pose + scale * change).unbind()
        cosine, sine = torch.cos(yaw), torch.sin(yaw)
        world = torch.stack(
            [
                cosine * points[:, 0] + sine * points[:, 2] + x,
                points[:, 1],
                cosine * points[:, 2] - sine * points[:, 0] + z,
            ],
            dim=-1,
        )
        local = (world - eye) @ turn.T
        ahead = local[:, 2:].clamp(min=1e-3)
        pixel = local[:, :2] / ahead * torch.tensor([lens.fx, lens.fy]) + torch.tensor([lens.cx, lens.cy])
        square = ((grid[:, None] - pixel[None]) ** 2).sum(dim=-1)
        clear = torch.log1p(-0.9 * torch.exp(-square / (2 * (1.2 * cell) ** 2))).sum(dim=1)
        loss = ((1 - torch.exp(clear) - target) ** 2).mean()
        descent.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        descent.step()
    return float(loss.detach()), (start + (scale * change.detach()).numpy())


def _cut_out(image: Image, mask: BoolArray) -> Image:
    """The square around a mask, grey where the mask is not."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    cut = np.where(mask[part][..., None], image[part], 128).astype(np.uint8)
    across = max(cut.shape[:2])
    square = np.full((across, across, 3), 128, np.uint8)
    top, left = (across - cut.shape[0]) // 2, (across - cut.shape[1]) // 2
    square[top : top + cut.shape[0], left : left + cut.shape[1]] = cut
    return square


def _batch(image: npt.NDArray[Any]) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(image.transpose(2, 0, 1), dtype=np.float32))[None]


def _folder(name: str, given: str | Path | None) -> Path:
    variable, model = VARIABLES[name]
    folder = Path(given or os.environ.get(variable, ""))
    if not all((folder / file).is_file() for file in FILES):
        expected = f"must be a folder with {' and '.join(FILES)} of {name}, as {model}; or set {variable}"
        raise OptionError(name.lower(), expected, str(folder) if given or variable in os.environ else None)
    return folder
