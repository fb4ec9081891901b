"""Entropy and mutual information: on codes as they are, and between continuous values."""

from softsense.information.continuous import gaussian, nearest_neighbour
from softsense.information.discretise import labels_of
from softsense.information.plug_in import (
    conditional_mutual_information,
    entropy,
    mutual_information,
    subset_entropies,
)

__all__ = [
    "conditional_mutual_information",
    "entropy",
    "gaussian",
    "labels_of",
    "mutual_information",
    "nearest_neighbour",
    "subset_entropies",
]
