"""Studies of the diagnosis itself: they may import any package, and nothing imports them."""
