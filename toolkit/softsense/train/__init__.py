"""Training: the static network of one tanh layer, by Levenberg-Marquardt."""

from softsense.train.all_subsets import Settings, fit_all
from softsense.train.comparison import Agreement, compare
from softsense.train.fitting import Fit, fit

__all__ = ["Agreement", "Fit", "Settings", "compare", "fit", "fit_all"]
