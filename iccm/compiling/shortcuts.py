"""Repeated work of Numba's compiler, done once for as long as a kernel is compiled.

Numba is made for code that it has not seen and for extensions that may come at any time. While one of our kernels is
compiled nothing of that changes: a type is looked for once, registries are read again only after they grew, the size
of a type is asked of LLVM once, and what only generators, listeners and Python's objects need is left out.
Measured on the kernels of a solve: of 8.7 CPU-seconds 1.2 are gone.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import llvmlite.binding as llvm
from numba.core import base, transforms, types
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.typing import context, templates

FUNCTION: Any = types.Function
OVERLOAD: Any = templates._OverloadFunctionTemplate
GET_CALL_TYPE, BUILD_IMPL = FUNCTION.get_call_type, OVERLOAD._build_impl
REFRESHED: tuple[Any, ...] = base.BaseContext, context.BaseContext  # of lowering, and of typing
PROCESSED, SIZE_OF = PostProcessor.run, base.BaseContext.get_abi_sizeof
HAS_LOCATION: Callable[[Any], bool] = cache(base._has_loc)
LOCK: Any = llvm.ffi.lib._lock

_signatures: dict[Any, Any] = {}
_sizes: dict[str, int] = {}


def _refresher(original: Callable[[Any], None]) -> Callable[[Any], None]:
    """Takes in what has been registered since: by a module that was imported, or by an intrinsic that was typed."""

    def refresh(self: Any) -> None:
        if getattr(self, "_taken_in", None) != _registered(self):
            original(self)
            self._taken_in = _registered(self)  # copies of a context share what it took in

    return refresh


def _registered(context: Any) -> tuple[int, int]:
    """How much there is to take in: modules, and functions in the registries that a context reads."""
    return len(sys.modules), sum(len(registry.functions) for registry in context._registries)


def _processed(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Numba's own, without the variables alive at the start of each block, which generators need."""
    code = self.func_ir
    if code.is_generator:
        PROCESSED(self, emit_dels, extend_lifetimes)
        return
    code.blocks = transforms.canonicalize_cfg(code.blocks)
    code.variable_lifetime, code.generator_info = VariableLifetime(code.blocks), None
    if emit_dels:
        self._insert_var_dels(extend_lifetimes=extend_lifetimes)


def _size_of(self: Any, type: Any) -> int:
    """Bytes of a type of LLVM's, for which it parses a module."""
    name = str(type)
    if name not in _sizes:
        _sizes[name] = SIZE_OF(self, type)
    return _sizes[name]


def _call_type(options: Any) -> Callable[..., Any]:
    def call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        """The signature of a built-in function for arguments; what fails is looked for again."""
        key = self, context, tuple(args), tuple(kws.items()), options
        if key not in _signatures:
            found = GET_CALL_TYPE(self, context, args, kws)
            _signatures[key] = found, self._impl_keys[found.args]
        found, implementation = _signatures[key]
        self._impl_keys[found.args] = implementation
        return found

    return call_type


_STEADY: dict[tuple[Any, str], Any] = {
    **{(kind, "refresh"): _refresher(kind.refresh) for kind in REFRESHED},
    (PostProcessor, "run"): _processed,
    (base.BaseContext, "get_abi_sizeof"): _size_of,
    (base, "_has_loc"): HAS_LOCATION,
    (LOCK, "_cblist"): [],  # nobody listens to each call of LLVM
}


@contextmanager
def shortcuts(build: Callable[..., Any], *options: Any) -> Iterator[None]:
    """Numba with less to do; under the compiler's lock, which is held here.

    Args:
        build: compiles Numba's own functions where a kernel calls them, as `_OverloadFunctionTemplate._build_impl`.
        options: what these take over from the one that calls them.
    """
    new = _STEADY | {(FUNCTION, "get_call_type"): _call_type(options), (OVERLOAD, "_build_impl"): build}
    before = [(owner, name, getattr(owner, name)) for owner, name in new]
    for (owner, name), value in new.items():
        setattr(owner, name, value)
    try:
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)
