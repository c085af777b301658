"""Where the milliseconds go: each message timed at each hop that it passed.

::

    robot's stamp ──Δt₁──> broker ──Δt₂──> Orion ──Δt₃──> decision ──Δt₄──> painted
                   uplink          fiware          iveg            screen
                  └────────── robot_orion ────────┘

The paper tabulates Δt₁ (robot to MQTT broker) and Δt₂ (broker to IoT Agent to Orion),
section "Temporal determinism"; Δt₃ and Δt₄ go on from there to the eye.  ``watch`` is
what the doors call, ``stream`` follows one kind of data of one robot, ``offset`` says
how far its clock can be believed, ``series`` and ``sketch`` keep what was measured in
bounded room, ``behind`` puts overload into a sentence.
"""
