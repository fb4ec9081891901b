"""Which sensors: rank subsets of every size, and choose."""

from softsense.select.ranking import Ranking, Selection, Subset, rank, select

__all__ = ["Ranking", "Selection", "Subset", "rank", "select"]
