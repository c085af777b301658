import { ProtocolError, readFrame } from "../../iveg/static/js/core/protocol.js";
import { pointsOf } from "../../iveg/static/js/core/telemetry.js";
import { telemetryFrame } from "./builders.js";
import { equal, near, test, throws } from "./harness.js";

const SWEEP = {
  topic: "robots/AGI/scan",
  at: 7,
  robot_id: "AGI",
  stamp: "s",
  age_s: 0.1,
  x: 10,
  y: 5,
  yaw: Math.PI / 2,
  angle_min: 0,
  angle_increment: Math.PI / 2,
  unit_m: 0.005,
  count: 3,
};

/** @param {ArrayBuffer} bytes @returns {import("../../iveg/static/js/core/telemetry.js").Telemetry} */
const read = (bytes) => /** @type {any} */ (readFrame(bytes).data);

test("a frame tells states before moves, so that no state makes a move older", () => {
  const state = { topic: "robots/AGI", at: 1, data: { mode: "SLOW" } };
  const changed = [{ person_id: "P1", at: 0.5 }];
  const people = { topic: "people", at: 2, data: { ids: ["P1"], changed } };
  const move = ["AGI", 3, 0.01, 1, 2, 0.5, 0.4, 0.1, "stamp"];
  const { frame, told } = read(
    telemetryFrame({ frame: 9, parts: [state, people], moves: [move] }),
  );
  equal(frame, 9);
  equal(
    told.map(({ topic, at }) => [topic, at]),
    [
      ["robots/AGI/state", 1],
      ["people/P1", 0.5],
      ["people/ids", 2],
      ["robots/AGI/move", 3],
    ],
  );
  equal(told[3].data, {
    robot_id: "AGI",
    age_s: 0.01,
    pose: { x: 1, y: 2, yaw: 0.5 },
    twist: { linear: 0.4, angular: 0.1 },
    stamp: "stamp",
  });
});

test("a scan's ranges become points in the map; what did not return is none", () => {
  const points = pointsOf(SWEEP, new Uint16Array([200, 0xffff, 400]));
  const wanted = [10, 6, 10, 3];
  equal(points.length, 4);
  for (const [i, value] of wanted.entries()) near(points[i], value, 1e-5);
});

test("half a scan is refused", () => {
  throws(
    () => readFrame(telemetryFrame({ frame: 1, scans: [SWEEP] }, [1, 2])),
    ProtocolError,
  );
});
