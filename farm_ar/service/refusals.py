"""Why a request is refused: an HTTP status beside the usual line of field, value and what is right."""

from __future__ import annotations

from typing import Any

from farm_ar.errors import InputError, MissingPackageError

NO_JSON, NO_TOKEN, UNKNOWN_SESSION, TOO_SLOW, STALE, TOO_LARGE = 400, 401, 404, 408, 409, 413
WRONG, TOO_MANY, BUSY, DISK_FULL = 422, 429, 503, 507


class RefusedError(InputError):
    """A request that is refused.

    Args:
        status: the HTTP status.
        field: what is wrong, as in `detections[3].x`.
        expected: what would be right.
        got: what came.
        again_s: after how many seconds it may be asked again, where that would help.
    """

    def __init__(self, status: int, field: str, expected: str, got: object, again_s: int = 1) -> None:
        super().__init__(field, expected, got)
        self.status, self.again_s = status, again_s


def values_of(problem: InputError) -> dict[str, Any]:
    """The body of the answer that says what is wrong."""
    got = repr(problem.got)
    error = {
        "field": problem.field,
        "expected": problem.expected[:1000],
        "got": got if len(got) <= 120 else f"{got[:120]} ...",
        "message": str(problem),
    }
    return {"error": error}


def missing_package(package: str) -> MissingPackageError:
    """The error where a package of the extra is not installed."""
    return MissingPackageError(f"the service needs {package}: pip install 'farm-ar[service]'")
