"""Records the topics of the graph in rosbag2 MCAP bags."""
