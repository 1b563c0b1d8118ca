"""Call the core, and the same in plain Python."""


def both(monkeypatch, module, plain, work):
    """What work() returns with a module's functions of the core, and with plain ones instead.

    Args:
        monkeypatch: pytest's.
        module: that calls the core.
        plain: by the name that each has in the module, a function that is called the same way.
        work: without arguments.
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
        found = work()
    assert calls == set(plain)
    return compiled, found
