// @ts-check
/** @import {Card, Hello, Message, Place, Recording, Round, Snapshot, State, Truth} from "./messages.js" */
import { Connection } from "./connection.js";
import { Controls } from "./controls.js";
import { LocalGame } from "./engine.js";
import { offerGallery } from "./gallery.js";
import { Headset } from "./headset.js";
import { Panel, part } from "./panel.js";
import { Player, between } from "./recording.js";
import { Rounds } from "./rounds.js";
import { Table } from "./table.js";
import { Touch } from "./touch.js";
import { Views } from "./views.js";

const given = new URLSearchParams(location.hash.slice(1));
const token = given.get("token") ?? "";
const calm = matchMedia("(prefers-reduced-motion: reduce)");
/** Whether this page lies on a host without a server: then it plays by itself, without animals. */
const alone = document.documentElement.dataset.alone !== undefined;
const SETTLED_MS = 400;
const query = token ? `?token=${encodeURIComponent(token)}` : "";

/** @type {Place | null} */ let place = null;
/** @type {Table | null} */ let table = null;
/** @type {State | null} */ let state = null;
/** @type {State | null} */ let before = null;
/** @type {Snapshot | null} */ let snapshot = null;
/** @type {Truth | null} */ let known = null;
let came = 0;
let truth = false;
let live = true;
let plays = true;
let method = "";
/** @type {number | undefined} */ let choosing;
/** Whether the connection was lost since the last moment of the game. */ let lost = false;
/** Whether where labels are is to be written anew. */ let looked = false;
/** The last step of the game that was seen. */ let reached = 0;

const panel = new Panel();
const views = new Views(part("canvas"), part("above"), part("headset"));
const player = new Player(answer);
const touch = new Touch();
/** @type {Connection | LocalGame | null} */
let connection = alone
  ? null
  : new Connection(given.get("game") ?? "new", token, startOf(given), hear, connected);
const rounds = new Rounds((message) => connection?.tell(message), () => begin(1));
const headset = new Headset(
  views.renderer,
  (pointer) => live && connection?.tell(pointer),
  (text) => panel.say(text),
  () => panel.say("Back on the page."),
);
const controls = new Controls(part("above"), views, (pointer) => live && connection?.tell(pointer));

/** @param {Message} message */
function hear(message) {
  if (message.kind === "refused") panel.say(message.reason);
  else if (message.kind === "hello") greet(message);
  else if (!live) return;
  else if (message.kind === "round") play(message);
  else if (message.kind === "snapshot") answer(message);
  else if (message.kind === "truth") learn(message);
  else pass(message);
}

/** A moment of the game has come. @param {State} now */
function pass(now) {
  before = state;
  state = now;
  came = performance.now();
  panel.show(now, true);
  if (lost) panel.say(`The connection is back${now.step < reached ? "; the server began the game anew, from the same start" : ", and the game goes on"}. ${rounds.said}`);
  if (looked || lost || !before) rounds.describe(now);
  lost = looked = false;
  reached = now.step;
  const said = place && touch.say(now, place);
  if (said && controls.keyed) part("touched").textContent = said;
}

/** @param {boolean} there */
function connected(there) {
  lost ||= !there && reached > 0;
  panel.connected(there);
}

/** @param {Hello} hello */
function greet(hello) {
  panel.meet(hello);
  if (place && !lost) panel.say(""); // it was about another game
  meet(hello, true);
  const { scene, seed, reid, gaze, round, beside } = hello;
  plays = hello.role === "player";
  /** @type {HTMLSelectElement} */ (part("watch")).value = "";
  method = reid;
  const mode = !round || round.mode === "show" ? "free" : round.mode;
  const start = new URLSearchParams({ scene, seed: String(seed), reid, gaze, mode, ...(beside && { beside }) });
  if (connection) connection.begin = new URLSearchParams(start);
  const link = new URLSearchParams({ ...(hello.game && { game: hello.game }), ...(token && { token }) });
  history.replaceState(null, "", `#${link}&${start}`);
  if (token) start.set("token", token);
  /** @type {HTMLAnchorElement} */ (part("start")).href = `#${start}`;
  if (round) play(round);
  const game = encodeURIComponent(hello.game);
  /** @type {HTMLAnchorElement} */ (part("trace")).href = `games/${game}/trace${query}`;
  controls.leave();
}

/** How a new game begins, of what a link says. @param {URLSearchParams} link */
function startOf(link) {
  const kept = ["scene", "seed", "reid", "gaze", "mode", "beside"].filter((name) => link.has(name));
  const start = new URLSearchParams(kept.map((name) => [name, String(link.get(name))]));
  const first = !link.has("game") && !link.has("mode") && !localStorage.getItem("shown");
  if (first && !calm.matches) start.set("mode", "show");
  return start;
}

/** A round has come to another stage. @param {Round} round */
function play(round) {
  if (!place) return;
  const back = rounds.round.mode !== "free" && round.mode === "free";
  const said = rounds.show(round, place, state) || (back ? "Your turn: swap two that look alike, then take your hand off the table." : "");
  // A mode shows by itself what is wrong; in free play it is asked for.
  const wanted = round.mode === "free" ? truth && !back : ["answered", "scored", "fooled"].includes(round.stage);
  if (wanted !== truth) toggleTruth();
  if (["free", "turn"].includes(round.stage)) {
    snapshot = known = null;
    part("answers").replaceChildren();
  }
  if (round.mode === "free") showRecord();
  if (round.stage === "fooled") localStorage.setItem("shown", "yes");
  if (said) panel.say(said);
}

/** Show another table. @param {Place} other @param {boolean} played whether somebody plays there */
function meet(other, played) {
  place = other;
  live = played;
  before = state = snapshot = known = null;
  table = new Table(other);
  table.furnish().catch((problem) => panel.say(`The models could not be had: ${problem}`));
  views.meet(other);
  headset.place = other;
  part("answers").replaceChildren();
  part("stands").replaceChildren();
  part("player").hidden = played;
  document.body.classList.toggle("replay", !played);
}

/** @param {Snapshot} given */
function answer(given) {
  snapshot = given;
  looked = true;
  showAnswer(true);
  if (truth && live) askTruth();
}

/** @param {Truth} given */
function learn(given) {
  known = given;
  const fooled = showAnswer(rounds.round.mode === "free");
  if (rounds.round.mode !== "free") return;
  const price = snapshot?.visit_cm;
  const counts = plays && given.fresh && fooled && price;
  if (counts && price < Number(localStorage.getItem(recordOf()) ?? Infinity)) localStorage.setItem(recordOf(), String(price));
  showRecord();
}

/** Show the last snapshot's answers. @param {boolean} spoken whether it is said how it came out */
function showAnswer(spoken) {
  if (!place || !snapshot) return null;
  const { objects } = place;
  const told = known?.number === snapshot.number ? known.labels : null;
  const is = live ? told : snapshot.detections.map((one) => objects[one.object]?.label ?? null);
  const fooled = panel.answer(place, snapshot, truth ? is : null, live ? rounds.guess : undefined);
  if (spoken && !(live && truth && !told)) panel.judge(place, snapshot, fooled, known?.fresh ?? true);
  return fooled;
}

function askTruth() {
  connection?.tell({ do: "truth" });
}

/** The name under which the least is kept: methods differ in how much they take. */
function recordOf() {
  return `record-free-${method}`;
}

function showRecord() {
  const record = localStorage.getItem(recordOf());
  part("record").textContent = record ? `Your least: ${method} fooled for ${Number(record).toFixed(1)} cm.` : "";
}

/** What is shown now. @returns {State | null} */
function moment() {
  if (!live) {
    const now = player.now();
    if (now) panel.show(now, false);
    return now;
  }
  if (!state || calm.matches || !before) return state;
  return { ...between(before, state, Math.min((performance.now() - came) * 0.03, 1)), phase: state.phase };
}

/** @param {number} _time @param {XRFrame} [room] of a headset */
function frame(_time, room) {
  const now = moment();
  if (table && now) {
    part("starting").hidden = true;
    const { numbered, round } = rounds;
    const wrong = truth ? [...now.wrong, ...((live && known?.wrong) || [])] : [];
    table.show(now, { wrong, numbered: live ? numbered : null, home: live ? (round.home ?? null) : null });
    if (room) headset.draw(table, now, room);
    else if (!headset.session) views.draw(table, now);
    document.body.dataset.step = String(now.step ?? player.time);
    document.body.dataset.phase = now.phase;
  }
}

function toggleTruth() {
  truth = !truth;
  part("truth").setAttribute("aria-pressed", String(truth));
  if (truth && live) askTruth();
  showAnswer(!live || rounds.round.mode === "free");
}

/** Begin a new game. @param {number} further added to the seed */
function begin(further = 0) {
  /** @param {string} id */
  const value = (id) => /** @type {HTMLInputElement | HTMLSelectElement} */ (part(id)).value;
  const seed = (Number(value("seed")) || 0) + further;
  connection?.tell({ do: "new", seed, mode: value("mode"), reid: value("method"), gaze: value("gaze"), beside: value("beside") });
}

/** Do something once a choice has not changed for a while: keys go through all that lie between. @param {() => void} act */
function settled(act) {
  clearTimeout(choosing);
  choosing = setTimeout(act, SETTLED_MS);
}

/** Play a recording, or with none of that name go back to the game. @param {string} name */
async function watch(name) {
  if (!name) {
    connection?.tell({ do: "hello" });
    return;
  }
  const own = name === "this game";
  const path = own ? `games/${encodeURIComponent(connection?.game ?? "")}/recording` : `recordings/${name}.json`;
  panel.say("Fetching the recording …");
  const reply = await fetch(path + query);
  if (!reply.ok) {
    panel.say(await reply.text());
    return;
  }
  const recording = /** @type {Recording} */ (await reply.json());
  meet(recording, false);
  if (name.startsWith("failure-") && !truth) toggleTruth();
  player.open(recording);
  part("news").closest("aside")?.scrollTo(0, 0);
  panel.say(recording.title);
}

async function offerRecordings() {
  const reply = await fetch(`recordings.json${query}`);
  if (!reply.ok) {
    panel.say(await reply.text());
    return;
  }
  const { recordings, gallery } = await reply.json();
  const chooser = /** @type {HTMLSelectElement} */ (part("watch"));
  for (const [name, title] of Object.entries(recordings)) chooser.add(new Option(String(title), name));
  for (const [name, { title }] of Object.entries(/** @type {Record<string, Card>} */ (gallery))) chooser.add(new Option(title, name));
  offerGallery(gallery, (name) => {
    chooser.value = name;
    watch(name).catch((problem) => panel.say(String(problem)));
  });
  if (!alone) chooser.add(new Option("This game so far", "this game"));
}

/** Begin to play without a server. */
async function playAlone() {
  const reply = await fetch("play.json");
  const { starts } = await reply.json();
  connection = new LocalGame(starts, startOf(given), hear);
}

part("ar").addEventListener("click", () => headset.begin().catch((problem) => panel.say(`No AR: ${problem}`)));
part("truth").addEventListener("click", toggleTruth);
part("look").addEventListener("click", () => controls.leave());
part("begin").addEventListener("click", () => begin());
for (const id of ["mode", "method", "gaze", "beside"]) part(id).addEventListener("change", () => settled(begin));
part("above").addEventListener("click", (event) => state && rounds.pick(views.pointAt(event.clientX, event.clientY), state));
part("start").addEventListener("click", () => setTimeout(() => location.reload()));
part("watch").addEventListener("change", () => settled(() => {
  watch(/** @type {HTMLSelectElement} */ (part("watch")).value).catch((problem) => panel.say(String(problem)));
}));
document.addEventListener("keydown", (event) => {
  const typing = event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement;
  if (!typing && event.key.toLowerCase() === "t") toggleTruth();
});
offerRecordings().catch((problem) => panel.say(String(problem)));
if (alone) playAlone().catch((problem) => panel.say(String(problem)));
views.renderer.setAnimationLoop(frame);
Headset.possible().then((can) => (part("ar").hidden = !can));
