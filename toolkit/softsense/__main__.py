"""``python -m softsense``."""

import sys

from softsense.cli.main import main

sys.exit(main())
