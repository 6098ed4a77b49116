"""What the tests share is found by this path, for they are imported one by one (importmode importlib)."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
