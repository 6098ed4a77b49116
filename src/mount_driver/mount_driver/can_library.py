"""python-can and cantools, loaded without what they need only for a format of files that no node reads.

Wherever asammdf is installed, `import can` loads it and with it pandas: 4.3 s and 90 MB more for each node
(measured). So every package takes both from here.
"""

import sys

_BESIDE = 'asammdf'

_absent = _BESIDE not in sys.modules
if _absent:
    sys.modules[_BESIDE] = None  # type: ignore[assignment]  # an import fails, as where it is not installed
try:
    import can
    import cantools
    from can.interfaces.socketcan import SocketcanBus
    from can.interfaces.udp_multicast.utils import pack_message
    from can.interfaces.virtual import VirtualBus
    from cantools.database.can import Database, Message
    from cantools.database.can.signal import Signal
finally:
    if _absent:
        del sys.modules[_BESIDE]

__all__ = [
    'Database', 'Message', 'Signal', 'SocketcanBus', 'VirtualBus', 'can', 'cantools', 'pack_message',
]  # fmt: skip
