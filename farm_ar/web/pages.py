"""The files of the page itself on HTTP: its document, program and models."""

from __future__ import annotations

from importlib.resources import files

from farm_ar.rendering.models import MODELS
from farm_ar.service.refusals import missing_package

try:
    from fastapi import FastAPI, Response
except ImportError:
    raise missing_package("fastapi") from None

POLICY = "default-src 'self'; img-src 'self' data: blob:; connect-src 'self' blob: ws: wss:"
"""What the page may load: nothing from elsewhere."""

PAGES = {
    "": ("index.html", "text/html"),
    "play.js": ("play.js", "text/javascript"),
    "style.css": ("style.css", "text/css"),
}


def add_files(app: FastAPI) -> None:
    """Serve the page itself, and the models; after all other routes."""
    static, models = files("farm_ar.web") / "static", files("farm_ar.rendering") / "models"

    @app.get("/{name}", include_in_schema=False)
    async def page(name: str) -> Response:
        if name not in PAGES:
            return Response("not found", 404)
        file, kind = PAGES[name]
        head = {"Content-Security-Policy": POLICY, "Cache-Control": "no-cache"}
        return Response((static / file).read_bytes(), headers=head, media_type=kind)

    @app.get("/", include_in_schema=False)
    async def index() -> Response:
        return await page("")

    @app.get("/models/{name}.glb", include_in_schema=False)
    async def shape(name: str) -> Response:
        if name not in MODELS:
            return Response("not found", 404)
        return Response((models / f"{name}.glb").read_bytes(), media_type="model/gltf-binary")
