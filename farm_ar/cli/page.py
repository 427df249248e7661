"""The page of `farm-ar play`: whether it can be shown, serving it, and `farm-ar web export`."""

from __future__ import annotations

import os
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, help="The game's page.")


def can_show_page() -> bool:
    """Whether there are a display and the packages; says in a line what is missing."""
    from farm_ar.cli.output import print_line
    from farm_ar.envs.window import has_display, has_packages

    if not has_packages():
        print_line("To play on a page instead: pip install 'farm-ar[web]'")
        return False
    if not has_display():
        print_line(
            "There is no display for the page, so type the moves; to serve it: farm-ar play --port 8000"
        )
        return False
    return True


def serve_page(
    seed: int,
    reid: str,
    port: int,
    *,
    lan: bool = False,
    gallery: Path | None = None,
    show: bool = True,
    scene: str = "farm",
) -> None:
    """Serve the game's page until Ctrl-C.

    Args:
        seed: of the first game.
        reid: its re-identifier.
        port: 0 for any that is free.
        lan: whether the local network is served, too, with TLS and a token; else this machine only.
        gallery: a stress test's folder, whose failures are shown in place of those that come with farm-ar.
        show: whether a browser is opened.
        scene: the first game's: "farm", or a scene file with a fixed object.
    """
    from farm_ar.cli.options import make_folder
    from farm_ar.cli.output import print_line, progress
    from farm_ar.cli.serve import certificate_for, state_folder
    from farm_ar.errors import known_name
    from farm_ar.service.access import Access, new_token
    from farm_ar.service.network import listening, qr_code
    from farm_ar.service.server import run
    from farm_ar.web.app import make_web_app
    from farm_ar.web.gallery import read_gallery
    from farm_ar.web.game import METHODS, Game

    known_name("reid", reid, METHODS)
    scene = str(Path(scene).resolve()) if scene.endswith(".json") else scene
    failures = None if gallery is None else read_gallery(gallery)
    token = os.environ.get("FARM_AR_TOKEN") or new_token() if lan else None
    if lan:
        make_folder("state", state_folder())
    tls, address = certificate_for(state_folder(), lan)
    at = listening("0.0.0.0" if lan else "127.0.0.1", port)
    with progress("Setting up the table"):
        Game(seed, reid, scene=scene).step()  # compiles what is not compiled
    scheme, where = "http" if tls is None else "https", at.getsockname()[1]
    link = f"{scheme}://{address}:{where}/" + (f"#token={token}" if token else "")

    def announce() -> None:
        print_line(f"Play at {link} (Ctrl-C ends it)")
        if not lan and not show:
            print_line(
                f"From another machine: ssh -L {where}:127.0.0.1:{where} HOST, then open the same there"
            )
        if tls is not None:
            print_line(f"Certificate: {tls.certificate}, SHA-256 {tls.pin}")
            typer.echo(qr_code(link))
        if show:
            webbrowser.open(link)

    run(make_web_app(Access(token), seed, reid, failures, scene), at, announce, tls)
    print_line("The game is over")


@app.callback()
def _web() -> None:
    """The game's page."""


@app.command("export")
def export(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the page goes.")],
    traces: Annotated[
        list[Path] | None,
        typer.Option("--trace", metavar="FILE", help="An episode to show, too; may be repeated."),
    ] = None,
    gallery: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="A stress test's folder, in place of the failures that come along."),
    ] = None,
) -> None:
    """Write a page that any host serves: demonstrations, episodes and failures, to watch with a scrubber.

    Nothing is fetched from anywhere else. A browser does not open it as a file; to look at it here:
    python -m http.server --directory DIR
    """
    from farm_ar.cli.options import make_folder
    from farm_ar.cli.output import print_line, progress
    from farm_ar.envs import load_trace
    from farm_ar.errors import OptionError
    from farm_ar.web.export import export as write
    from farm_ar.web.gallery import read_gallery

    failures = None if gallery is None else read_gallery(gallery)
    episodes = {path.stem: load_trace(path) for path in traces or []}
    if len(episodes) < len(traces or []):
        raise OptionError("--trace", "must be files of different names", [str(path) for path in traces or []])
    make_folder("DIR", folder)
    with progress("Recording") as report:
        written = write(folder, episodes, lambda share: report("Recording", share), failures)
    print_line(f"Wrote {folder / 'index.html'} and {len(written) - 1} more files")
    print_line(f"To look at it here: python -m http.server --directory {folder}")
