import {
  ProtocolError,
  readFrame,
  readScan,
  readText,
  writeStop,
} from "../../iveg/static/js/core/protocol.js";
import { scanFrame } from "./builders.js";
import { equal, test, throws } from "./harness.js";

const HEAD = { topic: "robots/AGI/scan", robot_id: "AGI", stamp: "s", age_s: 0.02 };

test("a text frame is its topic and data", () => {
  equal(readText('{"topic":"people","data":[]}'), { topic: "people", data: [] });
});

test("a scan frame keeps stamp, age and every point", () => {
  const { topic, data } = readScan(scanFrame(HEAD, [1.5, -2, 0.25, 8]));
  equal(topic, "robots/AGI/scan");
  equal([data.robot_id, data.stamp, data.age_s], ["AGI", "s", 0.02]);
  equal([...data.points], [1.5, -2, 0.25, 8]);
});

test("frames that break the contract are refused as such", () => {
  const odd = scanFrame(HEAD, [1, 2, 3]);
  const long = scanFrame(HEAD, []);
  new DataView(long).setUint32(0, 4096, true);
  const headless = scanFrame({ topic: "robots/AGI/scan" }, [1, 2]);
  for (const bad of ["{", "[]", "null", '{"topic":1,"data":1}', '{"topic":"log"}']) {
    throws(() => readFrame(bad), ProtocolError);
  }
  for (const bad of [new ArrayBuffer(2), odd, long, headless, 5]) {
    throws(() => readFrame(bad), ProtocolError);
  }
});

test("a stop names robot, press and time", () => {
  equal(JSON.parse(writeStop(null, "p", 12.5)), {
    type: "stop",
    robot_id: null,
    press_id: "p",
    pressed_at: 12.5,
  });
});
