// A session by the JavaScript client, and the same out of reach of the service. Prints what the test compares.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { FarmAr, FarmArError, snapshotOfXR } = await import(pathToFileURL(process.argv[2]).href);
const { url, layout, snapshot, swap, anchor } = JSON.parse(readFileSync(process.argv[3], "utf8"));
const said = {};
let reachable = true;
const ask = (...args) => (reachable ? fetch(...args) : Promise.reject(new TypeError("fetch failed")));
const client = new FarmAr(`${url}/#token=none`, { session: "from-node", fetch: ask });
await client.begin(layout, { method: "spatial" });
const ids = (reply) => reply.detections.map((one) => one.id);
const costs = (reply) => reply.detections.map((one) => one.cost);
said.first = ids(await client.identify(snapshot));
await client.confirm(swap);
const again = await client.identify(snapshot);
said.swapped = ids(again);
reachable = false;
const offline = await client.identify(snapshot);
said.unseen = await client.confirm().catch((problem) => [problem.status, problem.field]);
said.offline = [ids(offline), offline.offline, Math.max(...costs(offline).map((c, i) => Math.abs(c - costs(again)[i])))];
reachable = true;
said.undone = (await client.undo()).undone.did;
said.aligned = (await client.align({ frame: layout.frame, anchor })).aligned;
const turned = await client.identify(snapshot);
reachable = false;
const turnedHere = await client.identify(snapshot);
said.turned = [ids(turned), ids(turnedHere), Math.max(...costs(turnedHere).map((c, i) => Math.abs(c - costs(turned)[i])))];
reachable = true;
const other = new FarmAr(url, { session: "from-node" });
try {
  await other.begin(layout);
} catch (problem) {
  said.refused = [problem instanceof FarmArError, problem.status, problem.field];
}
await other.begin(layout, { replace: true, method: "spatial" });
said.revision = other.revision;

// What a browser would give: a projection of 90 degrees to the left, 45 to the right, and two tracked things.
const pose = (x, y, z) => ({ transform: { position: { x, y, z }, orientation: { x: 0, y: 0, z: 0, w: 1 } } });
const frame = { predictedDisplayTime: 2500, getPose: (space) => space };
const p = new Float32Array(16);
[p[0], p[5], p[8], p[9]] = [1, 1, 0.5, 0];
const seen = snapshotOfXR(frame, null, { transform: pose(0, 1.6, 0).transform, projectionMatrix: p }, [
  { space: pose(1, 0, -2), category: "chair", trackId: "7", size: [1, 2, 3] },
  { space: null, category: "chair" },
]);
said.xr = seen;
console.log(JSON.stringify(said));
