"""Verification: every evaluator must answer every vector with the reference's bits."""

from softsense.verify.verification import Comparison, Verification, verify

__all__ = ["Comparison", "Verification", "verify"]
