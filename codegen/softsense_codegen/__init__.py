"""Fixed-point networks and the C that runs them.

The leaf of the house: numpy and jinja2 only. Holds the integer semantics (one rounding rule),
the proofs about them, and the templates that turn an ``IntNetwork`` into C.
"""
