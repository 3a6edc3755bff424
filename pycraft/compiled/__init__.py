"""Code generated for one model: what a plan or a kernel does, written out as straight-line C++, built by the system's compiler and loaded.

`trace` holds numbers that remember how they came about, `kernels` and `frames` run the direct calls on them, `expressions` the recursion of
an expression; `source` writes the C++, `build` keeps what was built, `compiled` is the callable.
"""

from .compiled import Compiled, compile_call, compile_expression

__all__ = ["Compiled", "compile_call", "compile_expression"]
