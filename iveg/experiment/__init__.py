"""The paper's evaluation as one command (``iveg experiment``).

``cli/experiment`` starts the real programs; here is what they are asked and what is
made of it: ``plan`` says which scenarios run how often, ``watching`` listens to what
comes out, ``scoring`` holds it against the emulator's truth, ``statistics`` says how
sure that is, ``outcome`` and ``notebook`` keep it, ``report`` and ``compare`` show it
beside the paper.
"""
