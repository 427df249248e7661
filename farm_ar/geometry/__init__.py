"""Poses, angles, fields of view, curves, cells and frames: pure functions on arrays.

Metres and radians. The plane is (x, z), y is up, x right, z forward; yaw is clockwise seen from above and 0
along +z.
"""

from farm_ar.geometry.angles import direction, heading, wrap
from farm_ar.geometry.camera import (
    bearing,
    camera_frame,
    distance,
    in_vertical_view,
    in_view,
    points_in_picture,
    view_polygon,
)
from farm_ar.geometry.curves import (
    arc_length_table,
    bezier_point,
    bezier_tangent,
    chain,
    equally_spaced,
    move_end,
    polyline_length,
    sample_chain,
    split_bezier,
)
from farm_ar.geometry.frames import (
    FRAMES,
    PlanarPose,
    convert_points,
    convert_pose,
    from_pymunk,
    planar_pose,
    pose_matrix,
    rotation_matrix,
    tilt_of,
    to_pymunk,
)
from farm_ar.geometry.polygons import crossing_sides, diameter, in_polygon, polygon_area
from farm_ar.geometry.rectangles import (
    deepest_overlap,
    footprint_corners,
    footprints_overlap,
    inside_footprint,
    segment_hits_box,
    segment_hits_footprint,
    world_box,
)
from farm_ar.geometry.voronoi import nearest_site, voronoi_cells

__all__ = [
    "FRAMES",
    "PlanarPose",
    "arc_length_table",
    "bearing",
    "bezier_point",
    "bezier_tangent",
    "camera_frame",
    "chain",
    "convert_points",
    "convert_pose",
    "crossing_sides",
    "deepest_overlap",
    "diameter",
    "direction",
    "distance",
    "equally_spaced",
    "footprint_corners",
    "footprints_overlap",
    "from_pymunk",
    "heading",
    "in_polygon",
    "in_vertical_view",
    "in_view",
    "inside_footprint",
    "move_end",
    "nearest_site",
    "planar_pose",
    "points_in_picture",
    "polygon_area",
    "polyline_length",
    "pose_matrix",
    "rotation_matrix",
    "sample_chain",
    "segment_hits_box",
    "segment_hits_footprint",
    "split_bezier",
    "tilt_of",
    "to_pymunk",
    "view_polygon",
    "voronoi_cells",
    "world_box",
    "wrap",
]
