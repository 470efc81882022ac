"""Linear algebra runs in one thread while it is asked to, and in as many as before afterwards."""

import pytest

from pendulum_sysid.fitting.blas_threads import use_one_blas_thread

threadpoolctl = pytest.importorskip("threadpoolctl")


def count_threads():
    pools = threadpoolctl.threadpool_info()
    return [pool["num_threads"] for pool in pools if pool["user_api"] == "blas"]


def test_blas_takes_one_thread_meanwhile():
    before = count_threads()
    with use_one_blas_thread():
        assert set(count_threads()) <= {1}
    assert count_threads() == before
