"""The twin as a ROS 2 node: a thin shell, the only place of this package that knows ROS."""
