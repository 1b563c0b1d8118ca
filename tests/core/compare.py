"""Compare functions of the core with the same functions in plain Python."""


def run_both(monkeypatch, module, plain, work):
    """Return the results of work() with a module's functions of the core, and with plain ones instead.

    Args:
        monkeypatch: pytest's.
        module: the module that calls the core.
        plain: functions by the names that they replace in the module, with the same signatures.
        work: a function without arguments.
    """
    compiled = work()
    calls = set()

    def counted(name, function):
        def instead(*args):
            calls.add(name)
            return function(*args)

        return instead

    with monkeypatch.context() as patched:
        for name, function in plain.items():
            patched.setattr(module, name, counted(name, function))
        result = work()
    assert calls == set(plain)
    return compiled, result
