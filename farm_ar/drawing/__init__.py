"""Figures of scenes, identifications and explanations from above."""

from farm_ar.drawing.identifications import draw_explanation, draw_identification
from farm_ar.drawing.labels import place_labels
from farm_ar.drawing.palette import category_fills
from farm_ar.drawing.pictures import new_picture, save_picture, set_up_axes, widen
from farm_ar.drawing.scenes import draw_scene
from farm_ar.drawing.tags import Tag, Tags, add_tags

__all__ = [
    "Tag",
    "Tags",
    "add_tags",
    "category_fills",
    "draw_explanation",
    "draw_identification",
    "draw_scene",
    "new_picture",
    "place_labels",
    "save_picture",
    "set_up_axes",
    "widen",
]
