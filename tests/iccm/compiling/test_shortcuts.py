"""Numba's contexts take in what has been registered, no oftener than there is something new."""

from types import SimpleNamespace

from iccm.compiling import shortcuts


class Context:
    """As one of Numba's that reads one registry."""

    def __init__(self, registry):
        self._registries, self.taken_in = {registry: None}, []

    def refresh(self):
        self.taken_in.append([*next(iter(self._registries)).functions])


class Registry(SimpleNamespace):
    __hash__ = object.__hash__


def test_what_an_intrinsic_registers_is_taken_in_without_an_import():
    refresh, registry = shortcuts._refresher(Context.refresh), Registry(functions=["sqrt"])
    context = Context(registry)
    for _ in range(3):
        refresh(context)
    assert context.taken_in == [["sqrt"]]
    registry.functions.append("min of two")
    for _ in range(3):
        refresh(context)
    assert context.taken_in == [["sqrt"], ["sqrt", "min of two"]]


def test_a_context_in_the_place_of_one_that_is_gone_takes_in_what_there_is():
    refresh, registry = shortcuts._refresher(Context.refresh), Registry(functions=["sqrt"])
    for _ in range(20):  # most of these have the address of the one before
        context = Context(registry)
        refresh(context)
        assert context.taken_in == [["sqrt"]]
        del context
