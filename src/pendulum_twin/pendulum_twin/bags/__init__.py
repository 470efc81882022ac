"""Write rosbag2 folders: as messages come, or a whole recording at once."""
