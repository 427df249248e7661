// Plays pointers on the engine of a page without a server: node play_engine.mjs FILE; prints what came of it.
import { readFileSync } from "node:fs";
import { LocalGame } from "../../web/src/engine.js";

const { starts, seed, mode, pointers } = JSON.parse(readFileSync(process.argv[2], "utf8"));
const heard = [];
const game = new LocalGame(starts, new URLSearchParams({ seed, mode }), (message) => heard.push(message));
clearInterval(game.clock);
const steps = pointers.map((pointer) => {
  game.tell(pointer);
  game.step();
  const { x, z, yaw } = game.hand;
  return { objects: structuredClone(game.objects), hand: [x, z, yaw], held: game.held?.thing ?? null, phase: heard.at(-1).phase };
});
const told = heard.filter(({ kind }) => kind !== "state");
console.log(JSON.stringify({ steps, told, truth: game.truth(), believed: game.believed, last: heard.at(-1) }));
