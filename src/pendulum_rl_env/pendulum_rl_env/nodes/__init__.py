"""What of the environments speaks ROS."""
