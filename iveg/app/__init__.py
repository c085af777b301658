"""Composition root of the DSS: settings → parts.  Wires, decides nothing."""

from iveg.app.dss import Dss

__all__ = ["Dss"]
