"""Scenes: what stood where, who looks at it, and what is seen of it."""

from farm_ar.scenes.bounds import Bounds
from farm_ar.scenes.builtin import BUILTIN, builtin_scene
from farm_ar.scenes.camera import PAPER_FIELD_OF_VIEW, Camera, CameraPath, FieldOfView
from farm_ar.scenes.csv_files import load_layout_csv, load_scene_csv, load_snapshot_csv
from farm_ar.scenes.from_poses import from_poses
from farm_ar.scenes.json_files import (
    load_scene,
    load_snapshot,
    save_scene,
    save_snapshot,
    scene_from_dict,
    scene_schema,
    scene_to_dict,
    snapshot_from_dict,
    snapshot_to_dict,
)
from farm_ar.scenes.layout import NO_CATEGORY, Layout
from farm_ar.scenes.noise import Gaussian, LayoutNoise
from farm_ar.scenes.observing import (
    PERFECT,
    Detector,
    observe,
    observe_many,
    occluded,
    visible,
    whole_in_view,
)
from farm_ar.scenes.scene import Scene, Site, Template, Weights
from farm_ar.scenes.snapshot import UNKNOWN, Detections, Snapshot, SnapshotBatch
from farm_ar.scenes.streams import read_snapshots
from farm_ar.scenes.uncertainty import Uncertainty
from farm_ar.scenes.worlds import UNITS, WORLD_FRAMES, World

__all__ = [
    "BUILTIN",
    "NO_CATEGORY",
    "PAPER_FIELD_OF_VIEW",
    "PERFECT",
    "UNITS",
    "UNKNOWN",
    "WORLD_FRAMES",
    "Bounds",
    "Camera",
    "CameraPath",
    "Detections",
    "Detector",
    "FieldOfView",
    "Gaussian",
    "Layout",
    "LayoutNoise",
    "Scene",
    "Site",
    "Snapshot",
    "SnapshotBatch",
    "Template",
    "Uncertainty",
    "Weights",
    "World",
    "builtin_scene",
    "from_poses",
    "load_layout_csv",
    "load_scene",
    "load_scene_csv",
    "load_snapshot",
    "load_snapshot_csv",
    "observe",
    "observe_many",
    "occluded",
    "read_snapshots",
    "save_scene",
    "save_snapshot",
    "scene_from_dict",
    "scene_schema",
    "scene_to_dict",
    "snapshot_from_dict",
    "snapshot_to_dict",
    "visible",
    "whole_in_view",
]
