"""Networks to test on."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from networks import make_network


@pytest.fixture(scope="session")
def network():
    """``network(seed=…, inputs=…, …)``: see ``make_network``."""
    return make_network
