"""The page of `farm-ar play`: whether it can be shown, serving it, and `farm-ar web export`."""

from __future__ import annotations

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
        print_line("There is no display for the page, so type the moves")
        return False
    return True


def serve_page(seed: int, reid: str, port: int, open_browser: bool = True) -> None:
    """Serve the game's page on this machine until Ctrl-C."""
    from farm_ar.cli.output import print_line, progress
    from farm_ar.errors import known_name
    from farm_ar.service.network import listening
    from farm_ar.service.running import run
    from farm_ar.web.app import make_web_app
    from farm_ar.web.game import METHODS, Game

    known_name("reid", reid, METHODS)
    at = listening("127.0.0.1", port)
    with progress("Setting up the table"):
        Game(seed, reid).step()  # compiles what is not compiled
    link = f"http://127.0.0.1:{at.getsockname()[1]}/"

    def announce() -> None:
        print_line(f"Play at {link} (Ctrl-C ends it)")
        if open_browser:
            webbrowser.open(link)

    run(make_web_app(seed=seed, reid=reid), at, announce)
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
) -> None:
    """Write a page that any host serves: the demonstrations and episodes, to watch with a scrubber.

    Nothing is fetched from anywhere else. To look at it here: python -m http.server --directory DIR
    """
    from farm_ar.cli.options import make_folder
    from farm_ar.cli.output import print_line, progress
    from farm_ar.envs import load_trace
    from farm_ar.web.export import export as write

    episodes = {path.stem: load_trace(path) for path in traces or []}
    make_folder("DIR", folder)
    with progress("Recording") as report:
        written = write(folder, episodes, lambda share: report("Recording", share))
    print_line(f"Wrote {folder / 'index.html'} and {len(written) - 1} more files")
