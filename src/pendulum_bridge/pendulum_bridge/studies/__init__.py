"""The demo and recorded trials: studies may import every package, and nothing imports a study."""
