"""A plug-in of pytest: test modules, which pytest loads by itself, see the system that `sitecustomize` imitates."""

import sitecustomize
from _pytest.assertion.rewrite import AssertionRewritingHook

AssertionRewritingHook.exec_module = sitecustomize.with_our_builtins(AssertionRewritingHook.exec_module)
