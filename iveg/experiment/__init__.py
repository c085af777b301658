"""The paper's evaluation as one command (``iveg experiment``).

``plan`` lists scenarios and repetitions.  Each run happens on a virtual clock
(``stage``, ``rehearsal``), which gives the counts, and with the real programs, which
``cli/experiment`` starts, ``observer`` records and ``slices`` times.  ``scoring`` and
``believing`` compare both with the emulator's ground truth, ``statistics`` gives the
intervals, ``outcome`` and ``notebook`` store the results, ``tables``, ``report`` and
``compare`` present them beside the paper, ``progress`` shows the progress.
"""
