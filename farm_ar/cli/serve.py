"""`farm-ar serve` and what belongs to it: the service, recordings of it, and vectors for its clients."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farm_ar.cli.options import Seed, check_file, make_folder, whole, writing

if TYPE_CHECKING:
    from farm_ar.service.images import Eye
    from farm_ar.service.network import Certificate

PORT = 8765

Meshes = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER", help="Take images, too, and find these: a mesh named after each category."
    ),
]
Estimator = Annotated[
    str,
    typer.Option(metavar="NAME", help="With --meshes, finds poses: network, or module:Class of your own."),
]


def serve(
    port: Annotated[
        int, typer.Option(metavar="N", parser=whole(0, 65535), help="Port; 0 for any that is free.")
    ] = PORT,
    state: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Where sessions are kept; ~/.local/state/farm-ar by default ($XDG_STATE_HOME).",
        ),
    ] = None,
    lan: Annotated[
        bool,
        typer.Option(
            "--lan", help="Serve the local network, too: with TLS and a token. Else this machine only."
        ),
    ] = False,
    token: Annotated[
        str | None,
        typer.Option(metavar="TEXT", help="The token, a new one each time by default; $FARM_AR_TOKEN, too."),
    ] = None,
    cert: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A certificate in PEM, in place of our own; with --key."),
    ] = None,
    key: Annotated[Path | None, typer.Option(metavar="FILE", help="Its key in PEM.")] = None,
    cors: Annotated[
        list[str] | None,
        typer.Option(metavar="ORIGIN", help="Pages that may ask, as https://app.example; may be repeated."),
    ] = None,
    meshes: Meshes = None,
    estimator: Estimator = "network",
    record: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Keep what is asked and answered, for serve-replay."),
    ] = None,
) -> None:
    """Serve re-identification to apps: Unity, browsers, Python.

    docs/headset.md shows every request. The page at / shows sessions, /docs the requests. Ctrl-C ends it.
    """
    from farm_ar.cli.output import print_line, progress
    from farm_ar.service.access import Access, check_token, new_token
    from farm_ar.service.app import make_app
    from farm_ar.service.network import listening
    from farm_ar.service.recordings import Recorder
    from farm_ar.service.server import run
    from farm_ar.service.service import Service
    from farm_ar.service.store import Store
    from farm_ar.service.warmup import warm_up

    folder = state or state_folder()
    make_folder("--state", folder)
    token = token or os.environ.get("FARM_AR_TOKEN") or (new_token() if lan else None)
    if token is not None:
        check_token(token)
    tls, address = certificate_for(folder, lan, cert, key)
    if record is not None:
        make_folder("--record", record)
    at = listening("0.0.0.0" if lan else "127.0.0.1", port)
    store = Store(folder / "sessions.sqlite")
    recorder = None if record is None else Recorder(record)
    service = Service(store, recorder=recorder, eye=_eye(meshes, estimator))
    with progress("Loading the methods"):
        warm_up()
    origin = f"{'http' if tls is None else 'https'}://{address}:{at.getsockname()[1]}"

    def announce() -> None:
        _announce(origin, folder, record, token, tls, lan)

    run(make_app(service, Access(token, tuple(cors or ()))), at, announce, tls, service.limits)
    print_line("Stopped; what was confirmed is kept")


def _announce(
    origin: str, folder: Path, record: Path | None, token: str | None, tls: Certificate | None, lan: bool
) -> None:
    """Print where the service is, and what is needed to reach it."""
    from farm_ar.cli.output import print_line
    from farm_ar.service.network import qr_code

    link = f"{origin}/" + (f"#token={token}" if token else "")
    print_line(f"Serving on {origin} (Ctrl-C ends it)")
    print_line(f"Look at sessions: {link}")
    print_line(f"Sessions are kept in {folder}")
    if record is not None:
        print_line(f"Recording into {record}")
    if token:
        print_line(f"Token: {token}")
    if tls is not None:
        print_line(f"Certificate: {tls.certificate}, SHA-256 {tls.pin}")
    if lan:
        typer.echo(qr_code(link))


def serve_replay(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="What serve --record has written.")],
    meshes: Meshes = None,
    estimator: Estimator = "network",
) -> None:
    """Play the requests of a recording again; the exit code is 1 if an answer differs."""
    from farm_ar.cli.output import print_line
    from farm_ar.service.recordings import replay

    number = 0
    different = 0
    for played in replay(folder, _eye(meshes, estimator)):
        number += 1
        if played.difference is not None:
            different += 1
            print_line(f"{played.session}, request {played.number} ({played.action}): {played.difference}")
    print_line(f"{number} requests, " + (f"{different} answered differently" if different else "bit-exact"))
    if different:
        raise typer.Exit(1)


def conformance_vectors(
    out: Annotated[Path, typer.Option(metavar="FILE", help="Where they go, as JSON.")] = Path(
        "conformance-vectors.json"
    ),
    number: Annotated[int, typer.Option(metavar="N", parser=whole(1, 100_000), help="How many.")] = 500,
    seed: Seed = 0,
) -> None:
    """Write snapshots with the paper's method's answers, for clients that carry the method out themselves."""
    import json

    import numpy as np

    from farm_ar.cli.output import print_line
    from farm_ar.scenes.files import write_text
    from farm_ar.service.vectors import VERSION, vectors

    check_file("--out", out)
    lines = [json.dumps(one, allow_nan=False) for one in vectors(np.random.default_rng(seed), number)]
    whole_text = ",\n".join(lines)
    with writing("--out", out):
        write_text(out, f'{{"version": {VERSION}, "vectors": [\n{whole_text}\n]}}\n')
    print_line(f"Wrote {number} snapshots with answers to {out}")


def _eye(meshes: Path | None, estimator: str) -> Eye | None:
    """What finds things in images, if it was asked for."""
    from farm_ar.service.images import Eye

    return None if meshes is None else Eye.of(meshes, estimator)


def state_folder() -> Path:
    """Where sessions and the certificate are kept."""
    given = os.environ.get("XDG_STATE_HOME")
    return (Path(given) if given else Path.home() / ".local" / "state") / "farm-ar"


def certificate_for(
    folder: Path, lan: bool, cert: Path | None = None, key: Path | None = None
) -> tuple[Certificate | None, str]:
    """The certificate, or None for plain HTTP; and the address."""
    from farm_ar.errors import OptionError
    from farm_ar.service.network import Certificate, check_pair, lan_address, pin_of, self_signed

    if (cert is None) != (key is None):
        raise OptionError("--key", "must be given with --cert, and the other way round", str(key or cert))
    address = lan_address() if lan else "127.0.0.1"
    if cert is not None and key is not None:
        check_pair(cert, key)
        return Certificate(cert, key, pin_of(cert)), address
    return self_signed(folder, address) if lan else None, address
