"""Composition root of the DSS: settings → parts.  Wires, decides nothing."""
