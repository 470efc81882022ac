"""The bridge as ROS 2 nodes: thin shells, the only place of this package that knows ROS."""
