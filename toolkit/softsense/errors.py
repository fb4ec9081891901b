"""The one error that a user is meant to read (defined in the leaf package, named here)."""

from softsense_codegen.errors import SoftsenseError

__all__ = ["SoftsenseError"]
