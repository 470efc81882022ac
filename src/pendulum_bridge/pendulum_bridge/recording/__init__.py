"""Recordings that survive a crash: rosbag2 folders whose data file is readable up to the last flush at any moment."""
