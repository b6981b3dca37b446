"""Kept kernels: one file for each kernel and signature, with its own digest and the name of what it is.

numba keeps an index beside its files, and believes both: two processes that compile at once write each its own index
and the same numbers behind it, so that one may load the other's kernel; half a file ends in a trace, and a file with a
flipped bit is machine code all the same. Here a file says which kernel it is and what its bytes are: one that is
damaged, or another's, is compiled anew. A file that cannot be written is no fault, the kernel is in memory.

numba makes ready for compiling before it loads a kernel: every registry of what it can compile, which takes longer than
all kernels of a solve together. `QuickCache` leaves that until something is compiled. A kept kernel also names the
module of every function that was compiled into it, numba's own among them, for the globals that Python objects would
be looked up in; in kernels without Python objects nothing is looked up, and these modules (SciPy's linear algebra among
what they import) are not imported for it. And it holds the kernel twice, as machine code and as LLVM's code, from which
other kernels would be compiled: the second is read when something is compiled, not before (`kernel_late`).
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import inspect
import io
import pickle
import sys
from pathlib import Path
from typing import Any

from llvmlite import binding
from numba.core import caching, environment
from numba.core import config as _config

from ribbonbench import kernel_late
from ribbonbench.replacing import replacing
from ribbonbench.trusted import made

config: Any = _config  # numba's settings are made at import, unknown to type checkers
_HEAD = 32  # bytes of the SHA-256 at the start of a file
_ORDINARY: Any = caching.FunctionCache
#: Whether this numba's cache is made of the parts that are replaced here.
FITS = hasattr(_ORDINARY, "_load_overload") and hasattr(_ORDINARY, "_save_overload")


class _File:
    """The files of one kernel (numba's `IndexDataCacheFile`), without an index."""

    def __init__(self, folder: str, base: str, stamp: Any) -> None:
        self._folder, self._base, self._stamp = Path(folder), base, stamp

    def _path(self, key: Any) -> tuple[Path, str]:
        """The file of a signature, and what it is called inside."""
        name = repr((self._base, self._stamp, key))
        return self._folder / f"{self._base}.{hashlib.sha256(name.encode()).hexdigest()[:16]}.nbc", name

    def load(self, key: Any) -> Any:
        """What was kept for the key; None: nothing, or nothing whole."""
        path, name = self._path(key)
        with contextlib.suppress(OSError):
            raw = path.read_bytes()
            if hashlib.sha256(raw[_HEAD:]).digest() == raw[:_HEAD]:
                kept, data = _Unpickler(io.BytesIO(raw[_HEAD:])).load()
                if kept == name:
                    return data
        return None

    def save(self, key: Any, data: Any) -> None:
        """Keeps a kernel, whole or not at all."""
        path, name = self._path(key)
        raw = caching.dumps((name, data))
        with contextlib.suppress(OSError):
            made(self._folder)
            with replacing(path, lasting=False, own=True) as stream:
                stream.write(hashlib.sha256(raw).digest() + raw)

    def flush(self) -> None:
        """Forgets every signature of the kernel."""
        for path in self._folder.glob(f"{self._base}.*.nbc"):
            path.unlink(missing_ok=True)


def _environment(module: str, constants: list[Any], name: str) -> Any:
    """numba's `_rebuild_env`: the environment of a compiled function, without importing the function's module."""
    found = environment.lookup_environment(name)
    if found is None:
        known = sys.modules.get(module)
        found = environment.Environment({"__name__": module} if known is None else known.__dict__)
        found.consts[:] = constants
        found.env_name = name
        environment.Environment._memo[name] = found
    return found


class _Unpickler(pickle.Unpickler):
    """Reads a kept kernel."""

    def find_class(self, module: str, name: str) -> Any:
        """As pickle finds it, but for environments of compiled functions."""
        if (module, name) == (environment.__name__, "_rebuild_env"):
            return _environment
        return super().find_class(module, name)


@functools.cache
def _text(place: Path) -> bytes:
    """The source that a kernel stands in; nothing where there is none."""
    try:
        return place.read_bytes()
    except OSError:
        return b""


class _Place:
    """What numba asks its locator for: the number of a function's line, and its file."""

    def __init__(self, place: str) -> None:
        self._py_file = place

    def get_disambiguator(self) -> str:
        """Nothing: the source is in the key."""
        return "kernel"

    def ensure_cache_path(self) -> None:
        """Nothing: `_File` makes it."""


class _Impl(_ORDINARY._impl_class):  # type: ignore[misc]
    """What numba's cache knows of compiled functions, loaded with LLVM's code left unread."""

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """The compiled function of a file."""
        made_there = super().rebuild(kernel_late.Context(target_context), payload)
        return made_there._replace(target_context=target_context)


class QuickCache(_ORDINARY):  # type: ignore[misc]
    """numba's cache of a kernel, loaded without what only a compilation needs."""

    def __init__(self, py_func: Any) -> None:
        place = Path(inspect.getfile(py_func))
        impl = _Impl.__new__(_Impl)
        impl._lineno = py_func.__code__.co_firstlineno
        impl._locator = _Place(str(place))
        impl._filename_base = impl.get_filename_base(f"{place.stem}.{py_func.__qualname__}", "")
        self._name, self._py_func, self._impl = repr(py_func), py_func, impl
        # by the module's name, not its place: every checkout and every installation of the same sources shares them
        self._cache_path = str(Path(config.CACHE_DIR) / py_func.__module__)
        self._cache_file = _File(self._cache_path, impl.filename_base, hashlib.sha256(_text(place)).hexdigest())
        self.enable()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The kept kernel for a signature; None: there is none, and numba is made ready to compile it."""
        _helpers()
        found = self._load_overload(sig, target_context)
        if found is None:
            kernel_late.read_all()
            target_context.refresh()
        return found


def _helpers() -> None:
    """The memory functions that kernels call, by name: numba tells them when it first makes ready to compile."""
    if not _TOLD:
        helpers: Any = importlib.import_module("numba.core.runtime._nrt_python")
        for name, address in helpers.c_helpers.items():
            binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)
        _TOLD.append(True)


_TOLD: list[bool] = []
