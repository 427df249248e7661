"""Who may ask: the token, and pages of other origins."""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from urllib.parse import SplitResult, urlsplit

from farm_ar.errors import OptionError
from farm_ar.service.refusals import NO_TOKEN, RefusedError

FORBIDDEN = 403

LEAST_TOKEN = 12
"""Characters of a token that somebody chose."""

LOOPBACK = ("127.0.0.1", "localhost", "::1")


def new_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_urlsafe(24)


def check_token(token: str) -> None:
    """See that a token is one that a header can carry, and that takes long to guess.

    Raises:
        OptionError: it is not.
    """
    if len(token) < LEAST_TOKEN or not token.isascii() or not token.isprintable() or " " in token:
        expected = f"must be at least {LEAST_TOKEN} letters, digits and signs of ASCII, without a blank"
        raise OptionError("--token", expected, f"{len(token)} characters")


@dataclass(frozen=True)
class Access:
    """Who may ask.

    Args:
        token: that each request must have; None for no token, on loopback only.
        origins: of pages that may ask, beside the service's own.
    """

    token: str | None = None
    origins: Collection[str] = ()

    def check(self, headers: Mapping[str, str], query: Mapping[str, str]) -> None:
        """See that a request may be answered.

        A page of another origin may not ask, even on loopback, nor may one that took the service's address
        for its own name's.

        Args:
            headers: of the request, names in small letters.
            query: where a token may be, too, since browsers give WebSockets no headers.

        Raises:
            RefusedError: it may not.
        """
        origin, host = headers.get("origin"), headers.get("host", "")
        if origin is not None and origin not in self.origins and _parts(origin, "Origin").netloc != host:
            raise RefusedError(FORBIDDEN, "Origin", "must be the service's own, or named by --cors", origin)
        if self.token is None:
            if _parts(f"//{host}", "Host").hostname not in LOOPBACK:
                raise RefusedError(FORBIDDEN, "Host", f"must be one of {', '.join(LOOPBACK)}", host)
            return
        kind, _, given = headers.get("authorization", "").partition(" ")
        if kind.lower() != "bearer":
            given = query.get("token", "")
        if not hmac.compare_digest(given.encode(), self.token.encode()):
            raise RefusedError(
                NO_TOKEN, "Authorization", "must be Bearer and the token that was printed", "another"
            )


def _parts(address: str, header: str) -> SplitResult:
    """An address taken apart.

    Raises:
        RefusedError: it is none.
    """
    try:
        return urlsplit(address)
    except ValueError:
        raise RefusedError(FORBIDDEN, header, "must be an address", address) from None
