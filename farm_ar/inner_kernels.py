"""Kernels that other kernels call: compiled as far as their callers need them, and no further.

Numba makes of every kernel, also of one that only kernels call, a function for Python and machine code of
its own, with the machine code of all that it calls within, optimised anew at every level. Here such a
kernel stays a module that is linked into its callers; the outermost one, which Python calls, is optimised and
translated once. When Python calls a kernel that is known as an inner one only, it is compiled for that too.
"""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Iterator
from typing import Any

import llvmlite.binding as llvm  # type: ignore[import-untyped]
from numba import core
from numba.core.compiler_lock import global_compiler_lock

_numba: Any = core


class Kernel(_numba.registry.CPUDispatcher):  # type: ignore[misc]
    """A compiled function; what other kernels use of it, they have from `compile_inner`."""

    def compile(self, sig: Any) -> Any:
        """Compile for a call from Python, unless it has been; the function that Python calls."""
        with global_compiler_lock, _without_collecting():
            arguments = tuple(_numba.sigutils.normalize_signature(sig)[0])
            known = self.overloads.get(arguments)
            if known is not None and isinstance(known.library, InnerLibrary):
                del self.overloads[arguments]  # callers that are compiled already hold it
            return super().compile(sig)

    def compile_inner(self, arguments: tuple[Any, ...]) -> None:
        """Compile for calls from kernels, unless it has been."""
        with global_compiler_lock:
            if arguments in self.overloads:
                return
            load = getattr(self._cache, "load_inner", None)
            result = load(arguments, self.targetctx) if load else None
            counts = self._cache_misses if result is None else self._cache_hits
            counts[arguments] += 1
            if result is None:
                details = {"dispatcher": self, "args": arguments, "return_type": None}
                with _numba.event.trigger_event("numba:compile", data=details):
                    result = self._compile_inner(arguments)
                if load:
                    self._cache.save_inner(arguments, result)
            self.targetctx.insert_user_function(result.entry_point, result.fndesc, [result.library])
            self.overloads[arguments] = result

    def _compile_inner(self, arguments: tuple[Any, ...]) -> Any:
        flags = _numba.compiler.Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        flags.no_compile = flags.no_cpython_wrapper = True
        result = _numba.compiler.compile_extra(
            self.typingctx,
            self.targetctx,
            self.py_func,
            args=arguments,
            return_type=None,
            flags=flags,
            locals=self.locals,
            library=InnerLibrary(self.targetctx.codegen(), self.py_func.__qualname__),
            pipeline_class=self._compiler.pipeline_class,
        )
        return inner_result(result)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """What type inference asks a kernel for that a kernel calls."""
        signature, arguments = self._compiler.fold_argument_types(args, kws)
        arguments = tuple(map(_numba.types.unliteral, arguments))  # or each number has code of its own
        if self._can_compile:
            self.compile_inner(tuple(arguments))
        name = self.py_func.__name__
        template = _numba.typing.make_concrete_template(
            f"CallTemplate({name})", key=name, signatures=self.nopython_signatures
        )
        return template, signature, arguments, {}

    def add_overload(self, cres: Any) -> None:
        """Add what was compiled for Python, with the environments of all that is linked into it."""
        for environment in cres._find_referenced_environments():
            cres.library.codegen.set_env(environment.env_name, environment)
        super().add_overload(cres)


class InnerLibrary(_numba.codegen.JITCodeLibrary):  # type: ignore[misc]
    """A module to be linked into others, neither optimised as a whole nor translated to machine code."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def as_bitcode(self) -> tuple[str, bytes]:
        """The name of the module and its content."""
        self._ensure_finalized()
        return self.name, self._get_module_for_linking().as_bitcode()

    @classmethod
    def of_bitcode(cls, codegen: Any, name: str, content: bytes) -> InnerLibrary:
        """The library that `as_bitcode` was asked."""
        library = cls(codegen, name)
        library._final_module = llvm.parse_bitcode(content)
        library._finalize_final_module()
        return library


def inner_result(result: Any, **changed: Any) -> Any:
    """A result of compiling under a key of its own in place of the function for Python that it lacks."""
    return result._replace(entry_point=object(), **changed)


def reduced(result: Any) -> tuple[Any, ...]:
    """What is kept on disk of an inner kernel."""
    environments = tuple(result._find_referenced_environments())
    described = result.fndesc
    described.typemap = described.calltypes = None
    started = tuple(result.library._reload_init)
    return (
        *result.library.as_bitcode(),
        described,
        result.environment,
        result.signature,
        started,
        environments,
    )


def rebuilt(target: Any, kept: tuple[Any, ...]) -> Any:
    """The inner kernel of which `kept` is on disk."""
    name, content, described, environment, signature, started, environments = kept
    for start in started:
        start()
    library = InnerLibrary.of_bitcode(target.codegen(), name, content)
    library._reload_init.update(started)
    result = _numba.compiler.compile_result(
        typing_context=target.typing_context,
        target_context=target,
        library=library,
        environment=environment,
        fndesc=described,
        signature=signature,
        objectmode=False,
        lifted=(),
        reload_init=list(started),
        referenced_envs=environments,
    )
    return inner_result(result)


@contextlib.contextmanager
def _without_collecting() -> Iterator[None]:
    """Keep the garbage collector from looking through all that compiling makes, a tenth of its time."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
