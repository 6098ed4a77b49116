"""Whether a path is a recording of ROS 2."""

from pathlib import Path


def is_recording(path: Path) -> bool:
    """Return whether `path` is a bag: its folder, or one of its files, compressed or not."""
    names = [file.name for file in path.iterdir()] if path.is_dir() else [path.name]
    return any(kind in Path(name).suffixes for name in names for kind in ('.mcap', '.db3'))
