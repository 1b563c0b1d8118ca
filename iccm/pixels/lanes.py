"""Four numbers side by side in one register, for kernels: a texel's channels are weighed and added at once.

LLVM finds such loops by itself only where they are long. What a processor has not it takes apart.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, register_model

LANES = 4
STORED, FOUR = (ir.VectorType(kind, LANES) for kind in (ir.FloatType(), ir.DoubleType()))
NUMBER = ir.IntType(32)
within: Any = intrinsic  # kernels leave out the first argument, which types do not say


class FourNumbers(types.Type):
    """The type of such a register in kernels."""

    def __init__(self) -> None:
        super().__init__(name="FourNumbers")


@register_model(FourNumbers)
class _Register(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, FOUR)


@within
def nothing(typing):
    """Four zeros."""

    def build(context, builder, signature, given):
        return ir.Constant(FOUR, [0.0] * LANES)

    return FourNumbers()(), build


@within
def plus(typing, total, weight, numbers, at):
    """The total plus weight times numbers[at : at + 4] of a float32 array (n,); whether they exist is not looked at."""

    def build(context, builder, signature, given):
        so_far, weight, array, at = given
        data = context.make_array(signature.args[2])(context, builder, array).data
        four = builder.load(builder.bitcast(builder.gep(data, [at]), STORED.as_pointer()))
        four.align = 4
        empty, first = ir.Constant(FOUR, ir.Undefined), ir.Constant(NUMBER, 0)
        same = ir.Constant(ir.VectorType(NUMBER, LANES), [0] * LANES)
        weights = builder.shuffle_vector(builder.insert_element(empty, weight, first), empty, same)
        return builder.fadd(so_far, builder.fmul(weights, builder.fpext(four, FOUR)))

    return FourNumbers()(FourNumbers(), types.float64, numbers, types.intp), build


@within
def four(typing, numbers, at):
    """numbers[at : at + 4] of a float32 array (n,); whether they exist is not looked at."""

    def build(context, builder, signature, given):
        array, at = given
        data = context.make_array(signature.args[0])(context, builder, array).data
        held = builder.load(builder.bitcast(builder.gep(data, [at]), STORED.as_pointer()))
        held.align = 4
        return builder.fpext(held, FOUR)

    return FourNumbers()(numbers, types.intp), build


@within
def lower(typing, one, other):
    """The lower one of each two numbers."""

    def build(context, builder, signature, given):
        return builder.select(builder.fcmp_ordered("<", *given), *given)

    return FourNumbers()(FourNumbers(), FourNumbers()), build


@within
def higher(typing, one, other):
    """The higher one of each two numbers."""

    def build(context, builder, signature, given):
        return builder.select(builder.fcmp_ordered(">", *given), *given)

    return FourNumbers()(FourNumbers(), FourNumbers()), build


@within
def keep(typing, four, numbers, at):
    """Writes them to numbers[at : at + 4] of a float32 array (n,); whether they exist is not looked at."""

    def build(context, builder, signature, given):
        value, array, at = given
        data = context.make_array(signature.args[1])(context, builder, array).data
        place = builder.bitcast(builder.gep(data, [at]), STORED.as_pointer())
        builder.store(builder.fptrunc(value, STORED), place).align = 4
        return context.get_dummy_value()

    return types.none(FourNumbers(), numbers, types.intp), build


@within
def lane(typing, four, number):
    """One of the four. Of a sum that is not a loop's, LLVM adds up each by itself: `keep` all then."""

    def build(context, builder, signature, given):
        return builder.extract_element(given[0], builder.trunc(given[1], NUMBER))

    return types.float64(FourNumbers(), types.intp), build
