// @ts-check
/** @import {Hello, Message, Snapshot, State} from "./messages.js" */
import { Connection } from "./connection.js";
import { Controls } from "./controls.js";
import { Panel, part } from "./panel.js";
import { Table } from "./table.js";
import { Views } from "./views.js";

const given = new URLSearchParams(location.hash.slice(1));
const token = given.get("token") ?? "";
const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** @type {Hello | null} */ let hello = null;
/** @type {Table | null} */ let table = null;
/** @type {State | null} */ let state = null;
/** @type {State | null} */ let before = null;
/** @type {Snapshot | null} */ let snapshot = null;
let came = 0;
let truth = false;

const panel = new Panel();
const views = new Views(part("canvas"), part("above"), part("headset"));
const connection = new Connection(given.get("game") ?? "new", token, hear, (there) => panel.connected(there));
const controls = new Controls(part("above"), views, (pointer) => connection.tell(pointer));

/** @param {Message} message */
function hear(message) {
  if (message.kind === "hello") meet(message);
  else if (message.kind === "state") {
    before = state;
    state = message;
    came = performance.now();
    if (hello) panel.show(hello, state);
  } else if (message.kind === "snapshot") {
    snapshot = message;
    if (hello) panel.answer(hello, snapshot, truth);
  } else panel.say(message.reason);
}

/** @param {Hello} said */
function meet(said) {
  hello = said;
  before = state = snapshot = null;
  table = new Table(said);
  table.furnish().catch((problem) => panel.say(`The models could not be had: ${problem}`));
  views.meet(said);
  panel.meet(said);
  part("answers").replaceChildren();
  const link = new URLSearchParams({ game: said.game });
  if (token) link.set("token", token);
  history.replaceState(null, "", `#${link}`);
  const kept = /** @type {HTMLAnchorElement} */ (part("trace"));
  kept.href = `games/${encodeURIComponent(said.game)}/trace${token ? `?token=${encodeURIComponent(token)}` : ""}`;
  controls.leave();
}

/** Positions between the last two messages, so that 30 of them a second look smooth. @returns {State} */
function smooth() {
  const now = /** @type {State} */ (state);
  if (calm.matches || !before || before.animals.length !== now.animals.length) return now;
  const share = Math.min((performance.now() - came) * 0.03, 1);
  const was = before;
  /** @param {number} a @param {number} b */
  const mix = (a, b) => a + share * (b - a);
  return {
    ...now,
    objects: now.objects.map(([x, z, yaw], i) => [mix(was.objects[i][0], x), mix(was.objects[i][1], z), yaw]),
    hand:
      now.hand && was.hand
        ? [mix(was.hand[0], now.hand[0]), mix(was.hand[1], now.hand[1]), now.hand[2], now.hand[3]]
        : now.hand,
  };
}

function frame() {
  if (table && state && hello) {
    const shown = smooth();
    table.show(shown, { truth, above: true });
    views.draw(table, shown);
    document.body.dataset.step = String(state.step);
    document.body.dataset.phase = state.phase;
    document.body.dataset.snapshots = String(state.snapshots);
  }
  requestAnimationFrame(frame);
}

function toggleTruth() {
  truth = !truth;
  part("truth").setAttribute("aria-pressed", String(truth));
  if (hello && snapshot) panel.answer(hello, snapshot, truth);
}

function begin() {
  connection.tell({
    do: "new",
    seed: Number(/** @type {HTMLInputElement} */ (part("seed")).value) || 0,
    reid: /** @type {HTMLSelectElement} */ (part("method")).value,
    gaze: /** @type {HTMLSelectElement} */ (part("gaze")).value,
  });
}

part("truth").addEventListener("click", toggleTruth);
part("look").addEventListener("click", () => controls.leave());
part("begin").addEventListener("click", begin);
part("method").addEventListener("change", begin);
part("gaze").addEventListener("change", begin);
document.addEventListener("keydown", (event) => {
  const typing = event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement;
  if (!typing && event.key.toLowerCase() === "t") toggleTruth();
});
requestAnimationFrame(frame);
