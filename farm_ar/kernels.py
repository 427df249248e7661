"""The one decorator for compiled kernels, and the cache on disk in which their machine code is kept.

A kernel has the kernels that it calls, and the constants that it reads, compiled into it. So its machine code
is kept under a key of the content of its own file and of every file of this package that it imports, directly
or through others: after an edit nothing is taken for the code of another source, and what does not import the
edited file stays compiled. Numba looks at the kernel's own file only.

Compiling takes seconds, so it is announced in a line on the error output, once for each package, if it is not
over at once; not in worker processes, and not where the environment variable `FARM_AR_QUIET` is set.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import glob
import inspect
import multiprocessing
import os
import pickle
import sys
import threading
import time
from collections.abc import Callable, Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar, overload
from uuid import uuid4

import llvmlite  # type: ignore[import-untyped]
import numba
from numba.core import caching, event
from numba.core.serialize import dumps

from farm_ar.inner_kernels import Kernel, rebuilt, reduced

Function = TypeVar("Function", bound=Callable[..., Any])
ErrorModel = Literal["python", "numpy"]
Inline = Literal["never", "always"]

_PACKAGE = __name__.rpartition(".")[0]
_FOLDER = Path(__file__).parent
_STARTED = time.time_ns() - time.thread_time_ns()  # of all threads it would be more than has passed
"""No later than when this process loaded the first file of the package, in ns since the epoch."""


@overload
def compiled(function: Function) -> Function: ...


@overload
def compiled(*, error_model: ErrorModel = ..., inline: Inline = ...) -> Callable[[Function], Function]: ...


def compiled(
    function: Function | None = None, *, error_model: ErrorModel = "python", inline: Inline = "never"
) -> Function | Callable[[Function], Function]:
    """Compile a function with Numba (without the GIL) and keep its machine code on disk while it holds.

    Used bare (`@compiled`) or with options (`@compiled(error_model="numpy")`). Where nothing can be kept on
    disk (sources in an archive, no folder that can be written to), each process compiles anew.

    Args:
        function: what to compile.
        error_model: `"python"`: dividing by zero raises; `"numpy"`: it gives inf or NaN.
        inline: `"always"` to put the function's body into its callers.
    """
    if function is None:
        return functools.partial(compiled, error_model=error_model, inline=inline)
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    # A wrapper for callers in C, whom there are none, would be a tenth of the compiling.
    options: dict[str, Any] = {"nopython": True, "nogil": True, "no_cfunc_wrapper": True, "inline": inline}
    kernel: Any = Kernel(function, targetoptions=options | {"error_model": error_model})
    with contextlib.suppress(RuntimeError):  # Numba's word for: nowhere to keep it
        kernel._cache = _Cache(function)
    return kernel  # type: ignore[no-any-return]


def content_key(source: Path) -> str | None:
    """A key of the content of a file and of all files of this package that it imports, also through others.

    `None` where one of them cannot be read, or has changed since this process started: then it is unknown
    which content was loaded.
    """
    files = _closure(source)
    if files is None:
        return None
    parts = sha256(f"numba {numba.__version__} llvmlite {llvmlite.__version__}\n".encode())
    for file in sorted(files):
        parts.update(f"{files[file].digest}\n".encode())
    return parts.hexdigest()[:24]


class _Source(NamedTuple):
    """What counts of one source file: a digest of name and content, and the imports of this package.

    Each import is a module and the name that is taken from it (`None`: the module itself, `"*"`: all).
    """

    digest: str
    imports: tuple[tuple[str, str | None], ...]
    bound: dict[str, tuple[str, str | None]]
    """Names that the imports give, and which import does."""


@functools.cache
def _closure(source: Path) -> dict[Path, _Source] | None:
    """A file and all that it imports, by path; `None` where one of them does not count."""
    found: dict[Path, _Source] = {}
    ahead = [source]
    while ahead:
        file = ahead.pop()
        if file in found:
            continue
        content = _source(file)
        if content is None:
            return None
        found[file] = content
        for module, name in content.imports:
            ahead += _defining(module, name)
    return found


@functools.cache
def _source(file: Path) -> _Source | None:
    try:
        content, state = file.read_bytes(), file.stat()
        tree = ast.parse(content)
    except (OSError, SyntaxError, ValueError):
        return None
    if max(state.st_mtime_ns, state.st_ctime_ns) > _STARTED:
        if state.st_mtime_ns > time.time_ns():
            _say_once(f"{file.name} is dated in the future: no machine code is kept (is the clock right?)")
        return None
    inside = file.is_relative_to(_FOLDER)
    name = file.relative_to(_FOLDER).as_posix() if inside else file.name
    package = [_PACKAGE, *file.relative_to(_FOLDER).parts[:-1]] if inside else []
    imports: list[tuple[str, str | None]] = []
    bound: dict[str, tuple[str, str | None]] = {}
    for statement in _imports(tree):
        for alias in statement.names:
            if isinstance(statement, ast.Import):
                taken: tuple[str, str | None] = (alias.name, None)
                given = alias.asname or alias.name
            else:
                above = package[: len(package) + 1 - statement.level] if statement.level else []
                module = ".".join([*above, *([statement.module] if statement.module else [])])
                taken, given = (module, alias.name), alias.asname or alias.name
            if taken[0] == _PACKAGE or taken[0].startswith(f"{_PACKAGE}."):
                imports.append(taken)
                bound[given] = taken
    return _Source(sha256(name.encode() + b"\n" + content).hexdigest(), tuple(imports), bound)


@functools.cache
def _say_once(line: str) -> None:
    if not _silent():
        print(f"farm-ar: {line}", file=sys.stderr, flush=True)


def _silent() -> bool:
    return bool(os.environ.get("FARM_AR_QUIET")) or multiprocessing.parent_process() is not None


def _imports(tree: ast.AST) -> Iterator[ast.Import | ast.ImportFrom]:
    """All import statements of a module, those in functions among them, but not those for type checkers."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            for other in node.orelse:
                yield from _imports(ast.Module([other], []))
        elif not isinstance(node, ast.expr):
            yield from _imports(node)


def _file(module: str) -> Path | None:
    """The file of a module of this package, a package's being its `__init__.py`."""
    base = _FOLDER.joinpath(*module.split(".")[1:])
    for file in (base / "__init__.py", base.with_suffix(".py")):
        if file.is_file():
            return file
    return None


@functools.cache
def _defining(module: str, name: str | None) -> tuple[Path, ...]:
    """The files that an import of a name from a module takes it from, through what packages pass on."""
    file = _file(module)
    if file is None:
        return ()
    if name is None or file.name != "__init__.py":
        return (file,)
    content = _source(file)
    submodule = None if name == "*" else _file(f"{module}.{name}")
    if content is None or name == "*":
        return (file,)
    passed = content.bound.get(name)
    if passed is not None and passed != (module, name):
        return (*_defining(*passed), *((submodule,) if submodule else ()))
    return (submodule,) if submodule else (file,)


class _Cache(caching.FunctionCache):
    """Numba's cache of one kernel, in files of our own."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        # Numba's index file, shared by all signatures, loses entries and mixes them up when several
        # processes compile at once, and its data files keep their names when the source changes.
        source = Path(inspect.getfile(function))
        self._cache_file: Any = _Files(Path(self._cache_path), self._impl.filename_base, source)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled, if there is room."""
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]

    def load_inner(self, arguments: Any, target: Any) -> Any:
        """What was compiled for calls from kernels, or `None`."""
        target.refresh()
        kept = self._cache_file.load(self._inner_key(arguments, target))
        return None if kept is None else rebuilt(target, kept)

    def save_inner(self, arguments: Any, result: Any) -> None:
        """Keep what was compiled for calls from kernels, if there is room and it holds in other processes."""
        if self._impl.check_cachable(result):
            with contextlib.suppress(OSError):
                self._cache_file.save(self._inner_key(arguments, result.target_context), reduced(result))

    def _inner_key(self, arguments: Any, target: Any) -> Any:
        return ("inner", *self._index_key(arguments, target.codegen()))  # type: ignore[no-untyped-call]


class _Files:
    """The machine code of one kernel: a file for each signature and processor, named by content and key.

    Files appear whole, so that any number of processes may compile and save at once.
    """

    def __init__(self, folder: Path, base: str, source: Path) -> None:
        self._folder, self._base, self._source = folder, base, source

    def load(self, key: Any) -> Any:
        """What was saved under the key, or `None`."""
        content = content_key(self._source)
        if content is None:
            return None
        try:
            saved, data = pickle.loads(self._path(content, key).read_bytes())
        except (OSError, EOFError, pickle.UnpicklingError):
            return None
        return data if saved == key else None

    def save(self, key: Any, data: Any) -> None:
        """Save under the key, and remove what was compiled from other content."""
        content = content_key(self._source)
        if content is None:
            return
        path = self._path(content, key)
        partial = path.with_name(f"{path.name}.{uuid4().hex}.tmp")
        try:
            partial.write_bytes(dumps((key, data)))  # type: ignore[no-untyped-call]
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
        for other in self._folder.glob(f"{glob.escape(self._base.partition('-')[0])}-*.nb[ci]"):
            if f".{content}." not in other.name:
                other.unlink(missing_ok=True)

    def _path(self, content: str, key: Any) -> Path:
        return self._folder / f"{self._base}.{content}.{sha256(repr(key).encode()).hexdigest()[:12]}.nbc"


class _Announcer(event.Listener):
    """Says that kernels are being compiled, once it has taken `PATIENCE_S` for those of a package."""

    def __init__(self) -> None:
        self._spent: dict[str, float] = {}
        self._announced: set[str] = set()
        self._depth, self._began, self._timer = 0, 0.0, threading.Timer(0.0, print)

    def on_start(self, event: Any) -> None:
        """Begin to wait, if this is not a kernel that another one calls."""
        self._depth += 1
        if self._depth > 1:
            return
        self._began = time.perf_counter()
        left = PATIENCE_S - self._spent.get(self._package(event), 0.0)
        self._timer = threading.Timer(max(left, 0.0), self._announce, (self._package(event),))
        self._timer.daemon = True
        if self._package(event) in COMPILED and not _silent():
            self._timer.start()

    def on_end(self, event: Any) -> None:
        """Stop waiting."""
        self._depth -= 1
        if self._depth == 0:
            self._timer.cancel()
            package = self._package(event)
            self._spent[package] = self._spent.get(package, 0.0) + time.perf_counter() - self._began

    def _package(self, event: Any) -> str:
        module: str = event.data["dispatcher"].py_func.__module__ or ""
        top, _, rest = module.partition(".")
        return rest.partition(".")[0] if top == _PACKAGE else ""

    def _announce(self, package: str) -> None:
        if package not in self._announced:
            self._announced.add(package)
            what, seconds = COMPILED[package]
            print(f"farm-ar: compiling {what} (once; up to {seconds} s) ...", file=sys.stderr, flush=True)


PATIENCE_S = 0.5
"""Compiling that takes no longer is not announced."""

COMPILED = {
    "agents": ("planning and attacks", 30),
    "drawing": ("drawing", 10),
    "envs": ("the environment", 35),
    "experiments": ("the experiments", 5),
    "game_logic": ("the game", 10),
    "geometry": ("geometry", 5),
    "reid": ("identification", 15),
    "rendering": ("the headset's view", 15),
    "scenes": ("what a camera sees", 10),
    "vision": ("poses from images", 15),
}
"""What each package's kernels are for, and the seconds of processor that compiling them takes."""

event.register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]
