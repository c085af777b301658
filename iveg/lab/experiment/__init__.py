"""The paper's evaluation as one command (``iveg experiment``).

``plan`` lists scenarios and repetitions.  Each run happens on a virtual clock
(``stage``, ``virtual_run``), which gives the counts, and with the real programs, which
``commands/experiment`` starts and ``observer`` and ``message_recorder`` record: each
half is a ``recording``, whose rows ``raw`` writes.  ``scoring`` and ``beliefs`` compare
both with the emulator's ground truth, ``message_times`` and ``slices`` give the times,
``statistics`` the intervals, ``outcome`` and ``run_store`` store results and progress,
``desired_states`` gives a site its robots back, ``tables``,
``report`` and ``compare`` present them beside the paper; ``runner`` starts one from the
page, ``api`` has its routes.
"""
