"""The environments' ROS nodes."""
