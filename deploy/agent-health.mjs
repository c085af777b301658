// Reports whether the IoT Agent receives measures, and ends an agent that does not.
//
// An agent with a broken subscription answers /iot/about with 200 and receives no robot
// any more.  iVeg sends a heartbeat probe through broker and agent every two seconds;
// while iVeg and the broker are up and no probe has reached Orion for ten seconds, the
// agent has stopped receiving.  After ten seconds more it is ended, and the restart
// policy starts it afresh.  Runs as the
// container's health check; exit code 0 is healthy.

import fs from "node:fs";
import net from "node:net";

const { env } = process;
const SILENT_SINCE = env.AGENT_SILENT_SINCE || "/tmp/agent-silent-since";
const LIMIT_MS = Number(env.AGENT_SILENCE_MS || 10000);
const PARENT = Number(env.AGENT_PARENT || 1);
const TIMEOUT_MS = 1500;

async function get(url, headers = {}) {
  try {
    return await fetch(url, { headers, signal: AbortSignal.timeout(TIMEOUT_MS) });
  } catch {
    return null;
  }
}

function listens(host, port) {
  return new Promise((resolve) => {
    const socket = net.connect({ host, port, noDelay: true, timeout: TIMEOUT_MS });
    const end = (answer) => {
      socket.destroy();
      resolve(answer);
    };
    socket.on("connect", () => end(true));
    socket.on("timeout", () => end(false));
    socket.on("error", () => end(false));
  });
}

/** Age of the last heartbeat probe at Orion (ms); null where that says nothing of the agent. */
async function probeAge() {
  const singer = await get(`${env.AGENT_SINGER_URL}/healthz`);
  if (!singer?.ok || !(await listens(env.IOTA_MQTT_HOST, env.IOTA_MQTT_PORT))) {
    return null;
  }
  const orion = `http://${env.IOTA_CB_HOST}:${env.IOTA_CB_PORT}`;
  const query = "type=Probe&attrs=dateModified&options=keyValues";
  const found = await get(`${orion}/v2/entities/iveg-canary?${query}`, {
    "Fiware-Service": env.IVEG_FIWARE_SERVICE,
    "Fiware-ServicePath": env.IVEG_FIWARE_SERVICEPATH,
  });
  if (!found?.ok) return null;
  const { dateModified } = await found.json();
  return Date.now() - Date.parse(dateModified);
}

/** How long it has been deaf by our own checks (ms); the first check starts the count. */
function silentFor() {
  try {
    return Date.now() - Number(fs.readFileSync(SILENT_SINCE, "utf8"));
  } catch {
    fs.writeFileSync(SILENT_SINCE, String(Date.now()));
    return 0;
  }
}

/** Ends what the container's init started.  A hung agent takes no other signal. */
function end() {
  for (const name of fs.readdirSync("/proc").filter((one) => /^\d+$/.test(one))) {
    try {
      const stat = fs.readFileSync(`/proc/${name}/stat`, "utf8");
      const parent = Number(stat.slice(stat.lastIndexOf(")") + 2).split(" ")[1]);
      if (parent === PARENT && Number(name) !== process.pid) {
        process.kill(Number(name), "SIGKILL");
      }
    } catch {
      // It ended by itself in the meantime.
    }
  }
}

async function main() {
  const about = await get(`http://127.0.0.1:${env.IOTA_NORTH_PORT}/iot/about`);
  const age = about?.ok ? await probeAge() : LIMIT_MS + 1;
  if (age === null || age <= LIMIT_MS) {
    fs.rmSync(SILENT_SINCE, { force: true });
    return 0;
  }
  const silent = silentFor();
  console.log(`stopped receiving: ${about?.ok ? `no probe for ${age} ms` : "no answer"}`);
  if (silent >= LIMIT_MS) end();
  return 1;
}

process.exit(await main());
