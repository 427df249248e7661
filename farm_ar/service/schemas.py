"""The OpenAPI description: what each request is for, what it takes, and what it is answered."""

from __future__ import annotations

from typing import Any

from farm_ar.scenes import WORLD_FRAMES
from farm_ar.scenes.declarations import CAMERA, SCENE, SNAPSHOT
from farm_ar.scenes.documents import Document, Listing
from farm_ar.service.methods import DEFAULT, OPTIONS
from farm_ar.service.wire import BESIDE, CONFIRM, REVISION, SESSION_NAME, UNDO

Values = dict[str, Any]

_WORDS = {
    "sessions": ("The sessions", "Their names."),
    "layout": (
        "Begin a session with a layout",
        "Fields of a scene file, and the method. A session that exists is replaced if its revision is given.",
    ),
    "snapshots": (
        "Identify what was seen",
        "Fields of a snapshot file; or `snapshots`, several of them between which nothing moved.",
    ),
    "align": (
        "Find the frame of the snapshots",
        "From what stands where it stood, or from an anchor: one pose that is known in both frames.",
    ),
    "confirm": ("Confirm the labels of the last snapshot", "With corrections; it becomes the layout."),
    "undo": ("Take back the last decision", "An alignment or a confirmation; again for the one before."),
    "state": ("All that is known", "The layout, what is lost, the last answer, and what was decided."),
    "image": ("The last image", "As it came, to be looked at."),
    "delete": ("Forget a session", "And all that was stored of it."),
}


def path_of(name: str) -> dict[str, str]:
    """Summary and description of a request."""
    summary, description = _WORDS[name]
    return {"summary": summary, "description": description}


def bodies(name: str, most_text: int) -> Values:
    """What FastAPI does not know of a request: its parameters and its body.

    Args:
        name: of the request.
        most_text: characters of a string in the body.
    """
    extra: Values = {"parameters": []}
    if name != "sessions":
        pattern = f"^{SESSION_NAME.pattern}$"
        schema: Values = {"type": "string", "pattern": pattern}
        extra["parameters"].append({"name": "name", "in": "path", "required": True, "schema": schema})
    if name == "state":
        schema = {"enum": list(WORLD_FRAMES), "default": "unity"}
        extra["parameters"].append({"name": "frame", "in": "query", "schema": schema})
    taken = {
        "layout": _layout_schema,
        "snapshots": _snapshot_schema,
        "align": _align_schema,
        "confirm": CONFIRM.top.schema,
        "undo": UNDO.top.schema,
    }
    if name in taken:
        content: Values = {"application/json": {"schema": _short(taken[name](), most_text)}}
        if name == "snapshots":
            content["multipart/form-data"] = {"schema": _image_schema()}
        extra["requestBody"] = {"required": True, "content": content}
    return extra


def _layout_schema() -> dict[str, Any]:
    """The JSON Schema of a layout's body."""
    rule = _framed(SCENE)
    methods = {"enum": sorted(OPTIONS), "default": DEFAULT, "description": "Which method identifies."}
    either = [kind.schema() for _, kind in sorted(OPTIONS.items())]
    revision = {
        **REVISION.schema(),
        "description": "Of the session that is replaced; needed if it exists.",
    }
    rule["properties"] |= {
        "method": methods,
        "options": {"anyOf": either, "description": "Of the method; each has others."},
        **{name: kind.schema() for name, kind in BESIDE.items()},
        "revision": revision,
    }
    return rule


def _snapshot_schema() -> dict[str, Any]:
    """The JSON Schema of a snapshot's body."""
    many = {
        "type": "object",
        "required": ["snapshots"],
        "additionalProperties": False,
        "properties": {"snapshots": {"type": "array", "minItems": 1, "items": _framed(SNAPSHOT)}},
        "description": "Several snapshots between which nothing moved, to be fused.",
    }
    return {"anyOf": [_framed(SNAPSHOT), many]}


def _image_schema() -> dict[str, Any]:
    """The JSON Schema of a body with an image."""
    camera = _framed(CAMERA)
    camera["properties"]["timestamp"] = {"type": "number", "description": "Seconds from any moment."}
    image = {"type": "string", "format": "binary", "description": "PNG or JPEG."}
    return {
        "type": "object",
        "required": ["camera", "image"],
        "properties": {"camera": camera, "image": image},
        "description": "An image and its camera, where the service was started with --meshes.",
    }


def _align_schema() -> dict[str, Any]:
    """The JSON Schema of the body of an alignment."""
    rule = _framed(SNAPSHOT)
    pose = Listing(SNAPSHOT.top.fields["detections"].kind).kind.schema()  # type: ignore[attr-defined]
    known = ("x", "y", "z", "yaw_deg", "yaw_rad", "quaternion", "matrix")
    pose = {**pose, "properties": {name: pose["properties"][name] for name in known}}
    rule["properties"] |= {
        "anchor": {
            "type": "object",
            "required": ["here", "map"],
            "additionalProperties": False,
            "properties": {"here": pose, "map": pose},
            "description": "One pose that is known in the snapshots' frame and in the map's, say a marker's.",
        },
        "revision": REVISION.schema(),
    }
    rule["required"] = ["frame", "revision"]
    rule["anyOf"] = [{"required": ["camera", "detections"]}, {"required": ["anchor"]}]
    return rule


def _framed(document: Document) -> dict[str, Any]:
    rule = document.top.schema()
    frame = {name: value for name, value in rule["properties"]["frame"].items() if name != "default"}
    return {
        **rule,
        "required": [*rule["required"], "frame"],
        "properties": {**rule["properties"], "frame": frame},
    }


def _short(rule: Any, most: int) -> Any:
    """A JSON Schema in which strings and the names of fields have at most so many characters."""
    if isinstance(rule, list):
        return [_short(one, most) for one in rule]
    if not isinstance(rule, dict):
        return rule
    short = {name: _short(one, most) for name, one in rule.items()}
    if rule.get("type") == "string":
        short["maxLength"] = most
    if isinstance(rule.get("additionalProperties"), dict):
        short["propertyNames"] = {"maxLength": most}
    return short


def _object(**properties: Values) -> Values:
    return {"type": "object", "required": list(properties), "properties": properties}


def _or_null(kind: Values) -> Values:
    return {"anyOf": [{"type": "null"}, kind]}


def _list(kind: Values) -> Values:
    return {"type": "array", "items": kind}


_TEXT: Values = {"type": "string"}
_NUMBER: Values = {"type": "number"}
_WHOLE: Values = {"type": "integer"}
_FLAG: Values = {"type": "boolean"}
_POINT = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_TURN = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object(position=_POINT, orientation=_or_null(_TURN))
_HEADER = _object(stamp=_or_null(_NUMBER), frame_id={"enum": list(WORLD_FRAMES)})
_HEAD = {"header": _HEADER, "session": _TEXT, "revision": _WHOLE}
_DETECTION = _object(
    detection=_TEXT,
    track_id=_or_null(_TEXT),
    id=_or_null(_TEXT),
    reason=_or_null(_TEXT),
    confidence=_or_null(_NUMBER),
    margin=_or_null(_NUMBER),
    cost=_or_null(_NUMBER),
    alternatives=_list(_object(id=_or_null(_TEXT), confidence=_or_null(_NUMBER))),
)
_REPLIES: dict[str, Values] = {
    "sessions": _object(sessions=_list(_TEXT)),
    "layout": _object(
        session=_TEXT, revision=_WHOLE, method=_TEXT, options={"type": "object"}, objects=_WHOLE
    ),
    "snapshots": _object(
        **_HEAD,
        snapshot=_TEXT,
        detections=_list(_DETECTION),
        missing=_list(_TEXT),
        new=_list(_TEXT),
        warnings=_list(_TEXT),
        solve_ms=_NUMBER,
    ),
    "align": _object(
        **_HEAD,
        aligned=_FLAG,
        confidence=_NUMBER,
        ambiguous=_FLAG,
        reason=_or_null(_TEXT),
        origin=_or_null(_POSE),
    ),
    "confirm": _object(**_HEAD, doubted=_list(_TEXT), lost=_list(_TEXT)),
    "undo": _object(**_HEAD, undone={"type": "object"}, lost=_list(_TEXT)),
    "state": _object(
        **_HEAD,
        method=_TEXT,
        options={"type": "object"},
        objects=_list({"type": "object"}),
        bounds=_or_null(_list(_POINT)),
        origin=_or_null(_POSE),
        lost=_list(_TEXT),
        snapshot=_or_null(_TEXT),
        last=_or_null({"type": "object"}),
        view=_or_null({"type": "object"}),
        history=_list({"type": "object"}),
        final=_WHOLE,
        image=_FLAG,
    ),
    "delete": _object(session=_TEXT, deleted=_FLAG),
}
_ERROR = _object(error=_object(field=_TEXT, expected=_TEXT, got=_TEXT, message=_TEXT))

REFUSED: dict[int | str, Values] = {
    status: {"description": words, "content": {"application/json": {"schema": _ERROR}}}
    for status, words in {
        400: "The body is not JSON",
        401: "The token is missing or wrong",
        403: "A page of another origin may not ask",
        404: "There is no such session",
        408: "The body did not arrive in time",
        409: "It was decided on an older state: get the state, and decide again",
        413: "Too large, or too many",
        422: "A value cannot be used: `field` says which, `expected` what would be right",
        429: "Too many at once: come again",
        503: "Not answered in time: come again",
        507: "The disk is full; nothing was changed",
    }.items()
}
"""Answers of requests that are refused, which any may be."""


def replies(name: str) -> dict[int | str, Values]:
    """The answers of a request that is not refused."""
    if name == "image":
        return {200: {"description": "The image", "content": {"image/*": {}}}}
    content = {"application/json": {"schema": _REPLIES[name]}}
    done: dict[int | str, Values] = {200: {"description": "Done", "content": content}}
    return done | ({201: {"description": "Begun", "content": content}} if name == "layout" else {})
