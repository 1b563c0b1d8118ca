"""Numba's compiler with less to do, since the first run on a fresh machine waits for it.

Numba optimises every function by itself and once more within each that calls it, translates it for the machine
although only kernels call it, and goes through it a dozen times for what kernels have not: closures, `with`, strings.
Here what kernels call is linked into theirs and optimised there (and see `shortcuts`).
Measured on the README's first command, in one process: 23.9 CPU-seconds became 17.0, and kernels run as fast.
"""

from typing import Any

from llvmlite.binding import create_new_function_pass_manager
from numba import _dynfunc  # type: ignore[attr-defined]
from numba.core import typed_passes, types, untyped_passes
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, _pass_registry, register_pass
from numba.core.postproc import PostProcessor
from numba.core.runtime.nrt import rtsys
from numba.core.typed_passes import NativeLowering

from .shortcuts import BUILD_IMPL, shortcuts

NEEDLESS = (  # of our kernels, which have no closures, no `with`, nothing literal, and no functions to inline
    untyped_passes.WithLifting,
    untyped_passes.InlineClosureLikes,
    untyped_passes.MakeFunctionToJitFunction,
    untyped_passes.InlineInlinables,
    untyped_passes.FindLiterallyCalls,
    untyped_passes.LiteralUnroll,
    untyped_passes.LiteralPropagationSubPipelinePass,
    typed_passes.InlineOverloads,
    typed_passes.AnnotateTypes,
    typed_passes.DumpParforDiagnostics,
)


class _Code(CompileResultCacheImpl):
    """What is kept of a kernel: without the modules of Numba's own functions in it, which would be imported again. They
    stand for the constants of a function, and are left out where it has none."""

    def reduce(self, data: Any) -> Any:
        """What is written of a compiled kernel."""
        *made, environments = super().reduce(data)
        needed = (each for each in environments if each.consts or _is_ours(each.globals["__name__"]))
        return *made, tuple(needed)


def _is_ours(module: str) -> bool:
    return module.partition(".")[0] != "numba"


class Kept(FunctionCache):
    """Numba's cache of a kernel, without what only compiling needs: what Numba knows of all of Python and NumPy, the
    import of which takes longer than that of all our kernels."""

    _impl_class = _Code

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The code for a signature; None if it is not there."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


class _Whole(JITCodeLibrary):
    """The code of a kernel and of what it calls, optimised once and together."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


class _Part(JITCodeLibrary):
    """Code that is only linked into other code: simplified, since inlining looks at its size, and no more."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout
        passes = create_new_function_pass_manager()
        passes.add_sroa_pass()
        passes.add_simplify_cfg_pass()
        passes.add_instruction_combine_pass()
        passes.add_simplify_cfg_pass()
        builder = self._codegen._pass_builder()
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def finalize(self) -> None:
        """Takes in what this calls."""
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=False)
class _WholeLowering(NativeLowering):
    _name = "iccm_whole_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Whole(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().run_pass(state)


@register_pass(mutates_CFG=False, analysis_only=False)
class _PartLowering(NativeLowering):
    _name = "iccm_part_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        # calls are found by an object of their own, which nobody calls
        made = state.cr
        key = _dynfunc.make_function(
            made.fndesc.lookup_module(), made.fndesc.qualname, "", 0, made.env, (state.library,)
        )
        state.targetctx.insert_user_function(key, made.fndesc, [state.library])
        state.cr = made._replace(cfunc=key)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _ArrayRewrites(typed_passes.NopythonRewrites):
    """Expressions of whole arrays become one loop, where there are any."""

    _name = "iccm_array_rewrites"

    def run_pass(self, state: Any) -> bool:
        """Whether something has changed."""
        results = (
            found.return_type for term, found in state.calltypes.items() if "binop" in getattr(term, "op", "")
        )
        return any(isinstance(type, types.Array) for type in results) and super().run_pass(state)


class _Passes(PassManager):
    """Passes one after the other, which are neither timed nor told to anybody."""

    def _runPass(self, index: int, step: Any, state: Any) -> None:
        step.analysis = self._analysis
        changed = step.run_initialization(state)
        changed |= step.run_pass(state)
        changed |= step.run_finalizer(state)
        if changed and _pass_registry.get(type(step)).mutates_CFG:
            PostProcessor(state.func_ir).run()


class Pipeline(CompilerBase):
    """Numba's own, but for the lowering and what kernels do not need; of a part, where there is no entry for Python."""

    def define_pipelines(self) -> list[Any]:
        """One, as Numba's."""
        lowering = _PartLowering if self.state.flags.no_cpython_wrapper else _WholeLowering
        instead = {NativeLowering: lowering, typed_passes.NopythonRewrites: _ArrayRewrites}
        without = NEEDLESS if _is_ours(self.state.func_id.modname) else ()
        numbas = DefaultPassBuilder.define_nopython_pipeline(self.state)
        made = _Passes(numbas.pipeline_name)
        for step, what in numbas.passes:
            if step not in without:
                made.add_pass(instead.get(step, step), what)
        made.finalize()
        return [made]

    def _compile_core(self) -> Any:
        flags = self.state.flags
        with shortcuts(_build_part, flags.error_model, frozenset(flags.fastmath.flags)):
            return super()._compile_core()


def _build_part(self: Any, key: Any, args: Any, kws: Any) -> Any:
    self._jit_options = self._jit_options | {"pipeline_class": Pipeline, "no_cpython_wrapper": True}
    return BUILD_IMPL(self, key, args, kws)
