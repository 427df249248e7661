"""What scene and snapshot files hold: declared once, for the reader and for the JSON Schema."""

from __future__ import annotations

from typing import Any

from farm_ar.arrays import FINITE, RANGE, SHARE, SIDE, SPEED, TIME, WEIGHT, Limits
from farm_ar.errors import SceneError, SnapshotError
from farm_ar.scenes.camera import PAPER_FIELD_OF_VIEW
from farm_ar.scenes.documents import Document, Listing, Named, Object
from farm_ar.scenes.files import degrees
from farm_ar.scenes.kinds import (
    DEGREES,
    RADIANS,
    Anything,
    Either,
    Flag,
    Kind,
    Number,
    Numbers,
    OrNull,
    Rows,
    Text,
    Whole,
)
from farm_ar.scenes.worlds import UNITS, WORLD_FRAMES, frame_hint

UP_AND_DOWN = ("fov_up_deg", "fov_down_deg")

IN_METRES = (("size_m",), ("bounds", "size_m"), ("camera", "range_m"), ("camera", "speed_m_s"))
"""Where fields stand that are in metres whatever the units."""

_HALF_TURN, _QUARTER, _TURN = (Limits(0.0, limit, "") for limit in (180.0, 90.0, 360.0))
_FAR, _LONG = Limits(-1e9, 1e9, ""), Limits(1e-9, 1e9, "")
_SIGN = Limits(-2.0, 2.0, "")

_COORDINATE = Number(_FAR, default=None)
_YAW_RAD = Number(RADIANS, default=None)
_SIZE = Numbers(
    3,
    _LONG,
    "3 positive numbers in metres, from 1e-6 to 1e6",
    default=None,
    about="Width (to its right), height and depth (along its heading) before turning; not known if left out.",
)
_SIDES = Numbers(2, SIDE, "2 positive numbers in metres, from 1e-6 to 1e6", default=None)
_LENGTHS = Numbers(2, _LONG, "2 positive numbers", default=None, about="The same in `units`.")
_POINT = Numbers(2, _FAR, "[x, z] in metres, from -1e6 to 1e6")
_POINT_IN_SPACE = Numbers(3, _FAR, "[x, y, z]")

_WORLD: dict[str, Kind] = {
    "frame": Text(
        WORLD_FRAMES,
        frame_hint,
        default="unity",
        about="unity: x right, y up, z forward, yaw clockwise from above. openxr (WebXR, ARKit, ARCore): x "
        "right, y up, z backward, yaw counter-clockwise. ros: x forward, y left, z up, yaw likewise. "
        "Yaw 0 is forward; points [x, z] are [x, y] in ros.",
    ),
    "units": Text(
        tuple(UNITS), default="m", about="Of all lengths without a unit in their name; metres by default."
    ),
    "origin": Either(
        (
            _POINT,
            _POINT_IN_SPACE,
            Object(
                {
                    **dict.fromkeys("xyz", Number(_FAR, default=0.0)),
                    "yaw_deg": Number(DEGREES, default=0.0),
                    "yaw_rad": _YAW_RAD,
                },
                exclusive=(("yaw_deg", "yaw_rad"),),
            ),
        ),
        "a point [x, z] or [x, y, z], or an object with x, y, z and yaw_deg",
        default=None,
        about="Where the origin of this file stands in the common world, in the file's own axes and units.",
    ),
}

_TURNS: dict[str, Kind] = {
    "yaw_deg": Number(DEGREES, default=None),
    "yaw_rad": _YAW_RAD,
    "quaternion": Numbers(
        4, _SIGN, "4 numbers [x, y, z, w]", default=None, about="[x, y, z, w] of length 1, body to world."
    ),
    "matrix": Rows(
        (4, 4), FINITE, "4 rows of 4 numbers", default=None, about="4x4, body to world, by rows; rigid."
    ),
}
_POSE: dict[str, Kind] = {
    **dict.fromkeys("xyz", _COORDINATE),
    **_TURNS,
}
_ONE_TURN = tuple(_TURNS)
_ONE_PLACE = tuple((name, "matrix") for name in "xyz")
_PLACED = (("x", "z"), ("x", "y"), ("matrix",))


def _posed(fields: dict[str, Kind], *exclusive: tuple[str, ...]) -> Object:
    """An object with a place and, perhaps, a heading."""
    return Object({**_POSE, **fields}, exclusive=(_ONE_TURN, *_ONE_PLACE, *exclusive), either=_PLACED)


_VIEW: dict[str, Kind] = {
    "fov_left_deg": Number(_HALF_TURN, default=degrees(PAPER_FIELD_OF_VIEW.left)),
    "fov_right_deg": Number(_HALF_TURN, default=degrees(PAPER_FIELD_OF_VIEW.right)),
    "range_m": Number(RANGE, default=PAPER_FIELD_OF_VIEW.range_m),
    "range": Number(Limits(1e-9, 1e12, ""), default=None, about="The same in `units`."),
    "fov_up_deg": Number(_QUARTER, default=None),
    "fov_down_deg": Number(_QUARTER, default=None),
}
_ONE_RANGE = ("range_m", "range")
_CATEGORY = OrNull(
    Text(),
    "a category",
    default=None,
    about="What can be seen of it; objects of one category look alike. null or left out: not known.",
)

_BOUNDS = Either(
    (
        Listing(_POINT, least=3),
        Object(
            {
                "size_m": _SIDES,
                "size": _LENGTHS,
                "origin": Numbers(2, _FAR, "[x, z]", default=(0.0, 0.0)),
                "yaw_deg": Number(DEGREES, default=0.0),
            },
            exclusive=(("size_m", "size"),),
            either=(("size_m",), ("size",)),
        ),
    ),
    "a list of at least 3 corners [x, z], or an object with size, origin and yaw_deg",
    default=None,
    about="Within which the objects stand: the corners of a polygon in order, or a rectangle by its width "
    "(to the right of its heading) and depth, the corner behind on its left, and its heading.",
)

SCENE = Document(
    "scene",
    Object(
        {
            "name": Text(default=None, about="The file's name without its ending if left out."),
            **_WORLD,
            "size_m": Numbers(
                2,
                SIDE,
                "2 positive numbers in metres, from 1e-6 to 1e6",
                default=None,
                about="Width and depth of the room, which begins at the file's origin.",
            ),
            "size": _LENGTHS,
            "bounds": _BOUNDS,
            "sites": Listing(
                Object({"name": Text(), **dict.fromkeys("xyz", _COORDINATE)}, either=_PLACED[:2]),
                default=(),
                about="Centres of the Voronoi cells; none means that nothing is pruned.",
            ),
            "objects": Listing(
                _posed(
                    {
                        "label": Text(about="Its identity, different for each object."),
                        "category": _CATEGORY,
                        "size_whd": _SIZE,
                        "fixed": Flag(default=False, about="Whether it never moves."),
                    }
                ),
                different="label",
                about="The labelled objects of the reference layout.",
            ),
            "templates": Listing(
                Object(
                    {
                        "category": Text(),
                        "yaw_deg": Number(DEGREES, default=0.0),
                        "size_whd": Numbers(3, _LONG, "3 positive numbers in metres, from 1e-6 to 1e6"),
                    }
                ),
                default=(),
                about="At most one example of each category, which detections are compared with when boxes "
                "are taken along the world's axes.",
            ),
            "camera_path": Object(
                {
                    "closed": Flag(default=False),
                    "bezier_points": Listing(
                        _POINT,
                        least=4,
                        words="a list of 4, 7, 10, ... [x, z] in metres",
                        about="Anchor, control, control, anchor, ... of cubic curves.",
                    ),
                    "polyline": Listing(
                        _POINT, default=None, about="The same curve sampled; not needed, not used."
                    ),
                },
                default=None,
            ),
            "camera": Object(
                {
                    **_VIEW,
                    "speed_m_s": Number(SPEED, default=1.0),
                    "speed": Number(Limits(1e-9, 1e9, ""), default=None, about="The same in `units`."),
                },
                UP_AND_DOWN,
                (_ONE_RANGE, ("speed_m_s", "speed")),
                default=None,
            ),
            "weights": Object(
                {"translation": Number(WEIGHT), "rotation": Number(WEIGHT, default=1.0)},
                default=None,
                about="Of the translation and rotation costs; 0.36 times the square root of the area, and 1, "
                "if left out.",
            ),
            "symmetry_deg": Named(
                Number(_TURN),
                default=None,
                about="For categories that look the same when turned: by how much, 0 for those without any "
                "heading.",
            ),
        },
        exclusive=(("size_m", "size", "bounds"),),
        notes=True,
        about="A place and the labelled objects in it: a room [0, w] x [0, d], any bounds, or none. Metres "
        "and degrees; x right, z forward, y up; yaw clockwise seen from above, 0 facing +z; where `frame` "
        "and `units` do not say otherwise.",
    ),
    SceneError,
)
"""What a scene file holds."""


def _seen_from() -> Object:
    """A camera: its place and heading, by numbers or in space, and what it sees."""
    headings = ("yaw_deg", "yaw_rad", "quaternion")
    placed = [(*place, turn) for place in _PLACED[:2] for turn in headings]
    return Object(
        {
            **_POSE,
            "pitch_deg": Number(DEGREES, default=0.0, about="Upwards."),
            **_VIEW,
        },
        UP_AND_DOWN,
        (_ONE_TURN, *_ONE_PLACE, _ONE_RANGE, ("quaternion", "pitch_deg"), ("matrix", "pitch_deg")),
        (*placed, ("matrix",)),
    )


_IDENTITY: dict[str, Any] = {
    "id": Text(default=None, about="Different for each; its place in the list if left out."),
    "track_id": OrNull(
        Text(), "a name", default=None, about="What a tracker calls it, the same in the next snapshot."
    ),
}

_TRUSTED: dict[str, Kind] = {
    "covariance": Either(
        (
            Rows((3, 3), FINITE, "3 rows of 3 numbers"),
            Numbers(36, FINITE, "36 numbers"),
        ),
        "3 rows of 3 numbers, of x, z (y in ros) and yaw, or the 36 of a geometry_msgs/PoseWithCovariance",
        default=None,
        about="Of the errors of x, z (y in ros) and yaw, in `units` and radians; or of x, y, z and the "
        "turns about them, 6 by 6 by rows, as in ROS. Zeros, or left out: not known.",
    ),
    "visible": Number(SHARE, default=1.0, about="Share that is seen of what would be, were it alone."),
    "runner_up": OrNull(
        Object(
            {
                "yaw_deg": Number(DEGREES, default=None),
                "yaw_rad": _YAW_RAD,
                "probability": Number(Limits(0.0, 0.5, "")),
            },
            exclusive=(("yaw_deg", "yaw_rad"),),
            either=(("yaw_deg",), ("yaw_rad",)),
        ),
        "an object with yaw_deg and probability",
        default=None,
        about="The second most probable heading, where there is one.",
    ),
}

SNAPSHOT = Document(
    "snapshot",
    Object(
        {
            **_WORLD,
            "timestamp": Number(TIME, default=None, about="Seconds from any moment."),
            "camera": _seen_from(),
            "detections": Listing(
                _posed(
                    {
                        **_IDENTITY,
                        "category": _CATEGORY,
                        "size_whd": _SIZE,
                        "confidence": Number(SHARE, default=1.0, about="The detector's confidence."),
                        **_TRUSTED,
                    }
                )
            ),
        },
        notes=True,
        about="One camera and what it detected, without identities. Metres and degrees; x right, z forward, "
        "y up; yaw clockwise seen from above, 0 facing +z; where `frame` and `units` do not say otherwise.",
    ),
    SnapshotError,
)
"""What a snapshot file holds."""

_PIXEL = Limits(-1e6, 1e6, "")

CAMERA = Document(
    "camera",
    Object(
        {
            **_WORLD,
            "camera": _seen_from(),
            "intrinsics": Object(
                {
                    "fx": Number(Limits(1.0, 1e6, ""), about="Focal length along rows, pixels."),
                    "fy": Number(Limits(1.0, 1e6, ""), about="Along columns."),
                    "cx": Number(_PIXEL, about="Column of the line of sight; the first pixel's middle is 0."),
                    "cy": Number(_PIXEL, about="Its row."),
                    "width": Whole(1, 16384),
                    "height": Whole(1, 16384),
                    "distortion": Either(
                        tuple(Numbers(n, Limits(-1e3, 1e3, ""), "numbers") for n in (4, 5, 8)),
                        "a list of 4, 5 or 8 numbers: k1, k2, p1, p2, k3, k4, k5, k6 as OpenCV has them",
                        default=(0.0, 0.0, 0.0, 0.0),
                    ),
                }
            ),
            **{
                name: Anything(default=None, about="Of a rendered image and its truth; not read.")
                for name in ("image", "objects")
            },
        },
        notes=True,
        about="The camera of an image: where it was, as in a snapshot, and its intrinsics, as OpenCV has "
        "them. Things stand on the plane at height 0.",
    ),
    SnapshotError,
)
"""What a camera file holds."""
