"""Arrays that kernels borrow: whoever calls holds them, so that their users need not be counted.

Numba counts the users of an array whenever it is taken out of a record or sliced, by a locked instruction;
where small arrays are many that is half of the time, and threads that share arrays wait for one another.
"""

from __future__ import annotations

from typing import Any, TypeVar

from numba.core import cgutils, types
from numba.extending import intrinsic, overload

Value = TypeVar("Value")

_intrinsic: Any = intrinsic
_overload: Any = overload
_null: Any = cgutils.get_null_value


def borrowed(value: Value) -> Value:
    """In kernels: the same arrays, of which nobody counts the users; alone or in tuples, also nested ones.

    Only of what was passed to a kernel that others call: its caller holds it until the kernel is over.
    """
    return value


@_overload(borrowed)  # type: ignore[untyped-decorator]
def _borrowed(value: Any) -> Any:
    def lend(value: Any) -> Any:
        return _without_owner(value)

    return lend


@_intrinsic  # type: ignore[untyped-decorator]
def _without_owner(typing: Any, value: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return _stripped(context, builder, value, values[0])

    return value(value), build


def _stripped(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """A value of a Numba type in which no array has an owner."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = _null(array.meminfo.type)
        array.parent = _null(array.parent.type)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        parts: Any = kind
        items = [
            _stripped(context, builder, part, builder.extract_value(value, k)) for k, part in enumerate(parts)
        ]
        return context.make_tuple(builder, kind, items)
    return value
