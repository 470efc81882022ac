"""What is used of Numba beyond its documented interface is still there: `machine_code.py`."""

import importlib
import inspect

import numba
import pytest


def test_numba_has_the_cache_that_machine_code_derives_from():
    try:
        cache = importlib.import_module("numba.core.caching").FunctionCache
    except (ImportError, AttributeError):
        pytest.fail("Numba has no numba.core.caching.FunctionCache: see machine_code.py")
    for name, arguments in (
        ("__init__", ["self", "py_func"]),
        ("load_overload", ["self", "sig", "target_context"]),
        ("save_overload", ["self", "sig", "data"]),
        ("flush", ["self"]),
    ):
        method = getattr(cache, name, None)
        assert method is not None, f"FunctionCache has no {name}: see machine_code._SharedCache"
        assert list(inspect.signature(method).parameters) == arguments, (
            f"FunctionCache.{name} takes other arguments: see machine_code._SharedCache"
        )


def test_numbas_cache_finds_files_and_stamp_where_machine_code_puts_them():
    cache = numba.njit(lambda x: x)
    cache.enable_caching()
    kept = cache._cache
    for name in ("load", "save", "flush"):
        assert hasattr(kept._cache_file, name), f"_cache_file has no {name}: see CheckedFiles"
    assert kept._impl.filename_base and kept._impl.locator.get_source_stamp()


def test_numba_has_a_folder_for_its_cache():
    assert hasattr(numba.config, "CACHE_DIR"), "numba.config has no CACHE_DIR: see machine_code.py"


def test_compiled_functions_keep_their_cache_where_machine_code_puts_it():
    compiled = numba.njit(lambda x: x)
    assert hasattr(compiled, "_cache"), "dispatchers have no _cache: see machine_code.py"
    assert hasattr(compiled._cache, "load_overload"), "_cache is no cache: see machine_code.py"


def test_numba_takes_the_options_that_keep_lanes_side_by_side():
    """`forceinline` is in no manual; without it each lane is computed alone, much slower."""
    options = {"forceinline", "no_cpython_wrapper", "no_cfunc_wrapper"}
    for option in sorted(options):
        try:
            compiled = numba.njit(lambda x: x, **{option: True})
        except KeyError:  # what Numba raises for an unknown option
            pytest.fail(f"numba.njit has no option {option}: see equations.py")
        assert compiled.targetoptions[option] is True
