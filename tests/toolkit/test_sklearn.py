"""The network as a scikit-learn regressor."""

from __future__ import annotations

import numpy as np
from sklearn.model_selection import GridSearchCV, TimeSeriesSplit
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import check_estimator

import softsense as ss
from softsense.sklearn import MlpEstimator


def test_scikit_learn_accepts_it() -> None:
    check_estimator(MlpEstimator(hidden=5, max_epochs=20))


def test_it_is_the_network_of_the_toolkit() -> None:
    """Same rows, same scaling, same starting weights: the same estimates."""
    rec = ss.simulate(ss.linear_rig(0), samples=2000, seed=0).with_sensors(["s1", "s2"])
    fitted = ss.fit(rec, hidden=8, restarts=1, max_epochs=15)
    known = np.sort(np.concatenate([fitted.split.train, fitted.split.validation]))
    ours = MlpEstimator(hidden=8, max_epochs=15).fit(rec.codes, rec.target[:, 0])
    rmse = np.sqrt(np.mean((ours.predict(rec.codes) - fitted.mlp.predict(rec.codes)[:, 0]) ** 2))
    # The toolkit scales over training and validation rows, the estimator over training rows.
    assert rmse < 0.02 * np.ptp(rec.target[known])
    assert ours.score(rec.codes, rec.target[:, 0]) > 0.95


def test_it_works_in_pipelines_and_searches() -> None:
    rec = ss.simulate(ss.linear_rig(0), samples=1200, seed=0).with_sensors(["s1", "s2"])
    search = GridSearchCV(
        make_pipeline(StandardScaler(), MlpEstimator(max_epochs=8)),
        {"mlpestimator__hidden": [2, 6]},
        cv=TimeSeriesSplit(2),
    ).fit(rec.codes, rec.target[:, 0])
    # A fit that fails scores as no number.
    assert np.isfinite(search.cv_results_["mean_test_score"]).all()
    two = MlpEstimator(hidden=4, max_epochs=5).fit(rec.codes, np.repeat(rec.target, 2, axis=1))
    assert two.predict(rec.codes[:3]).shape == (3, 2)
