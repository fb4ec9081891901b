"""Why a simulated recording disagrees with a real one: where, which effect, how far it shrinks."""

from softsense.diagnose.engine import Diagnosis, augment, diagnose

__all__ = ["Diagnosis", "augment", "diagnose"]
