"""Recording, reading and auditing of drives in rosbag2 MCAP bags."""
