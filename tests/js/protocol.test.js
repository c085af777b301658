import { ProtocolError, readFrame } from "../../iveg/static/js/core/protocol.js";
import { telemetryFrame } from "./builders.js";
import { test, throws } from "./harness.js";

test("frames that break the contract are refused as such", () => {
  const long = telemetryFrame({ frame: 1 });
  new DataView(long).setUint32(0, 4096, true);
  const headless = telemetryFrame(/** @type {any} */ ({ topic: "robots/AGI/scan" }));
  for (const bad of ["{", "[]", "null", '{"topic":1,"data":1}', '{"topic":"log"}']) {
    throws(() => readFrame(bad), ProtocolError);
  }
  for (const bad of [new ArrayBuffer(2), long, headless, 5]) {
    throws(() => readFrame(bad), ProtocolError);
  }
});
