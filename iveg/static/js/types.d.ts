/**
 * Written by `python -m iveg.models.typescript`; change the models, not this file.
 * Lengths in metres, angles in radians, ages in seconds, times ISO-8601 UTC.
 */

/** A robot that is slowed for somebody. */
export type Acting = {
  /** To the centre of the zone (m). */
  distance_m: number;
  /** The robot. */
  robot_id: string;
  /** Whether the robot could see them itself. */
  in_sight: boolean;
};

/** An alert to people: all occurrences of one kind and subject as one. */
export type Alert = {
  /** Values of its sentence. */
  slots: Record<string, string | boolean | number | null>;
  /** The alert. */
  alert_id: string;
  /** The gravest of what holds and of what nobody has acknowledged. */
  priority: "P1" | "P2" | "P3";
  /** Template of its sentence; `slots` fill it. */
  key: string;
  /** The first time. */
  raised_at: string;
  /** The newest time. */
  last_raised_at: string;
  /** The robot, if it is about one. */
  robot_id: string | null;
  /** It was over; none: it is not. */
  cleared_at: string | null;
  /** A person took note. */
  acknowledged_at: string | null;
  /** Person who took note. */
  acknowledged_by: string | null;
  /** Note of that person. */
  note: string | null;
  /** Number of its occurrences. */
  count: number;
};

/** Limit that the robot reports to apply. */
export type Applied = {
  /** Of the report (s). */
  age_s: number;
  /** Faults of its own data. */
  faults: Fault[];
  /** Obstacle of its laser that nothing explains. */
  obstacle: SeenObstacle | null;
  /** `clear`, `person`, `robot`, `stale`, `doubt`, `unsupervised`, `hold`, `watchdog`, `obstacle`. */
  reason: string;
  /** Id of the person, robot or hold. */
  cause: string | null;
  /** Of the feedback that the robot had (s). */
  feedback_age_s: number | null;
};

/** A rectangle along the axes of ``map`` (m). */
export type Area = {
  /** Sides (m). */
  xmin: number;
  /** Sides (m). */
  ymin: number;
  /** Sides (m). */
  xmax: number;
  /** Sides (m). */
  ymax: number;
};

/** One row of the audit. */
export type AuditEntry = {
  /** `status` of the answer, and the request; of a rule the new `version`. */
  details: Record<string, JsonValue>;
  /** The row; one offered twice is stored once. */
  audit_id: string;
  /** It happened. */
  at: string;
  /** Id of the account. */
  person: string;
  /** Name of the account, as it was then. */
  name: string;
  /** Their role then. */
  role: string;
  /** Way of signing in. */
  method: string;
  /** The act, such as `stop` or `sign_in_refused`. */
  action: string;
  /** Its object, such as a robot's id; may be empty. */
  subject: string;
};

/** Battery of a robot, by its newest message. */
export type Battery = {
  age_s: number | null;
  /** charge (0–1) */
  percentage: number | null;
  /** whether it charges (–) */
  charging: boolean | null;
  /** voltage (V) */
  voltage: number | null;
};

/** The newest reading of the air; null where a sensor is silent. */
export type Climate = {
  /** When iVeg took it. */
  received_at: string;
  /** Since then (s). */
  age_s: number;
  /** °C. */
  temperature: number | null;
  /** 0 to 1. */
  relative_humidity: number | null;
  /** ppm. */
  co2: number | null;
};

/** One STOP, release, resume or goal. */
export type Command = {
  /** When each step came to be known; each has a key of its own, too, named as in the CSV. */
  times: CommandTimes;
  /** First standing sample less the press; null while unknown (ms). */
  standstill_ms: number | null;
  /** All people who pressed. */
  requesters: string[];
  /** What a STOP is called at the robot: its own `command_id` unless it keeps an earlier hold; null for others. */
  hold_id: string | null;
  /** Since it was requested (s). */
  age_s: number | null;
  /** By transport: `ok`, `failed`, `off`, `pending` or `unknown`, see above. */
  transports: Record<string, string>;
  /** The robot's last word while it is open. */
  robot: CommandRobot | null;
  /** A release may be composed now. */
  challenge_fresh: boolean;
  /** How it ended; null on `/live`, where `state` says how it stands. */
  outcome: "open" | "stood" | "not_seen_standing" | "released" | "resumed" | "refused" | "expired" | "replaced" | "reached" | "cancelled" | "deleted" | null;
  /** It was UNCONFIRMED or STILL_MOVING at any time. */
  was_loud: boolean;
  /** Of a goal; on `/live` goals are the robot's. */
  goal: CommandGoal | null;
  /** Steps of the audit trail; empty on `/live`, which reports each step itself. */
  steps: CommandStep[];
  /** The order (ULID). */
  command_id: string;
  /** The robot. */
  robot_id: string;
  /** Kind of the order. */
  kind: "stop" | "release" | "resume" | "goal";
  /** One of the nine states of STOP, `RUNNING`, `REPLACED` or `EXPIRED`. */
  state: string;
  /** Person who gave it first. */
  requested_by: string;
  /** iVeg took the order. */
  requested_at: string;
  /** This transport first took it. */
  sent_fiware_at: string | null;
  /** This transport first took it. */
  sent_direct_at: string | null;
  /** The robot first said by it that it has it. */
  answer_fiware_at: string | null;
  /** The robot first said by it that it has it. */
  answer_direct_at: string | null;
  /** First sample at rest. */
  standing_at: string | null;
  /** Number of times it was sent; all transports at once count once. */
  tries: number;
  /** Reason, as a code (docs/interfaces). */
  reason: string | null;
  /** A finger pressed. */
  pressed_at: string | null;
};

/** Where a goal sends a robot, in ``map`` (m). */
export type CommandGoal = {
  /** What was asked for. */
  kind: "here" | "aisle" | "return" | "pause";
  /** The place in `map` (m). */
  x: number;
  /** The place in `map` (m). */
  y: number;
  /** Label of the lane, of `aisle`. */
  aisle: string | null;
};

/** The robot's last word, while a command is open. */
export type CommandRobot = {
  /** Speed (m/s). */
  v: number;
  /** At most, its way included; null while nobody knows (s). */
  report_age_s: number | null;
  /** How far it may have driven since (m). */
  moved_m: number;
};

/** One line of the audit trail of a command. */
export type CommandStep = {
  /** When. */
  at: string;
  /** State from then on. */
  state: string;
  /** What led to it. */
  why: string;
};

/** When each step came to be known; null where it has not yet. */
export type CommandTimes = {
  /** By the browser's corrected clock; null where no page sent it, or where it is impossible. */
  pressed: string | null;
  /** Accepted by the server. */
  requested: string;
  /** By transport, when the order left; a transport that has not taken it has no key. */
  sent: Record<string, string>;
  /** By transport, when the robot said by it that it has it. */
  answer: Record<string, string>;
  /** The first standing sample. */
  standing: string | null;
};

/** A candidate beside the version in force, on the same inputs. */
export type Comparison = {
  /** Begin of the range. */
  since: string;
  /** Its end. */
  until: string;
  /** Time of the range that was compared (s). */
  compared_s: number;
  /** Deeds of the version in force. */
  in_force: Doings;
  /** Deeds of the candidate. */
  candidate: Doings;
  /** The version that was in force. */
  against: number;
  /** Times that only the candidate would have slowed a robot. */
  would_slow: number;
  /** Times that only the version in force slowed one. */
  would_not: number;
};

/** Cells from the south-western corner, row by row: 0-100, -1 unknown. */
export type Costmap = {
  /** Metres a cell. */
  resolution: number;
  /** `width` is 0 before the first scan (cells). */
  width: number;
  /** `width` is 0 before the first scan (cells). */
  height: number;
  /** South-western corner (m). */
  origin: Point;
  /** Rows from the south-western corner: 0 free … 100 taken, −1 unknown. */
  data: number[];
  /** Since the newest scan in it; null before the first. */
  age_s: number | null;
};

/** Time of the last view of each cell of the aisles. */
export type Coverage = {
  /** When. */
  at: string;
  /** Number of working cameras. */
  cameras: number;
  /** 10 (s). */
  within_s: number;
  /** Share of the cells covered within that time (0-1); null without aisles. */
  share: number | null;
  /** One for each aisle. */
  lanes: LaneCoverage[];
};

/** One decision: detection, observer, rule, and the robot's reaction. */
export type Decision = {
  /** The chain of evidence. */
  links: DecisionLink[];
  /** The sentence that the log used. */
  sentence: Sentence;
  /** The decision (ULID). */
  decision_id: string;
  /** `alert` (somebody was confirmed) or `mandate` (a speed limit). */
  kind: "alert" | "mandate";
  /** Robot that was limited, or saw. */
  robot_id: string;
  /** The rule fired. */
  started_at: string;
  /** The track. */
  person_id: string | null;
  /** Robot that saw it. */
  observer: string | null;
  /** Canonical class; none: unknown to the table of classes. */
  class: string | null;
  /** Class as the detector said. */
  class_id: string | null;
  /** Confidence of the detection (0 to 1). */
  confidence: number | null;
  /** Place of what was seen or judged; none where it is no longer kept (m). */
  x: number | null;
  /** Place of what was seen or judged; none where it is no longer kept (m). */
  y: number | null;
  /** Place of what was seen or judged; none where it is no longer kept (m). */
  z: number | null;
  /** From the robot to the centre of the zone (m). */
  distance_m: number | null;
  /** The limit (0, 0.5 or 1). */
  speed_factor: number | null;
  /** Reason, as a code (docs/interfaces). */
  reason: string | null;
  /** The rule. */
  rule_id: string | null;
  /** Its version. */
  rule_version: string | null;
  /** Its parameters at that moment, with `places`. */
  rule_parameters: Record<string, unknown>;
  /** Whether the robot itself could see the cause. */
  in_sight: boolean | null;
  /** The feedback left. */
  feedback_at: string | null;
  /** The robot reported the factor. */
  applied_at: string | null;
  /** The speed had come down. */
  observed_at: string | null;
  /** The rule let go; none: not yet. */
  ended_at: string | null;
  /** Speed measured at `started_at` (m/s). */
  speed_before: number | null;
  /** Speed at `observed_at` (m/s). */
  speed_after: number | null;
};

/** One link of the chain of evidence. */
export type DecisionLink = {
  /** Its name; a last link `interrupted` says that iVeg was interrupted, with the time when that was found. */
  link: string;
  /** When. */
  at: string | null;
  /** Measured value. */
  value: JsonValue;
  /** `ok`, `late`, `missing`, `n/a`, `open` or `unknown`, see above. */
  verdict: string;
};

/** One box of one detection frame, placed in ``map``. */
export type Detection = {
  /** Centre in `map` (m). */
  position: Position;
  /** As sent. */
  box: DetectionBox;
  /** The robot of the fleet that was seen. */
  peer: string | null;
  /** The robot. */
  robot_id: string;
  /** Class as the detector said. */
  class_id: string;
  /** Confidence of the detection (0 to 1). */
  probability: number;
  /** Whether it reached the threshold of the rule in force. */
  confident: boolean;
  /** Transport whose copy was first: `direct` or `fiware`. */
  transport: string;
  /** Time of the picture as the robot sent it. */
  stamp: string | null;
  /** Canonical class; none: unknown to the table of classes. */
  class: string | null;
  /** The track. */
  person_id: string | null;
};

/** A 3D box (m) in ``frame_id``. */
export type DetectionBox = {
  /** Sides (m). */
  xmin: number;
  /** Sides (m). */
  xmax: number;
  /** Sides (m). */
  ymin: number;
  /** Sides (m). */
  ymax: number;
  /** Sides (m). */
  zmin: number;
  /** Sides (m). */
  zmax: number;
  /** `map` or `base_link`. */
  frame_id: string;
};

/** Everything that one robot saw at one moment, faint detections included. */
export type DetectionFrame = {
  /** The observer. */
  robot_id: string;
  /** As the robot sent it. */
  stamp: string | null;
  /** `fiware` or `direct`, of the copy that was first. */
  transport: string;
  /** Of the frame (s). */
  age_s: number;
  /** The detections. */
  items: Detection[];
};

/** Whether the robot's pictures are read whole, and required. */
export type Detector = {
  /** By the fleet file, and not out of service. */
  required: boolean;
  /** Nothing proves now that it works. */
  missing: boolean;
  /** Who took it out of service. */
  out_by: string | null;
  /** When. */
  out_since: string | null;
  /** Why. */
  out_reason: string | null;
};

/** Deeds of one version of the rule over a range. */
export type Doings = {
  /** Reason → seconds of a robot at half speed. */
  slowed_s: Record<string, number>;
  /** Reason → number of times that a robot was slowed. */
  encounters: Record<string, number>;
};

/** A zone that the robot will reach (docs/safety.md, "Foresight"). */
export type Encounter = {
  /** Id of the person or robot. */
  cause: string;
  /** `person` or `robot`. */
  reason: string;
  /** Time to it (s). */
  in_s: number;
  /** Share of forecasts this far ahead that came true. */
  probability: number;
  /** Where the robot will be. */
  place: Point;
  /** Where the zone's centre will be. */
  centre: Point;
  /** Radius of the zone (m). */
  radius_m: number;
};

/** All looks at a person, and their sum. */
export type Evidence = {
  /** Number of looks; 0.3 s of pictures of a robot are one. */
  looks: number;
  /** That it is a person (0–1). */
  probability: number;
  /** Confidence of the faintest look (0 to 1). */
  least: number;
  /** Confidence of the surest look (0 to 1). */
  most: number;
  /** From the first look to the newest (s). */
  over_s: number;
};

/** A fault of a robot's own data, as the robot reports it. */
export type Fault = {
  /** Such as `no_transform`. */
  code: string;
  /** Such as `map → odom`. */
  about: string;
  /** How long (s). */
  for_s: number | null;
};

/** A fleet STOP: one command a robot. */
export type FleetPressed = {
  /** One for each robot. */
  commands: Pressed[];
};

/** A goal, in ``map`` (m). */
export type Goal = {
  /** ULID. */
  goal_id: string;
  /** What was asked for. */
  kind: "here" | "aisle" | "return" | "pause";
  /** The place in `map` (m). */
  x: number;
  /** The place in `map` (m). */
  y: number;
  /** When it was given. */
  sent_at: string;
  /** The robot's first word of it. */
  answered_at: string | null;
  /** When it came to its last state. */
  ended_at: string | null;
  /** When the robot itself first said that it drives there no longer. */
  forgotten_at: string | null;
  /** Whose. */
  robot_id: string;
  /** Label of the lane, of `aisle`. */
  aisle: string | null;
  /** Who gave it. */
  by: string;
  /** State of the goal, see above. */
  state: "SENT" | "DRIVING" | "UNCONFIRMED" | "CANCELLING" | "REACHED" | "REFUSED" | "CANCELLED" | "DELETED" | "REPLACED";
  /** Code of the robot's refusal or of its end. */
  why: string | null;
};

/** The greenhouse as the page draws it. */
export type GreenhouseMap = {
  /** Its name. */
  name: string;
  /** Walls (m). */
  bounds: Area;
  /** Aisles (m). */
  lanes: Lane[];
  /** Crop rows (m). */
  rows: Area[];
  /** Round obstacles (m). */
  posts: Post[];
  /** What else stands in the way (m). */
  obstacles: Obstacle[];
};

/** State of the data path, and counters. */
export type Health = {
  /** Every hop is. */
  ok: boolean;
  /** One for each hop. */
  hops: HopHealth[];
  /** Events by name. */
  counters: Record<string, number>;
  /** State of the records of earlier runs. */
  earlier: "known" | "reading" | "unknown";
};

/** A reason why a robot may not move. */
export type Hold = {
  /** ULID of a STOP, or the robot's own. */
  id: string;
  /** Where it comes from. */
  source: "iveg" | "boot" | "hw" | "bumper" | "link";
  /** Who may lift it: `remote`, `local`, `auto`. */
  ack: "remote" | "local" | "auto";
};

/** One hop of the data path from robot to screen. */
export type HopHealth = {
  /** `mqtt`, `orion`, `iot_agent`, `notifications` or `database`. */
  hop: string;
  /** How it is. */
  state: "ok" | "late" | "down" | "unknown";
  /** Of the evidence (s). */
  age_s: number | null;
  /** Its sentence. */
  key: string;
  /** What else is known. */
  detail: string;
  /** How late measures pass it, at least. */
  lag_s: number | null;
};

/** An account with the link that begins it, which is shown this once. */
export type Invitation = {
  /** The account. */
  user: UserAccount;
  /** Null for a person of the identity provider. */
  code: SignInCode | null;
};

export type JsonValue = unknown;

/** A lane of the greenhouse. */
export type Lane = {
  /** Sides (m). */
  xmin: number;
  /** Sides (m). */
  ymin: number;
  /** Sides (m). */
  xmax: number;
  /** Sides (m). */
  ymax: number;
  /** Its name. */
  label: string;
};

/** One aisle in cells: rows from the south, each from west to east. */
export type LaneCoverage = {
  /** Sides (m). */
  xmin: number;
  /** Sides (m). */
  ymin: number;
  /** Sides (m). */
  xmax: number;
  /** Sides (m). */
  ymax: number;
  /** The aisle. */
  label: string;
  /** Its size (cells). */
  columns: number;
  /** Its size (cells). */
  rows: number;
  /** Whole seconds since a camera last covered a cell; null: never. */
  ages_s: (number | null)[];
};

/** A robot's clock less the server's, as far as it is proven. */
export type LatencyClock = {
  /** Whose. */
  robot_id: string;
  /** `in_step`, `assumed`, `corrected`, `untrusted`, `unknown`. */
  state: string;
  /** Robot − server (ms). */
  offset_ms: number | null;
  /** Of the offset (ms). */
  uncertainty_ms: number | null;
};

/** One kind of data. */
export type LatencyRow = {
  /** Which. */
  data: "odometry" | "detections" | "lidar";
  /** By hop: `uplink`, `fiware`, `robot_orion`, `iveg`, `screen`. */
  hops: Record<string, SegmentSpread>;
};

/** Every hop of every kind of data over the last 15 minutes. */
export type LatencyTable = {
  /** When. */
  at: string;
  /** Null: all robots. */
  robot: string | null;
  /** Whether iVeg reads the broker itself, so that Δt₁ and Δt₂ are two numbers. */
  direct: boolean;
  /** One for each kind of data. */
  rows: LatencyRow[];
  /** The paper's printed numbers, by place, kind of data and column (ms). */
  paper: Record<string, Record<string, Record<string, number>>>;
  /** One for each robot. */
  clocks: LatencyClock[];
  /** `cdf` as Plotly draws it; empty if unwanted. */
  figures: Record<string, unknown>;
};

/** One line of the action and inference log. */
export type LogEntry = {
  /** Values of its sentence. */
  slots: Record<string, string | boolean | number | null>;
  /** Number of the line in the live log; it rises. */
  id: number;
  /** It happened. */
  at: string;
  /** `detection`, `speed`, `command`, `link`, `alert` or `system`. */
  kind: string;
  /** Template of its sentence; `slots` fill it. */
  key: string;
  /** The robot, if it is about one. */
  robot_id: string | null;
  /** Canonical class; none: unknown to the table of classes. */
  class: string | null;
  /** The decision behind it. */
  decision_id: string | null;
};

/** Distance to a person less the stopping distance; shown, never acted on. */
export type Margin = {
  /** Between surfaces (m). */
  gap_m: number;
  /** S_p (m). */
  needs_m: number;
  /** Gap less S_p (m). */
  margin_m: number;
  /** `clear` from 1 m, `tight` from 0, `inside` below 0; `unknown`, see above. */
  band: "clear" | "tight" | "inside" | "unknown";
  /** Age of the older position (s). */
  age_s: number;
  /** The pair. */
  robot_id: string;
  /** The pair. */
  person_id: string;
};

/** One thing without which a robot is not clear (docs/safety.md, "Clear"). */
export type MissingPremise = {
  /** Unmet condition. */
  premise: "pose" | "doubt" | "detector";
  /** Whose pose, word or detector it is. */
  robot_id: string;
};

/** The robot's intent, in ``map`` (m). */
export type Navigation = {
  /** Name of the task. */
  task: string;
  /** Where it goes (m). */
  goal: Point | null;
  /** Planned path (m). */
  path: [number, number][];
};

/** A program with its token, which is shown this once. */
export type NewToken = {
  program: ProgramToken;
  /** For `Authorization: Bearer`; shown this once. */
  token: string;
};

/** An obstacle. */
export type Obstacle = {
  /** Sides (m). */
  xmin: number;
  /** Sides (m). */
  ymin: number;
  /** Sides (m). */
  xmax: number;
  /** Sides (m). */
  ymax: number;
  /** What it is. */
  kind: string;
};

/** A browser in which somebody is signed in. */
export type OpenSession = {
  session_id: string;
  name: string;
  /** Role that is left now; `expired`: STOP alone. */
  role: string;
  /** How they signed in. */
  kind: "link" | "account";
  /** The sign-in. */
  began_at: string;
  /** It is the caller's own session. */
  own: boolean;
};

/** Account, link or token of the caller. */
export type OwnAccount = {
  /** How they signed in. */
  method: "link" | "password" | "sso" | "token";
  /** They have one; else a link or a token. */
  account: boolean;
  /** Null for programs. */
  signed_in_at: string | null;
  /** When it ends by itself; null: never. */
  ends_at: string | null;
  /** Name in log and audit. */
  name: string;
  /** Role, which says what they may do. */
  role: string;
};

/** The world as it was at a recorded moment; ages are of that moment. */
export type PastWorld = {
  /** As `GET /rule`. */
  rule: Rule;
  /** As `GET /map`. */
  map: GreenhouseMap;
  /** All robots. */
  robots: Robot[];
  /** All people. */
  people: Person[];
  /** By robot id. */
  detections: Record<string, DetectionFrame>;
  /** Those that go on. */
  commands: Command[];
  /** As the topic. */
  alerts: Alert[];
  /** The newest 200, oldest first. */
  log: LogEntry[];
  /** As the topic. */
  health: Health;
  /** As the topic. */
  climate: Climate | null;
  /** As the topic. */
  equipment: Tile[];
  /** Moment of the picture: the newest that is not after the moment asked for. */
  at: string;
  /** The same moment (Unix s). */
  at_s: number;
  /** Topics of the recording that this version does not know. */
  left_out: string[];
  /** Newest of each robot. */
  scans: Scan[];
};

/** A person, or a robot outside the fleet. */
export type Person = {
  /** The track: `P` (person) or `R` (robot), a number that starts anew each day (UTC), and a suffix that is new each day and at each start of iVeg, so that no id comes twice. */
  person_id: string;
  /** Canonical class. */
  class: "person" | "robot";
  /** The detector's own class name. */
  class_id: string;
  /** `seen` ≤ 1 s, `remembered` ≤ 10 s, `last_seen` ≤ 10 min. Somebody who was never seen for 2.5 s at a time is `last_seen` for 1 min at most, and only until the place was seen to be empty. */
  stage: "seen" | "remembered" | "last_seen" | "gone";
  /** In `map` (m). */
  position: Position;
  /** Radius of the widest zone. */
  radius_m: number | null;
  /** Of the newest detection; 0.5 where only a laser saw it (0–1). */
  confidence: number;
  /** First and newest detection. */
  first_seen: string;
  /** First and newest detection. */
  last_seen: string;
  /** Since the newest detection (s). */
  age_s: number;
  /** Robots that saw it. */
  observers: string[];
  /** Below the threshold but seen again and again. */
  possible: boolean;
  /** All looks by the newest detection; None of a robot. */
  evidence: Evidence | null;
  /** Seen beyond the walls: the position is its observer's. */
  doubtful: boolean;
  /** Newest open decision about this person. */
  decision_id: string | null;
  /** Aisle in which it is. */
  lane: string | null;
  /** Robots that are slowed for it. */
  acting: Acting[];
  /** The mark by which it is no person and has no zone. */
  thing_id: string | null;
};

/** A place in ``map`` (m). */
export type Point = {
  x: number;
  y: number;
};

/** Pose of ``base_link`` in ``map``. */
export type Pose = {
  /** Position (m). */
  x: number;
  /** Position (m). */
  y: number;
  /** Heading (rad). */
  yaw: number;
};

/** A place in ``map`` with its height (m). */
export type Position = {
  x: number;
  y: number;
  z: number;
};

/** A round thing (m). */
export type Post = {
  /** Centre (m). */
  x: number;
  /** Centre (m). */
  y: number;
  /** Radius (m). */
  radius: number;
};

/** A STOP, release or resume that was accepted. */
export type Pressed = {
  /** Robot that the order is for. */
  robot_id: string;
  /** Id of the order. */
  command_id: string;
  /** `REQUESTED`, or its present state. */
  state: string;
};

/** Known properties of the robot (m, m/s). */
export type Profile = {
  /** Its steering. */
  drive: "differential" | "ackermann";
  /** Footprint (m). */
  length: number;
  /** Footprint (m). */
  width: number;
  /** Greatest speed (m/s). */
  max_speed: number;
  /** Least turning radius (m). */
  turning_radius: number;
};

/** A program that may call, as admins see it. */
export type ProgramToken = {
  made_at: string;
  /** The last time; null: never. */
  used_at: string | null;
  /** When it ends by itself; null: never. */
  ends_at: string | null;
  /** It has ended by itself. */
  over: boolean;
  /** The id is never given anew. */
  token_id: string;
  /** The id is never given anew. */
  name: string;
  /** `stop` reads, too; `operate` does what an operator may. */
  scope: "read" | "stop" | "operate";
};

/** One reading: the sensor's own fields by name ([mqtt.md](mqtt.md)). */
export type Reading = {
  /** It reached iVeg. */
  at: string;
  /** The robot. */
  robot_id: string;
  /** The sensor, such as `battery`. */
  kind: string;
  /** Its quantities by name (docs/interfaces/mqtt.md). */
  value: Record<string, unknown>;
};

/** One robot with the age of its data. */
export type Robot = {
  /** The robot; also its entity at Orion. */
  robot_id: string;
  /** Age of the pose ([safety.md](../safety.md), "Age"). */
  link: "UNKNOWN" | "LIVE" | "LATE" | "LOST";
  /** Its gravest situation, with the action open to a person. */
  situation: Situation;
  /** The robot's recent report; without one, the speed limit. */
  mode: "RUNNING" | "SLOW" | "STOPPED";
  /** Of `base_link` in `map` (m, rad). */
  pose: Pose | null;
  /** The aisle that it is in. */
  lane: string | null;
  /** Measured speed (m/s, rad/s). */
  twist: Twist | null;
  /** As the robot sent it. */
  stamp: string | null;
  /** When iVeg took it. */
  received_at: string | null;
  /** At most; null: unknown. */
  age_s: number | null;
  /** The robot echoes no feedback, so its age is an estimate (≈). */
  age_estimated: boolean;
  /** Speed factor that the robot reports to apply. */
  speed_factor: number | null;
  /** The robot's newest safety report. */
  applied: Applied | null;
  /** The speed limit that iVeg tells the robot. */
  speed_limit: SpeedLimit;
  /** Zones that it will reach within three seconds, soonest first. */
  encounters: Encounter[];
  /** Unmet conditions of "clear", its reason first. */
  missing: MissingPremise[];
  /** Whether its pictures are read, and required. */
  detector: Detector;
  /** A setting excludes its messages. */
  refused: boolean;
  /** Why it may not move. */
  holds: Hold[];
  /** The open STOP. Each try changes `tries` and `transports`, also while the robot is silent. */
  stop: Command | null;
  /** `RUNNING`, or one of the nine states of [safety.md](../safety.md). */
  stop_state: string;
  /** Its intent. */
  navigation: Navigation | null;
  /** Newest goal that a person gave it. */
  goal: Goal | null;
  /** It plays a recording. */
  replay: boolean;
  /** Robot's clock less the server's; for display (s). */
  clock_offset_s: number | null;
  /** Transport that feeds the pose. */
  transport: string;
  /** Its body, as far as known. */
  profile: Profile;
  /** Its least margin to a person. */
  margin: Margin | null;
  /** The agent's opinion, never believed. */
  cmd_status: string | null;
  battery: Battery | null;
};

/** One version of the detection rule. */
export type Rule = {
  /** The rule. */
  id: string;
  /** One more with each change. */
  version: number;
  /** 0.5, a constant (0–1). */
  factor: number;
  /** A detector's word → the class that it stands for. */
  aliases: Record<string, "person" | "robot">;
  /** True; false only in versions from before it was always so. */
  possible_people: boolean;
  /** Result of its trial; null where it had none. */
  comparison: Comparison | null;
  /** Who set it; `settings` for settings that differ from those of the last start, `upgrade` for what a new iVeg made of the last version. */
  author: string;
  /** In force from then on. */
  since: string | null;
  /** Least confidence that raises an alert, inclusive. From 0 to 1. */
  confidence_threshold: number;
  /** `confidence_threshold` by class, where it differs. */
  class_thresholds: Record<string, number>;
  /** Zone round a person or peer while fresh, inclusive (m). From 0.5 to 6. */
  radius_m: number;
  /** `radius_m` by class, where it differs. */
  class_radii_m: Record<string, number>;
  /** Whether a robot slows before it reaches a zone, to be slow there. */
  foresight: boolean;
  /** How far ahead that looks (s). From 0.5 to 3. */
  foresight_s: number;
};

/** One sweep: points in ``map`` (m). */
export type Scan = {
  /** Whose. */
  robot_id: string;
  /** As the robot sent it. */
  stamp: string | null;
  /** `map`. */
  frame_id: string;
  /** Where something came back (m). */
  points: [number, number][];
};

/** Obstacle that a robot's laser sees and nothing explains, in ``map`` (m). */
export type SeenObstacle = {
  /** Its middle in `map` (m). */
  x: number;
  /** Its middle in `map` (m). */
  y: number;
  /** From its first return to its last (m). */
  width_m: number;
  /** It walks, or has walked since it was seen first. */
  moved: boolean;
};

/** Latency of one hop; null where nothing was measured. */
export type SegmentSpread = {
  /** Messages. */
  count: number;
  /** Mean, exact (ms). */
  mean_ms: number | null;
  /** Quantiles, within 1 % (ms). */
  p50_ms: number | null;
  /** Quantiles, within 1 % (ms). */
  p95_ms: number | null;
  /** Quantiles, within 1 % (ms). */
  p99_ms: number | null;
};

/** The name of a template and what fills its holes. */
export type Sentence = {
  /** Template. */
  key: string;
  /** Values. */
  slots: Record<string, string | boolean | number | null>;
};

/** Which iVeg speaks. */
export type Server = {
  /** Random, new at each start. */
  boot: string;
  /** Of iVeg. */
  version: string;
  /** Started by `iveg demo`. */
  demo: boolean;
  /** Its clock (Unix s). */
  wall: number;
};

/** The link of an [Invitation](#invitation), and its QR code. */
export type SignInCode = {
  /** Begins the account, once. */
  link: string;
  /** Its QR code as a data address. */
  image: string;
};

/** Gravest situation of a robot, with the action open to a person. */
export type Situation = {
  /** Values of the sentences: `distance` (m), `lane`, `factor`, `seconds`, `age` (s), `about`, `code`, `by`, `boot`, `level` (0–1). */
  slots: Record<string, string | boolean | number | null>;
  /** Gravest level that holds for it. */
  level: "danger" | "caution" | "doubt" | "locked" | "working" | "away";
  /** The first kind, in their fixed order, that holds for it. */
  kind: "disobeys" | "lost_moving" | "stop_failed" | "stop_unknown" | "stop_under_way" | "moved" | "another_iveg" | "recording_live" | "contradiction" | "blind" | "lost" | "person" | "laser" | "robot" | "unsure" | "locked" | "battery" | "working" | "away";
  /** Its sentence is `situation.is.{state}`. */
  state: string;
  /** The reason that is applied. */
  cause: string;
  /** Its sentence is `situation.why.{why}`. */
  why: string | null;
  /** The person, robot or hold of the cause. */
  about: string | null;
  /** Its sentence is `situation.do.{action}`. */
  action: "none" | "press_stop" | "red_button" | "as_moving" | "check_robot" | "check_camera" | "check_network" | "check_fleet_file" | "stop_other_iveg" | "charge" | "release" | "unlock" | "resume";
  /** The strictest speed factor in force. */
  factor: number | null;
};

/** The first frame of ``/live``. */
export type Snapshot = {
  /** As `GET /rule`. */
  rule: Rule;
  /** As `GET /map`. */
  map: GreenhouseMap;
  /** All robots. */
  robots: Robot[];
  /** All people. */
  people: Person[];
  /** By robot id. */
  detections: Record<string, DetectionFrame>;
  /** Those that go on. */
  commands: Command[];
  /** As the topic. */
  alerts: Alert[];
  /** The newest 200, oldest first. */
  log: LogEntry[];
  /** As the topic. */
  health: Health;
  /** As the topic. */
  climate: Climate | null;
  /** As the topic. */
  equipment: Tile[];
  /** When. */
  t: string;
  /** Who answers. */
  server: Server;
  /** Who asks. */
  user: User;
};

/** Greatest speed factor of a robot, and its reason. */
export type SpeedLimit = {
  /** From the robot to the centre of the zone (m). */
  distance_m: number | null;
  /** Until it reaches the zone of the cause; null: it is inside. */
  foretold_s: number | null;
  /** The limit (0–1). */
  speed_factor: number;
  /** `clear`, `person`, `robot`, `doubt`, `stale` or `unsupervised`. */
  reason: string;
  /** Id of the person or robot. */
  cause: string | null;
  /** The decision behind it. */
  decision_id: string | null;
};

/** One mark: a track that begins within its radius and stays there slows nobody. */
export type Thing = {
  /** Always `person`. */
  kind: "person";
  /** Its middle in `map` (m). */
  x: number;
  /** Its middle in `map` (m). */
  y: number;
  /** 0.5, a constant (m). */
  radius_m: number;
  /** When. */
  since: string;
  /** When it ends at the latest. */
  until: string;
  /** The mark. */
  thing_id: string;
  /** Who marked it. */
  by: string;
};

/** One attribute of one entity, with its newest number. */
export type Tile = {
  /** Entity and attribute. */
  key: string;
  /** What people call it, by language. */
  name: Record<string, string>;
  /** [equipment.md](../equipment.md), "States". */
  state: "waiting" | "ok" | "low" | "high" | "low_low" | "high_high" | "silent" | "unreadable";
  /** The newest number; null before the first. */
  value: number | null;
  /** When iVeg took it. */
  received_at: string | null;
  /** Since then (s). */
  age_s: number | null;
  /** Its last 24 hours are drawn. */
  trend: boolean;
  /** Of its mark on the map. */
  place: Point | null;
  /** The entity at Orion. */
  entity_id: string;
  /** Its attribute. */
  attribute: string;
  /** Of `value` and `limits`; `1`: none. */
  unit: string;
  /** That people are shown. */
  decimals: number;
  /** `low_low`, `low`, `high`, `high_high`, those that it has (its unit). */
  limits: Record<string, number>;
};

/** A candidate that runs beside the rule in force and acts on nothing. */
export type Trial = {
  /** The candidate; its `version` is that of the rule that it was made from. */
  rule: Rule;
  /** Who began it. */
  by: string;
  /** When. */
  since: string;
  /** So far; null in the first two seconds. */
  comparison: Comparison | null;
  /** Newest first. */
  differences: TrialDifference[];
};

/** A period in which candidate and rule in force limit a robot differently. */
export type TrialDifference = {
  /** From then on. */
  began: string;
  /** Until then; null: it goes on. */
  ended: string | null;
  /** The robot. */
  robot_id: string;
  /** The candidate alone would slow it; it alone would not. */
  kind: "slows" | "frees";
  /** Reason of the slowing limit, as in [SpeedLimit](#speedlimit). */
  reason: string;
  /** Its person or robot; a candidate counts people by itself, so where it alone slows this need not be the name on the map. */
  cause: string | null;
  /** Decision of the rule in force; null where it has none. */
  decision_id: string | null;
};

/** Speed (m/s) and turn rate (rad/s). */
export type Twist = {
  /** Forward (m/s). */
  linear: number;
  /** Turn rate (rad/s). */
  angular: number;
};

/** The signed-in user. */
export type User = {
  name: string;
  role: string;
};

/** An account, as admins see it. */
export type UserAccount = {
  /** The id is never given anew. */
  user_id: string;
  /** `over`: it ended by itself. */
  state: "active" | "invited" | "over" | "disabled";
  /** When it ends by itself; null: never. */
  ends_at: string | null;
  /** Null where no invitation waits. */
  invited_until: string | null;
  /** It is the caller's own, which only another admin may change. */
  own: boolean;
  /** The identity provider vouches for the person and gives the role. */
  provided: boolean;
  /** The id is never given anew. */
  name: string;
  role: "viewer" | "operator" | "admin";
};
