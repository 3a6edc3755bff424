"""Code generated for one model: what the core computes, written as straight-line C++, built by the system's compiler and loaded.

The core records a kernel, a recursion or the plan of an expression on a tape: `kernels` and `expressions` ask for it, `tapes` reads it,
`graph` shortens it, `source` writes the C++, `build` keeps what was built, `compiled` is the callable.
"""

from .compiled import Compiled, compile_call, compile_expression

__all__ = ["Compiled", "compile_call", "compile_expression"]
