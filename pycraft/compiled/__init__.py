"""Code generated for one model: a plan or a kernel as straight-line C++, built by the system's compiler and loaded.

`trace` defines numbers that record their operations; `kernels` and `frames` run the direct calls on them, `expressions` the recursion of
an expression; `source` writes the C++, `build` caches the libraries, `compiled` is the callable.
"""

from .compiled import Compiled, compile_call, compile_expression

__all__ = ["Compiled", "compile_call", "compile_expression"]
