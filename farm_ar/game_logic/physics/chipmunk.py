"""A narrow bridge to Chipmunk, the physics inside pymunk: its C functions for Python and compiled code alike.

pymunk drives Chipmunk through cffi, at a microsecond or so a call: many times what a step of a small space
takes. Here the same C functions, from pymunk's own library, can also be called by what Numba compiles, at
the price of a function call. Objects are passed as their addresses, vectors as two numbers.

How: the functions' addresses are made known to LLVM by name, so that compiled code which Numba keeps on disk
finds them in the next process, too. Each is declared by what pymunk's cffi says that it takes and returns;
nothing but pointers, ints, doubles, `cpVect`, a struct of two doubles, and `cpShapeFilter`, one of an address
and two ints, is understood. By the calling conventions of 64-bit x86 and ARM, but not of Windows, the former
travels like two doubles, the latter like two addresses. Where that does not hold, `BRIDGED` is false,
`compiled` leaves functions as they are, and the same code runs in Python, through cffi, to the same bytes.

Nobody outside this package needs to know of this. Whoever makes an object here has to free it.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from typing import Any, TypeVar

import llvmlite.binding  # type: ignore[import-untyped]
import numba
from llvmlite import ir
from numba.core import cgutils
from numba.core.typing import templates
from numba.extending import lower_builtin
from pymunk._chipmunk_cffi import ffi, lib

from farm_ar import kernels

Function = TypeVar("Function", bound=Callable[..., Any])

BRIDGED = os.name == "posix" and platform.machine().lower() in ("x86_64", "amd64", "aarch64", "arm64")
"""Whether compiled code can call Chipmunk."""

_DOUBLE, _ADDRESS = ir.DoubleType(), ir.IntType(64)
_VECTOR = ir.LiteralStructType([_DOUBLE, _DOUBLE])

_WHOLE = {"pointer": 1, "int": 1, "struct cpShapeFilter": 2, "double": 0, "struct cpVect": 0}
_BROKEN = {"pointer": 0, "int": 0, "struct cpShapeFilter": 0, "double": 1, "struct cpVect": 2}
"""By what a function takes: as how many addresses and as how many doubles that travels."""


def compiled(function: Function) -> Function:
    """The function, compiled if what it calls can be called from compiled code."""
    return kernels.compiled(function) if BRIDGED else function


def address(thing: Any) -> int:
    """The address of an object or a function of Chipmunk, from cffi's pointer to it."""
    return int(ffi.cast("intptr_t", thing))


def _kind(ctype: Any) -> str:
    kind = str(ctype.kind if ctype.kind in ("pointer", "void") else ctype.cname)
    if kind != "void" and kind not in _WHOLE:
        raise ImportError(f"pymunk's Chipmunk takes or returns {ctype.cname}, which farm-ar does not know")
    return kind


def foreign(name: str) -> Callable[..., Any]:
    """One of Chipmunk's functions, to be called from Python, and by its global name from compiled code.

    Args:
        name: of the C function; its arguments become an int for each pointer, two floats for each vector,
            and 0 and what `touches` gives for each filter.

    Raises:
        ImportError: it takes or returns something else.
    """
    function, form = getattr(lib, name), ffi.typeof(getattr(lib, name))
    takes, returns = [_kind(argument) for argument in form.args], _kind(form.result)

    def call(*values: float) -> Any:
        rest, arguments = list(values), []
        for argument, kind in zip(form.args, takes, strict=True):
            if kind == "pointer":
                arguments.append(ffi.cast(argument, int(rest.pop(0))))
            elif kind == "struct cpVect":
                arguments.append((rest.pop(0), rest.pop(0)))
            elif kind == "struct cpShapeFilter":
                group, both = int(rest.pop(0)), int(rest.pop(0))
                arguments.append((group, both & 0xFFFFFFFF, both >> 32 & 0xFFFFFFFF))
            else:
                arguments.append(rest.pop(0))
        result = function(*arguments)
        if returns == "pointer":
            return address(result)
        return (result.x, result.y) if returns == "struct cpVect" else result

    if BRIDGED:
        declare(call, f"farm_ar_{name}", takes, returns)
        llvmlite.binding.add_symbol(f"farm_ar_{name}", address(ffi.addressof(lib, name)))
    return call


def declare(call: Callable[..., Any], symbol: str, takes: list[str], returns: str) -> None:
    """Tell Numba how to type and to call a function that is linked by its symbol."""
    # Numba's own types are not declared.
    types: Any = numba.types
    typing: Any = templates
    lowering: Any = lower_builtin
    building: Any = cgutils
    number, pointer = types.float64, types.int64
    low = {"void": ir.VoidType(), "pointer": _ADDRESS, "double": _DOUBLE, "struct cpVect": _VECTOR}
    high = {
        "void": types.none,
        "pointer": pointer,
        "double": number,
        "struct cpVect": types.UniTuple(number, 2),
    }
    arguments: list[Any] = []
    for kind in takes:
        arguments += [pointer] * _WHOLE[kind] + [number] * _BROKEN[kind]
    form = ir.FunctionType(low[returns], [_ADDRESS if one is pointer else _DOUBLE for one in arguments])

    cases = [typing.signature(high[returns], *arguments)]
    template = type(symbol, (templates.ConcreteTemplate,), {"key": call, "cases": cases})
    typing.infer_global(call, types.Function(template))

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        function = building.get_or_insert_function(builder.module, form, symbol)
        result = builder.call(function, values)
        if returns == "void":
            return context.get_dummy_value()
        if returns == "struct cpVect":
            parts = [builder.extract_value(result, 0), builder.extract_value(result, 1)]
            return context.make_tuple(builder, sig.return_type, parts)
        return result

    lowering(call, *arguments)(lower)


@kernels.compiled
def touches(categories: int, others: int) -> int:
    """A filter's second half: what a shape is, and which others it collides with (-1 for any), as bits."""
    return categories | others << 32


new_space, free_space = foreign("cpSpaceNew"), foreign("cpSpaceFree")
set_damping, set_iterations = foreign("cpSpaceSetDamping"), foreign("cpSpaceSetIterations")
set_slop, set_bias = foreign("cpSpaceSetCollisionSlop"), foreign("cpSpaceSetCollisionBias")
set_sleep_time = foreign("cpSpaceSetSleepTimeThreshold")
set_sleep_speed = foreign("cpSpaceSetIdleSpeedThreshold")
step_space, static_body = foreign("cpSpaceStep"), foreign("cpSpaceGetStaticBody")
new_body, new_static_body = foreign("cpBodyNew"), foreign("cpBodyNewStatic")
new_kinematic_body, free_body = foreign("cpBodyNewKinematic"), foreign("cpBodyFree")
moment_of_box = foreign("cpMomentForBox")
new_box, new_circle = foreign("cpBoxShapeNew"), foreign("cpCircleShapeNew")
new_polygon, free_shape = foreign("cpPolyShapeNewRaw"), foreign("cpShapeFree")
set_friction, set_filter = foreign("cpShapeSetFriction"), foreign("cpShapeSetFilter")
add_body, remove_body = foreign("cpSpaceAddBody"), foreign("cpSpaceRemoveBody")
add_shape, remove_shape = foreign("cpSpaceAddShape"), foreign("cpSpaceRemoveShape")
add_constraint, remove_constraint = foreign("cpSpaceAddConstraint"), foreign("cpSpaceRemoveConstraint")
new_pivot_joint, new_gear_joint = foreign("cpPivotJointNew2"), foreign("cpGearJointNew")
set_max_force, set_max_bias = foreign("cpConstraintSetMaxForce"), foreign("cpConstraintSetMaxBias")
free_constraint = foreign("cpConstraintFree")
activate = foreign("cpBodyActivate")
get_position, set_position = foreign("cpBodyGetPosition"), foreign("cpBodySetPosition")
get_angle, set_angle = foreign("cpBodyGetAngle"), foreign("cpBodySetAngle")
get_velocity, set_velocity = foreign("cpBodyGetVelocity"), foreign("cpBodySetVelocity")
get_spin, set_spin = foreign("cpBodyGetAngularVelocity"), foreign("cpBodySetAngularVelocity")
local_to_world, world_to_local = foreign("cpBodyLocalToWorld"), foreign("cpBodyWorldToLocal")
get_velocity_at = foreign("cpBodyGetVelocityAtLocalPoint")
