"""Digital twin of a cart-pendulum rig: measured constants, believed effects, one compiled kernel."""
