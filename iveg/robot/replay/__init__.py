"""Recorded runs, replayed as robots under the safety node of a real one.

``logs`` and ``bags`` read files; ``replay`` opens either and runs robots from them.
"""
