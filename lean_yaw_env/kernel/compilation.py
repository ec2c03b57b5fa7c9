"""How the kernels are compiled: formulas inlined into a few cached entry points.

``inlined`` marks a formula: it is compiled into whoever calls it, which is what lets LLVM vectorise a loop over walkers. ``entry_point``
marks one of the few functions that are called from Python: only these are compiled on their own and kept on disk.

Both keep IEEE semantics (no fast-math), so that every kernel that inlines the same formulas gives the same bits.
"""

from __future__ import annotations

import ctypes
import hashlib
import linecache
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numpy as np
from llvmlite.binding import add_symbol
from numba import config, njit, typeof
from numba.core import cgutils, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.extending import intrinsic, overload

from lean_yaw_env.kernel import fusing
from lean_yaw_env.kernel.notice import NOTICE

# A division by zero gives inf or nan as in C: Python's exception would be a branch, and a branch stops vectorisation.
_OPTIONS: dict[str, Any] = {"error_model": "numpy"}

# Numba's type hints know neither its extension options, nor its settings, nor what a dispatcher keeps
_njit: Any = njit
_config: Any = config
_overload: Any = overload


class _FormulaLibrary(JITCodeLibrary):
    """A formula's intermediate code. Its callers link it into their own, so that machine code of its own would be made in vain."""

    codegen: Any = SimpleNamespace(set_env=lambda name, environment: None)

    def get_pointer_to_function(self, name: str) -> int:
        """No address: Python does not call it."""
        return 0

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _FormulaCompiler(Compiler):
    """Numba's compiler for formulas."""

    def define_pipelines(self) -> Any:
        """Its passes; before them, the library that their result goes to."""
        codegen = self.state.targetctx.codegen()
        self.state.library = _FormulaLibrary(codegen, self.state.func_id.func_qualname)
        return super().define_pipelines()


_FORMULA: dict[str, Any] = {"pipeline_class": _FormulaCompiler, **_OPTIONS}

inlined = _njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **_FORMULA)


called = _njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **_FORMULA)
"""Mark a formula that is called and not inlined, as it is needed too rarely to be worth a copy."""


def apart(name: str) -> Any:
    """A formula ``call(numbers, k)`` of flat ``numbers`` that calls what ``compiled_apart`` defines of this name."""
    if _config.DISABLE_JIT:
        return lambda numbers, k: _APART[name](numbers, k)
    symbol = types.ExternalFunction(name, types.void(types.CPointer(types.float64), types.intp))
    return inlined(lambda numbers, k: symbol(numbers.ctypes, k))


def compiled_apart(
    name: str, size: int, place: int, otherwise: float
) -> Callable[[Callable[..., Any]], Any]:
    """Decorate an entry point ``function(numbers, k)`` of ``size`` flat numbers that other compiled code calls by its name.

    It is for what is needed too rarely to be worth a copy in each of its callers: it is compiled once, and when it is first called. If
    that is interrupted or fails, the error is printed and ``numbers[place + k]`` is ``otherwise``.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        entry = entry_point()(function)

        @ctypes.CFUNCTYPE(None, ctypes.POINTER(ctypes.c_double), ctypes.c_ssize_t)
        def call(numbers: Any, k: int) -> None:
            array = np.ctypeslib.as_array(numbers, (size,))
            try:
                entry(array, k)
            except BaseException:  # compiled code cannot take an exception; ctypes prints it
                array[place + k] = otherwise
                raise

        _APART[name] = entry if _config.DISABLE_JIT else call
        if not _config.DISABLE_JIT:
            add_symbol(name, ctypes.cast(call, ctypes.c_void_p).value)
        return entry

    return decorate


_APART: dict[str, Any] = {}


def fused(function: Any) -> Any:
    """Mark a formula of floats as ``inlined`` does, with products and sums fused; see ``fusing``."""
    return function if _config.DISABLE_JIT else inlined(fusing.fuse(function))


def formula(function: Any) -> Any:
    """Mark a formula that compiled code inlines, as ``inlined`` does, and that Python calls as the plain function it is.

    Its numbers may then be floats, complex numbers or NumPy's arrays, and its records ``numpy.recarray``.
    """
    by_type(function, strict=False)(lambda *arguments: function)
    return function


def written_formula(name: str, arguments: Sequence[str], lines: Sequence[str]) -> Any:
    """A formula made of lines of source, for what would repeat the same line for each field of a record."""
    body = "\n".join(f"    {line}" for line in lines)
    return formula(generated(f"def {name}({', '.join(arguments)}):\n{body}\n"))


def generated(source: str, **names: Any) -> FunctionType:
    """The one function that a source text defines, for the decorators above; ``names`` are what the text refers to.

    The text is kept where a traceback and ``fusing`` look for it.
    """
    place = f"<generated {hashlib.sha256(source.encode()).hexdigest()[:12]}>"
    linecache.cache[place] = (len(source), None, source.splitlines(keepends=True), place)
    scope: dict[str, Any] = {"__name__": __name__, **names}
    before = {"__builtins__", *scope}
    exec(compile(source, place, "exec"), scope)
    (function,) = (scope[name] for name in scope if name not in before)
    return function


def borrowed(array: Any) -> Any:
    """The same array without a share in its ownership, for as long as the caller holds it.

    A formula that takes an array counts its owners up and down, an atomic operation each, wherever a branch hides from Numba that the two
    cancel: in a loop over walkers they cost several times what the formulas do. In plain Python, of an array of records the one whose
    fields are attributes, as compiled code has them.
    """
    return array.view(np.recarray) if array.dtype.names else array


def _without_owner_code(typing_context, array):
    def generate(context, builder, signature, arguments):
        view = context.make_array(signature.return_type)(context, builder, arguments[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), generate


# The code's first argument is the compiler's own, which the type hints do not know
_without_owner: Any = intrinsic(_without_owner_code)


def by_type(function: Callable[..., Any], **options: Any) -> Callable[..., Any]:
    """Decorate what chooses, by the arguments' types, the formula that is compiled in a function's place."""
    return _overload(function, jit_options={"forceinline": True, **_FORMULA}, **options)


@by_type(borrowed)
def _borrowed(array):
    return lambda array: _without_owner(array)


_PACKAGE = __name__.split(".", 1)[0]


def _ingredients(
    function: Callable[..., Any], formulas: Iterable[Callable[..., Any]]
) -> tuple[set[str], set[str]]:
    """What a function is compiled from: files (its own, and those of the formulas and records that it names, of this package and of the
    packages of ``formulas``) and constants. A function without a file, as one typed at a prompt, counts by its code."""
    files: set[str] = {__file__, str(fusing.__file__)}
    constants: set[str] = set()
    packages = {_PACKAGE, *(each.__module__.split(".", 1)[0] for each in formulas)}
    waiting: list[Any] = [function]
    seen: set[Any] = set()
    while waiting:
        each = waiting.pop()
        seen.add(each)
        code = each.__code__
        if Path(code.co_filename).is_file():
            files.add(code.co_filename)
        else:
            constants.add(f"{code.co_name} = {code.co_code!r} {code.co_consts!r} {code.co_names!r}")
        for name, named in _names(each):
            named = getattr(named, "py_func", named)
            home = named.__name__ if isinstance(named, ModuleType) else _home(named)
            if isinstance(named, (bool, int, float, tuple)):
                constants.add(f"{name} = {named!r}")
            elif home.split(".", 1)[0] not in packages:
                continue
            elif isinstance(named, FunctionType):
                waiting.extend({named} - seen)
            else:
                files.add(str(sys.modules[home].__file__))
    return files, constants


def _names(function: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """What a function's names stand for, those of its module and those of the functions around it."""
    code = function.__code__
    yield from ((name, function.__globals__.get(name)) for name in code.co_names)
    for name, cell in zip(code.co_freevars, function.__closure__ or (), strict=True):
        yield name, cell.cell_contents


def _home(named: Any) -> str:
    """The module that a function or class is from; nothing for what has none."""
    return getattr(named, "__module__", None) or ""


def _digest(function: Callable[..., Any], formulas: Iterable[Callable[..., Any]]) -> str:
    """A digest of what a function's machine code depends on."""
    files, constants = _ingredients(function, formulas)
    digest = hashlib.sha256("\n".join(sorted(constants)).encode())
    for path in sorted(files):
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()


def entry_point(
    formulas: Iterable[Callable[..., Any]] = (), **options: Any
) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that Python calls, releasing the GIL, and keep its machine code on disk.

    Numba renews its cache when the entry point's own file changes, but not when a formula inlined from another file does. A digest
    of all sources that are inlined takes the place of that file's time stamp, which also serves file systems without stable times.
    What an entry point inlines must be defined above it. Where no cache folder can be written, the function is compiled in every process and a warning says so once.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = _njit(nogil=True, **_OPTIONS, **options)(function)
        if not hasattr(dispatcher, "enable_caching"):  # NUMBA_DISABLE_JIT=1 leaves a plain function
            return dispatcher
        NOTICE.watch(dispatcher)
        try:
            dispatcher.enable_caching()
        except RuntimeError:
            _warn_uncached()
        else:
            dispatcher._cache._cache_file._source_stamp = _digest(function, formulas)
        return dispatcher

    return decorate


def entry_point_with(
    template: Callable[..., Any],
    name: str,
    formulas: Mapping[str, Callable[..., Any]],
    parts: Sequence[FunctionType] = (),
    **constants: Any,
) -> Any:
    """Compile a template as an entry point of its own; arguments as of ``filled``, which says under which name the machine code is kept."""
    return entry_point(tuple(formulas.values()))(
        filled(template, name, formulas, parts, **constants)
    )


def filled(
    template: Callable[..., Any],
    name: str,
    formulas: Mapping[str, Callable[..., Any]],
    parts: Sequence[FunctionType] = (),
    **constants: Any,
) -> Any:
    """A template with formulas and constants in the place of its globals of the same names; it is called by its name and ``name``.

    ``parts`` are the functions that it calls, of its own module or another, whose globals are replaced alike.
    """
    names: dict[str, Any] = {}
    for part in parts:
        names |= part.__globals__
    names |= {**template.__globals__, **formulas, **constants}
    names |= {part.__name__: formula(_rebound(part, names, part.__name__)) for part in parts}
    return _rebound(template, names, f"{template.__name__}_{name}")


def for_types_of(entry: Any, *arguments: Any) -> Callable[..., Any]:
    """An entry point compiled for arguments of these types, without the search for them at each call, which takes longer than a small step.

    What it is called with must have the same types, dimensions and memory layouts: nobody checks.
    """
    if not hasattr(entry, "overloads"):  # NUMBA_DISABLE_JIT=1 leaves a plain function
        return entry
    signature = tuple(typeof(argument) for argument in arguments)
    entry.compile(signature)
    return entry.overloads[signature].entry_point


def _rebound(function: Any, names: dict[str, Any], name: str) -> Any:
    """The same code with other globals."""
    again = FunctionType(function.__code__, names, name)
    again.__qualname__ = name
    return again


_warned: set[str] = set()


def _warn_uncached() -> None:
    if not _warned:
        _warned.add("uncached")
        warnings.warn(
            "no folder for compiled code can be written, so the walker is compiled anew in every process (some seconds); "
            "set NUMBA_CACHE_DIR to a writable folder",
            RuntimeWarning,
            stacklevel=4,
        )
