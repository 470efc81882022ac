"""Keep linear algebra to one thread: its matrices are small, and idle threads of BLAS spin."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext

try:
    from threadpoolctl import threadpool_limits
except ImportError:  # optional: no rosdep key is known; without, a quarter more CPU time
    threadpool_limits = None


def use_one_blas_thread() -> AbstractContextManager[object]:
    """Return a context in which BLAS runs in the calling thread alone, where threadpoolctl is."""
    return nullcontext() if threadpool_limits is None else threadpool_limits(1, "blas")
