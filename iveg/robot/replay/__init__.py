"""Recorded runs, replayed as robots under the safety node of a real one.

``logs`` and ``bags`` read the two kinds of files, ``recordings`` opens either,
``playback`` is a position in one, ``replay`` runs robots from them.
"""
