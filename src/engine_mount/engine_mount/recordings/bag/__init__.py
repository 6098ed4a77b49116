"""A rosbag2 bag as a folder of files with metadata: written, and opened as a `Recording`."""
