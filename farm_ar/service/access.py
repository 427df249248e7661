"""Who may ask: the token, and pages of other origins."""

from __future__ import annotations

import hmac
import math
import secrets
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from urllib.parse import SplitResult, urlsplit

from farm_ar.errors import OptionError
from farm_ar.service.refusals import NO_TOKEN, TOO_MANY, RefusedError

FORBIDDEN = 403

LEAST_TOKEN = 12
"""Characters of a token that somebody chose."""

LOOPBACK = ("127.0.0.1", "localhost", "::1")

MOST_GUESSES, GUESSES_S = 20, 60.0
"""Wrong tokens that one address may send within so many seconds; then it is not heard until they are over."""

MOST_ADDRESSES = 1000
"""Addresses of which wrong tokens are counted; of more, those that began first are forgotten."""


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


class Guesses:
    """How many wrong tokens came from each address of late.

    Args:
        clock: seconds from any moment.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._wrong: dict[str, tuple[int, float]] = {}

    def add(self, address: str) -> None:
        """Count one more from an address."""
        count, since = self._wrong.get(address, (0, self._clock()))
        self._wrong[address] = count + 1, since
        for old in list(self._wrong)[:-MOST_ADDRESSES]:
            del self._wrong[old]

    def check(self, address: str) -> None:
        """See that not too many came from an address.

        Raises:
            RefusedError: too many did; nothing that it sends counts for a while, not even the right token.
        """
        count, since = self._wrong.get(address, (0, 0.0))
        left = since + GUESSES_S - self._clock()
        if count and left <= 0:
            del self._wrong[address]
        elif count >= MOST_GUESSES:
            expected = f"must not be guessed: come again in {math.ceil(left)} s"
            raise RefusedError(TOO_MANY, "Authorization", expected, f"{count} wrong tokens", math.ceil(left))


@dataclass(frozen=True)
class Access:
    """Who may ask.

    Args:
        token: that each request must have; None for no token, on loopback only.
        origins: of pages that may ask, beside the service's own.
        guesses: the wrong tokens that came.
    """

    token: str | None = None
    origins: Collection[str] = ()
    guesses: Guesses = field(default_factory=Guesses, repr=False, compare=False)

    def check(self, headers: Mapping[str, str], query: Mapping[str, str], address: str | None = None) -> None:
        """See that a request may be answered.

        A page of another origin may not ask, even on loopback, nor may one that took the service's address
        for its own name's.

        Args:
            headers: of the request, names in small letters.
            query: where a token may be, too, since browsers give WebSockets no headers.
            address: from which it came; None where wrong tokens are not counted.

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
        if address is not None:
            self.guesses.check(address)
        kind, _, given = headers.get("authorization", "").partition(" ")
        if kind.lower() != "bearer":
            given = query.get("token", "")
        if not hmac.compare_digest(given.encode(), self.token.encode()):
            if given and address is not None:
                self.guesses.add(address)
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
