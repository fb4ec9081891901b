"""Training: the static network of one tanh layer, by Levenberg-Marquardt."""

from softsense.train.fitting import Fit, fit

__all__ = ["Fit", "fit"]
