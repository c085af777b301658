"""Notes of the report: what each of its tables counts, and how."""

EMULATED = (
    "Robots, their cameras and detector, laser, odometry, people and greenhouse are "
    "emulated; the detector makes mistakes at the rates of one of the paper's tables. "
    "The robots' software, MQTT, IoT Agent and Orion (embedded unless another was "
    "named), iVeg and its page are the real programs."
)
COUNTED = (
    "“Here” is counted on a virtual clock: the emulated world, the robots' own safety "
    "machines and all of iVeg between its doors, without programs and sockets, so that "
    "the same seed gives the same counts on any machine. “Here, real time” is the same "
    "scenario through all programs (MQTT, IoT Agent, Orion, /live), where counts "
    "depend on when programs get the processor. Every picture counts: a target in view "
    "that was told (TP) or not (FN), a box that belongs to none (FP); boxes match from "
    "an overlap of one half at the target's true size, in the robot's own frame, so "
    "that an error of its pose is none of its detector. Brackets are 95 % Wilson "
    "intervals, in which two seconds of one robot at one target are worth one count, "
    "as mistakes last so long."
)
TIMED = (
    "All times are of the real programs. Δt₁ robot → broker, Δt₂ broker → Orion's "
    "notification, both by a reader of its own that does nothing else; total = Δt₁ + "
    "Δt₂ of the same messages. Messages of which Orion's copy was read first are in "
    "none of the three; their share is told. Δt₃ decision, by iVeg's own account, of "
    "all that it read; no page was open, so that Δt₄ is not told."
)


PROTECTED = (
    "Was anybody near a moving robot unprotected? Seconds are of a person within 2 m "
    "of a robot that moves, and the share of them in which it was limited to half "
    "speed: people in view of some camera, people behind plants (as the robot that is "
    "near sees them), and people who are neither. An encounter is one robot near one "
    "person in view; its delay counts from in view and near. Needless: limited with "
    "nobody within so many metres, of the driving time. “Scenarios” are the runs of "
    "this experiment; the others, with two robots among four people at work, differ "
    "in detector and rule alone: “iveg” as it stands, “paper” Algorithm 2 alone "
    "(single boxes, no laser, no foresight)."
)
ENTERED = (
    "How robots reached the ring of 2 m around somebody: foretold so long before, and "
    "at what share of the speed that they wanted. Who stepped out from behind plants "
    "less than two seconds before, and who is in no camera's view, are told apart. In "
    "real time nobody notes what was foretold."
)


FAILING = (
    "The test without a line of sight on the plan of AgroConnect, on the virtual "
    "clock. Navigation gives up and links have gaps at rates that are set by us; who "
    "is missed near a robot is measured. A run fails by navigation, by a robot that "
    "iVeg did not hear for five seconds or at the end (link), by touching somebody, or "
    "by an encounter in which a robot was never slowed (missed)."
)
