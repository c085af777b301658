"""The paper's evaluation as one command (``iveg experiment run``).

``plan`` lists scenarios and repetitions.  Each run happens on a virtual clock
(``stage``), which gives the counts, and with the real programs, which
``commands/experiment`` starts and ``messages`` listens to.  ``scoring`` and
``protection`` compare both with the emulator's ground truth, ``outcome`` gives the
results and writes raw data, ``report`` presents them beside the paper.
"""
