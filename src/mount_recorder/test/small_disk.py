"""A disk that becomes full or breaks, without one."""

import errno
import os

from mount_recorder.record_file import RecordFile


class SmallDisk(RecordFile):
    """A disk of `capacity` bytes that the recording and its reserve share."""

    capacity = 0
    allocated = 0
    broken = False
    full = False

    def _write_some(self, data):
        room = self.capacity - self.allocated - os.fstat(self._handle).st_size
        if room <= 0 and not self.full:
            # Others use the disk too: what this file gives back is gone at once, the reserve is not.
            self.full, self.capacity = True, self.size + self.allocated
        if room <= 0 or self.broken:
            raise OSError(errno.EIO if self.broken else errno.ENOSPC, 'the disk of the test')
        return os.write(self._handle, data[:room])

    def _allocate(self, handle, size):
        if os.fstat(self._handle).st_size + size > self.capacity:
            raise OSError(errno.ENOSPC, 'the disk of the test')
        self.allocated = size

    def release_room(self):
        self.allocated = 0
        super().release_room()


def small_disk(capacity):
    return type('Disk', (SmallDisk,), {'capacity': capacity})
