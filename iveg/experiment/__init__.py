"""The paper's evaluation as one command (``iveg experiment``).

``plan`` says which scenarios run how often.  Each is played on a virtual clock
(``stage``, ``rehearsal``), from which everything is counted, and through the real
programs, which ``cli/experiment`` starts, ``watching`` listens to and ``slices`` times.
``scoring`` and ``believing`` hold both against the emulator's truth, ``statistics``
says how sure that is, ``outcome`` and ``notebook`` keep it, ``tables``, ``report`` and
``compare`` show it beside the paper, ``progress`` says how far it is.
"""
