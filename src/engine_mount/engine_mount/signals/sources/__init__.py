"""Where recordings lie: on a disk, on a server, in a store of objects."""
