"""LLVM's code of kept kernels, read when something is compiled.

A kept kernel is machine code and, beside it, the bitcode from which other kernels are compiled that call it. numba
reads both when it loads the kernel; reading the bitcode takes longer than all else, and a process that compiles nothing
never looks at it. Here it waits until somebody asks the kernel's library for its module, or something is compiled.
"""

from __future__ import annotations

from typing import Any

from llvmlite import binding
from numba.core import codegen as _codegen

_LIBRARY: Any = _codegen.JITCodeLibrary
#: Whether this numba's libraries are made of the parts that are used here.
FITS = all(
    hasattr(_LIBRARY, name)
    for name in ("enable_object_caching", "_set_compiled_object", "_finalize_final_module", "_get_module_for_linking")
)
#: The libraries whose bitcode was not read yet.
_WAITING: list[Library] = []


class Library(_LIBRARY):  # type: ignore[misc]
    """A kernel's library (numba's `JITCodeLibrary`) whose module for linking is read when it is asked for."""

    _module: Any = None
    _bitcode: bytes = b""
    _machine_code: bytes = b""

    def get_pointer_to_function(self, name: str) -> int:
        """Where a function begins; numba asks the bitcode whether there is one, here its name in the machine code."""
        if self._bitcode and b"\0" + name.encode() + b"\0" in self._machine_code:
            return int(self._codegen._engine.get_function_address(name))
        self._get_module_for_linking()
        return int(super().get_pointer_to_function(name))

    @property
    def _shared_module(self) -> Any:
        """What is linked into others that call the kernel."""
        if self._bitcode:
            bitcode, self._bitcode = self._bitcode, b""
            self._module, self._machine_code = binding.parse_bitcode(bitcode), b""
            self._codegen._engine._load_defined_symbols(self._module)
        return self._module

    @_shared_module.setter
    def _shared_module(self, module: Any) -> None:
        self._module = module


def waiting() -> int:
    """How many libraries have their bitcode unread."""
    return sum(bool(library._bitcode) for library in _WAITING)


def read_all() -> None:
    """Reads what waits: numba knows of every loaded kernel then what it knows of one that it has loaded itself."""
    while _WAITING:
        _WAITING.pop()._get_module_for_linking()


class Context:
    """A target's context (numba's `CPUContext`) that loads libraries with their bitcode unread."""

    def __init__(self, target_context: Any) -> None:
        self._target_context = target_context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._target_context, name)

    def codegen(self) -> Context:
        """Itself: it is asked for libraries alone."""
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Numba's own: the environment of a kernel with Python objects."""
        self._target_context.codegen().set_env(name, env)

    def unserialize_library(self, state: Any) -> Any:
        """The library of a kept kernel (its name, the kind of what follows, machine code and bitcode)."""
        codegen = self._target_context.codegen()
        name, kind, data = state
        if kind != "object" or not FITS or codegen._library_class is not _LIBRARY:
            return codegen.unserialize_library(state)
        library = Library(codegen, name)
        library.enable_object_caching()
        library._set_compiled_object(data[0])
        library._machine_code, library._bitcode = data
        library._finalize_final_module()
        _WAITING.append(library)
        return library
