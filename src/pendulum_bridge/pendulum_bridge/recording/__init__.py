"""Recordings that survive a crash: rosbag2 folders that are readable up to the last flush."""
