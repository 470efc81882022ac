"""Studies: the demo and recorded trials; they may import every package, and nothing imports them."""
