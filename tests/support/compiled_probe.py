"""A function that compiles fast, kept as the kernel is, and what a program says of its cache."""

from pendulum_twin import machine_code


@machine_code.compile_cached
def double(number):
    return 2.0 * number


def tell_use() -> None:
    """Print how often the function was found compiled, how often it was compiled, and where."""
    assert double(1.5) == 3.0
    print(sum(double.stats.cache_hits.values()), sum(double.stats.cache_misses.values()))
    print(machine_code.find_cache_folder())
