/**
 * Written by `python -m iveg.models.typescript`; change the models, not this file.
 * Lengths in metres, angles in radians, ages in seconds, times ISO-8601 UTC.
 */

/** A robot that is slowed for somebody. */
export type Acting = {
  robot_id: string;
  distance_m: number;
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
  /** Who took note. */
  acknowledged_by: string | null;
  /** What they wrote. */
  note: string | null;
  /** How often it was raised while it lived. */
  count: number;
};

/** Limit that the robot reports to apply. */
export type Applied = {
  reason: string;
  cause: string | null;
  age_s: number;
  feedback_age_s: number | null;
  faults: Fault[];
  obstacle: SeenObstacle | null;
};

/** A rectangle along the axes of ``map`` (m). */
export type Area = {
  xmin: number;
  ymin: number;
  xmax: number;
  ymax: number;
};

/** One row of the audit. */
export type AuditEntry = {
  /** ``status`` of the answer, and what was asked; of a rule the new ``version``. */
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
  /** What they did, such as `stop` or `sign_in_refused`. */
  action: string;
  /** To what, such as a robot's id; may be empty. */
  subject: string;
};

/** The battery, as the robot said last. */
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
  /** °C. */
  temperature: number | null;
  /** 0 to 1. */
  relative_humidity: number | null;
  /** ppm. */
  co2: number | null;
  received_at: string;
  age_s: number;
};

/** One STOP, release, resume or goal. */
export type Command = {
  times: CommandTimes;
  /** First standing sample less the press; null while unknown (ms). */
  standstill_ms: number | null;
  requesters: string[];
  hold_id: string | null;
  age_s: number | null;
  transports: Record<string, string>;
  robot: CommandRobot | null;
  challenge_fresh: boolean;
  /** How it ended; null on ``/live``, where ``state`` says how it stands. */
  outcome: "open" | "stood" | "not_seen_standing" | "released" | "resumed" | "refused" | "expired" | "replaced" | "reached" | "cancelled" | "deleted" | null;
  was_loud: boolean;
  /** Of a goal; on ``/live`` goals are the robot's. */
  goal: CommandGoal | null;
  /** Steps of the audit trail; empty on ``/live``, which reports each step itself. */
  steps: CommandStep[];
  /** The order (ULID). */
  command_id: string;
  /** The robot. */
  robot_id: string;
  /** What was asked. */
  kind: "stop" | "release" | "resume" | "goal";
  /** One of the nine states of STOP, `RUNNING`, `REPLACED` or `EXPIRED`. */
  state: string;
  /** Who asked first. */
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
  /** How often it was sent; all transports at once count once. */
  tries: number;
  /** Why, as a code (docs/interfaces). */
  reason: string | null;
  /** A finger pressed. */
  pressed_at: string | null;
};

/** Where a goal sends a robot, in ``map`` (m). */
export type CommandGoal = {
  kind: "here" | "aisle" | "return" | "pause";
  x: number;
  y: number;
  aisle: string | null;
};

/** The robot's last word, while a command is open. */
export type CommandRobot = {
  v: number;
  report_age_s: number | null;
  moved_m: number;
};

/** One line of the audit trail of a command. */
export type CommandStep = {
  at: string;
  state: string;
  why: string;
};

/** When each step came to be known; null where it has not yet. */
export type CommandTimes = {
  /** By the browser's corrected clock; null where no page told, or it cannot be. */
  pressed: string | null;
  requested: string;
  /** By transport, when it took it; one that has not is not there. */
  sent: Record<string, string>;
  /** By transport, when the robot said by it that it has it. */
  answer: Record<string, string>;
  /** The first standing sample. */
  standing: string | null;
};

/** A candidate beside the version in force, on the same inputs. */
export type Comparison = {
  since: string;
  until: string;
  /** The version that was in force. */
  against: number;
  /** Time of the range that was compared (s). */
  compared_s: number;
  in_force: Doings;
  candidate: Doings;
  /** How often the candidate alone would have slowed a robot. */
  would_slow: number;
  /** How often it alone would not have. */
  would_not: number;
};

/** Cells from the south-western corner, row by row: 0-100, -1 unknown. */
export type Costmap = {
  /** Metres a cell. */
  resolution: number;
  width: number;
  height: number;
  origin: Point;
  data: number[];
  /** Since the newest scan in it; null before the first. */
  age_s: number | null;
};

/** When a camera last looked at each cell of the aisles. */
export type Coverage = {
  at: string;
  /** Number of working cameras. */
  cameras: number;
  within_s: number;
  /** Share of the cells covered within that time (0-1); null without aisles. */
  share: number | null;
  lanes: LaneCoverage[];
};

/** One decision: detection, observer, rule, and the robot's reaction. */
export type Decision = {
  links: DecisionLink[];
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
  /** Why, as a code (docs/interfaces). */
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
  link: string;
  at: string | null;
  value: JsonValue;
  verdict: string;
};

/** One box of one detection frame, placed in ``map``. */
export type Detection = {
  position: Position;
  box: DetectionBox;
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
  xmin: number;
  xmax: number;
  ymin: number;
  ymax: number;
  zmin: number;
  zmax: number;
  frame_id: string;
};

/** Everything that one robot saw at one moment, faint detections included. */
export type DetectionFrame = {
  robot_id: string;
  stamp: string | null;
  transport: string;
  age_s: number;
  items: Detection[];
};

/** Whether the robot's pictures are read whole, and waited for. */
export type Detector = {
  /** By the fleet file, and not out of service. */
  required: boolean;
  missing: boolean;
  /** Who took it out of service. */
  out_by: string | null;
  out_since: string | null;
  out_reason: string | null;
};

/** Deeds of one version of the rule over a range. */
export type Doings = {
  /** Reason → seconds of a robot at half speed. */
  slowed_s: Record<string, number>;
  /** Reason → how often a robot was slowed. */
  encounters: Record<string, number>;
};

/** A zone that the robot will reach (docs/safety.md, "Foresight"). */
export type Encounter = {
  cause: string;
  reason: string;
  in_s: number;
  /** Share of encounters foretold so far ahead that came true. */
  probability: number;
  /** Where the robot will be. */
  place: Point;
  /** Where the zone's centre will be. */
  centre: Point;
  radius_m: number;
};

/** All looks at somebody, and what they come to. */
export type Evidence = {
  looks: number;
  /** Confidence of the faintest look (0 to 1). */
  least: number;
  most: number;
  /** From the first look to the newest. */
  over_s: number;
  probability: number;
};

/** A fault of a robot's own data, as the robot reports it. */
export type Fault = {
  code: string;
  about: string;
  for_s: number | null;
};

/** A fleet STOP: one command a robot. */
export type FleetPressed = {
  commands: Pressed[];
};

/** A goal, in ``map`` (m). */
export type Goal = {
  goal_id: string;
  robot_id: string;
  kind: "here" | "aisle" | "return" | "pause";
  x: number;
  y: number;
  aisle: string | null;
  by: string;
  state: "SENT" | "DRIVING" | "UNCONFIRMED" | "CANCELLING" | "REACHED" | "REFUSED" | "CANCELLED" | "DELETED" | "REPLACED";
  why: string | null;
  sent_at: string;
  answered_at: string | null;
  ended_at: string | null;
  forgotten_at: string | null;
};

/** The greenhouse as the page draws it. */
export type GreenhouseMap = {
  name: string;
  bounds: Area;
  lanes: Lane[];
  rows: Area[];
  posts: Post[];
  obstacles: Obstacle[];
};

/** State of the data path, and counters. */
export type Health = {
  ok: boolean;
  hops: HopHealth[];
  counters: Record<string, number>;
  /** State of the records of earlier runs. */
  earlier: "known" | "reading" | "unknown";
};

/** A reason why a robot may not move. */
export type Hold = {
  id: string;
  source: string;
  ack: string;
};

/** One hop of the data path from robot to screen. */
export type HopHealth = {
  hop: string;
  state: "ok" | "late" | "down" | "unknown";
  age_s: number | null;
  key: string;
  detail: string;
  /** How late measures pass it, at least. */
  lag_s: number | null;
};

/** An account with the link that begins it, which is shown this once. */
export type Invitation = {
  user: UserAccount;
  /** Null for somebody whom the identity provider vouches for. */
  code: SignInCode | null;
};

export type JsonValue = unknown;

/** A lane of the greenhouse. */
export type Lane = {
  xmin: number;
  ymin: number;
  xmax: number;
  ymax: number;
  label: string;
};

/** One aisle in cells: rows from the south, each from west to east. */
export type LaneCoverage = {
  xmin: number;
  ymin: number;
  xmax: number;
  ymax: number;
  label: string;
  columns: number;
  rows: number;
  /** Whole seconds since a camera last covered a cell; null: never. */
  ages_s: (number | null)[];
};

/** A robot's clock less the server's, as far as it is proven. */
export type LatencyClock = {
  robot_id: string;
  state: string;
  offset_ms: number | null;
  uncertainty_ms: number | null;
};

/** One kind of data. */
export type LatencyRow = {
  data: "odometry" | "detections" | "lidar";
  hops: Record<string, SegmentSpread>;
};

/** Every hop of every kind of data over the last 15 minutes. */
export type LatencyTable = {
  at: string;
  /** Null: all robots. */
  robot: string | null;
  /** Whether iVeg reads the broker itself, so that Δt₁ and Δt₂ are two numbers. */
  direct: boolean;
  rows: LatencyRow[];
  /** The paper's printed numbers, by place, kind of data and column (ms). */
  paper: Record<string, Record<string, Record<string, number>>>;
  clocks: LatencyClock[];
  /** ``cdf`` as Plotly draws it; empty if unwanted. */
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

/** The gap to a person less what stopping takes; shown, never acted on. */
export type Margin = {
  robot_id: string;
  person_id: string;
  /** Between surfaces. */
  gap_m: number;
  needs_m: number;
  margin_m: number;
  band: "clear" | "tight" | "inside" | "unknown";
  /** Age of the older position. */
  age_s: number;
};

/** One thing without which a robot is not clear (docs/safety.md, "Clear"). */
export type MissingPremise = {
  premise: "pose" | "doubt" | "detector";
  /** Whose pose, word or detector it is. */
  robot_id: string;
};

/** The robot's intent, in ``map`` (m). */
export type Navigation = {
  task: string;
  goal: Point | null;
  path: [number, number][];
};

/** A program with its token, which is shown this once. */
export type NewToken = {
  program: ProgramToken;
  token: string;
};

/** An obstacle. */
export type Obstacle = {
  xmin: number;
  ymin: number;
  xmax: number;
  ymax: number;
  kind: string;
};

/** A browser in which somebody is signed in. */
export type OpenSession = {
  session_id: string;
  name: string;
  /** That is left now; `expired`: STOP alone. */
  role: string;
  kind: "link" | "account";
  began_at: string;
  /** The one that asks. */
  own: boolean;
};

/** Whoever asks, as they are known here. */
export type OwnAccount = {
  name: string;
  role: string;
  /** How they came in. */
  method: "link" | "password" | "sso" | "token";
  /** They have one; else a link or a token. */
  account: boolean;
  /** Null for programs. */
  signed_in_at: string | null;
  /** When it ends by itself; null: never. */
  ends_at: string | null;
};

/** The world as it was at a recorded moment; ages are of that moment. */
export type PastWorld = {
  rule: Rule;
  map: GreenhouseMap;
  robots: Robot[];
  people: Person[];
  detections: Record<string, DetectionFrame>;
  /** Those that go on. */
  commands: Command[];
  alerts: Alert[];
  /** The newest 200, oldest first. */
  log: LogEntry[];
  health: Health;
  climate: Climate | null;
  equipment: Tile[];
  /** The moment that is shown: the newest by the one asked. */
  at: string;
  /** The same (Unix s). */
  at_s: number;
  /** Topics of the recording that this version does not know. */
  left_out: string[];
  scans: Scan[];
};

/** A person, or a robot outside the fleet. */
export type Person = {
  person_id: string;
  class: "person" | "robot";
  /** The detector's own class name. */
  class_id: string;
  stage: "seen" | "remembered" | "last_seen" | "gone";
  position: Position;
  /** Radius of the widest zone. */
  radius_m: number | null;
  confidence: number;
  first_seen: string;
  last_seen: string;
  age_s: number;
  observers: string[];
  /** Below the threshold but seen again and again. */
  possible: boolean;
  /** All looks by the newest detection; None of a robot. */
  evidence: Evidence | null;
  /** Seen beyond the walls: the position is its observer's. */
  doubtful: boolean;
  /** Newest open decision about this person. */
  decision_id: string | null;
  lane: string | null;
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
  x: number;
  y: number;
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
  x: number;
  y: number;
  radius: number;
};

/** A STOP, release or resume that was accepted. */
export type Pressed = {
  robot_id: string;
  command_id: string;
  state: string;
};

/** Known properties of the robot (m, m/s). */
export type Profile = {
  drive: string;
  length: number;
  width: number;
  max_speed: number;
  turning_radius: number;
};

/** A program that may call, as admins see it. */
export type ProgramToken = {
  token_id: string;
  name: string;
  scope: "read" | "stop" | "operate";
  made_at: string;
  /** The last time; null: never. */
  used_at: string | null;
  /** When it ends by itself; null: never. */
  ends_at: string | null;
  /** It has ended by itself. */
  over: boolean;
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

/** One robot with the age of what is said of it. */
export type Robot = {
  robot_id: string;
  link: "UNKNOWN" | "LIVE" | "LATE" | "LOST";
  situation: Situation;
  /** The robot's recent report; without one, the speed limit. */
  mode: "RUNNING" | "SLOW" | "STOPPED";
  pose: Pose | null;
  /** The aisle that it is in. */
  lane: string | null;
  twist: Twist | null;
  /** As the robot sent it. */
  stamp: string | null;
  received_at: string | null;
  /** At most; null while nobody knows. */
  age_s: number | null;
  age_estimated: boolean;
  /** Speed factor that the robot reports to apply. */
  speed_factor: number | null;
  applied: Applied | null;
  speed_limit: SpeedLimit;
  /** Zones that it will reach within three seconds, the soonest first. */
  encounters: Encounter[];
  /** What "clear" lacks, its reason first. */
  missing: MissingPremise[];
  detector: Detector;
  /** A setting says that it is not heard. */
  refused: boolean;
  holds: Hold[];
  stop: Command | null;
  stop_state: string;
  navigation: Navigation | null;
  /** The newest that a person gave it. */
  goal: Goal | null;
  replay: boolean;
  clock_offset_s: number | null;
  /** Transport that feeds the pose. */
  transport: string;
  profile: Profile;
  margin: Margin | null;
  /** The agent's opinion, never believed. */
  cmd_status: string | null;
  battery: Battery | null;
};

/** One version of the detection rule. */
export type Rule = {
  id: string;
  version: number;
  factor: number;
  /** A detector's word → the class that it stands for. */
  aliases: Record<string, "person" | "robot">;
  /** True; else of before it was always so. */
  possible_people: boolean;
  /** What came of the trial that it was before. */
  comparison: Comparison | null;
  author: string;
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
  robot_id: string;
  stamp: string | null;
  frame_id: string;
  points: [number, number][];
};

/** Obstacle that a robot's laser sees and nothing explains, in ``map`` (m). */
export type SeenObstacle = {
  x: number;
  y: number;
  width_m: number;
  moved: boolean;
};

/** Latency of one hop; null where nothing was measured. */
export type SegmentSpread = {
  count: number;
  mean_ms: number | null;
  p50_ms: number | null;
  p95_ms: number | null;
  p99_ms: number | null;
};

/** The name of a template and what fills its holes. */
export type Sentence = {
  key: string;
  slots: Record<string, string | boolean | number | null>;
};

/** Which iVeg speaks. */
export type Server = {
  /** Random, new at each start. */
  boot: string;
  version: string;
  demo: boolean;
  /** Its clock (Unix s). */
  wall: number;
};

/** The link of an [Invitation](#invitation), and its QR code. */
export type SignInCode = {
  link: string;
  image: string;
};

/** The worst that holds for a robot now, and what a person can do. */
export type Situation = {
  /** Of the gravest that holds for it. */
  level: "danger" | "caution" | "doubt" | "locked" | "working" | "away";
  /** What is told: the first of all that holds. */
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
  slots: Record<string, string | boolean | number | null>;
};

/** The first frame of ``/live``. */
export type Snapshot = {
  rule: Rule;
  map: GreenhouseMap;
  robots: Robot[];
  people: Person[];
  detections: Record<string, DetectionFrame>;
  /** Those that go on. */
  commands: Command[];
  alerts: Alert[];
  /** The newest 200, oldest first. */
  log: LogEntry[];
  health: Health;
  climate: Climate | null;
  equipment: Tile[];
  t: string;
  server: Server;
  user: User;
};

/** Greatest speed factor of a robot, and its reason. */
export type SpeedLimit = {
  speed_factor: number;
  reason: string;
  cause: string | null;
  distance_m: number | null;
  decision_id: string | null;
  /** Until it reaches the zone of the cause; null: it is inside. */
  foretold_s: number | null;
};

/** One mark: who is born inside its circle and stays there slows nobody. */
export type Thing = {
  thing_id: string;
  kind: "person";
  /** Of its middle in ``map``. */
  x: number;
  y: number;
  radius_m: number;
  by: string;
  since: string;
  /** When it ends at the latest. */
  until: string;
};

/** One attribute of one entity, with its newest number. */
export type Tile = {
  /** Entity and attribute. */
  key: string;
  entity_id: string;
  attribute: string;
  name: Record<string, string>;
  unit: string;
  decimals: number;
  limits: Record<string, number>;
  state: "waiting" | "ok" | "low" | "high" | "low_low" | "high_high" | "silent" | "unreadable";
  /** The newest number; null before the first. */
  value: number | null;
  received_at: string | null;
  age_s: number | null;
  trend: boolean;
  place: Point | null;
};

/** A candidate that runs beside the rule in force and acts on nothing. */
export type Trial = {
  rule: Rule;
  by: string;
  since: string;
  comparison: Comparison | null;
  /** Newest first. */
  differences: TrialDifference[];
};

/** A time in which candidate and rule in force would tell a robot otherwise. */
export type TrialDifference = {
  robot_id: string;
  /** The candidate alone would slow it; it alone would not. */
  kind: "slows" | "frees";
  reason: string;
  cause: string | null;
  decision_id: string | null;
  began: string;
  ended: string | null;
};

/** Speed (m/s) and turn rate (rad/s). */
export type Twist = {
  linear: number;
  angular: number;
};

/** The signed-in user. */
export type User = {
  name: string;
  role: string;
};

/** An account, as admins see it. */
export type UserAccount = {
  user_id: string;
  name: string;
  role: "viewer" | "operator" | "admin";
  state: "active" | "invited" | "over" | "disabled";
  /** When it ends by itself; null: never. */
  ends_at: string | null;
  /** Null where no invitation waits. */
  invited_until: string | null;
  /** Of whoever asks: another admin changes it. */
  own: boolean;
  /** The identity provider vouches for the person and gives the role. */
  provided: boolean;
};
