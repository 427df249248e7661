// Compares the answers of the JavaScript method with those of the vectors in a file.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { Spatial } = await import(pathToFileURL(process.argv[2]).href);
const { vectors } = JSON.parse(readFileSync(process.argv[3], "utf8"));
let wrong = 0;
vectors.forEach(({ layout, snapshot, labels, costs }, k) => {
  const found = new Spatial(layout).identify(snapshot).detections;
  const right = found.every((one, i) => {
    const near = costs[i] === null ? one.cost === null : Math.abs(one.cost - costs[i]) <= 1e-9 * (1 + costs[i]);
    return one.id === labels[i] && near && (one.id === null) === (one.reason !== null);
  });
  if (!right || found.length !== labels.length) {
    wrong += 1;
    if (wrong < 4) console.log(`vector ${k}:`, found.map((one, i) => [one.id, labels[i], one.cost, costs[i]]));
  }
});
console.log(`${vectors.length} vectors, ${wrong} wrong`);
