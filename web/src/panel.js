// @ts-check
/** @import {Detection, Hello, Place, Snapshot, State} from "./messages.js" */
import { colourOf, inkOn } from "./palette.js";
import { MODES } from "./rounds.js";

/** @template {HTMLElement} T @param {string} id @returns {T} */
export const part = (id) => /** @type {T} */ (document.getElementById(id));

/** @param {string} id of a select @param {string[]} names @param {string} chosen */
function choose(id, names, chosen) {
  part(id).replaceChildren(...names.map((name) => new Option(name || "none", name, false, name === chosen)));
}

/**
 * An answer in writing: the label, how sure, and whether it is wrong.
 *
 * @param {Detection} one @param {string | null | undefined} truth what it really is; undefined for what is not said
 * @param {boolean} [brief] without what it really is
 */
function told(one, truth, brief) {
  const name = document.createElement("span");
  name.className = "name";
  name.textContent = one.label ?? "none";
  const colour = one.label ? colourOf(one.label) : "#dddddd";
  name.style.background = colour;
  name.style.color = inkOn(colour);
  const parts = [name];
  if (one.confidence !== null) {
    const sure = document.createElement("span");
    sure.textContent = `${Math.round(one.confidence * 100)}% sure`;
    parts.push(sure);
  }
  if (truth !== undefined && one.label !== truth) {
    const really = document.createElement("strong");
    really.textContent = brief ? "✗" : `✗ is ${truth ?? "nothing"}`;
    parts.push(really);
  }
  return parts;
}

/** What the player said of a detection. @param {Detection} one @param {Record<string, string>} guess @returns {Detection} */
function guessed(one, guess) {
  return { ...one, label: guess[one.object] ?? null, confidence: null };
}

/** What is written beside the table: how the game stands, what the headset answered, what happens. */
export class Panel {
  constructor() {
    this.said = "";
  }

  /** @param {Hello} hello */
  meet(hello) {
    choose("method", hello.methods, hello.reid);
    choose("gaze", hello.gazes, hello.gaze);
    const turn = Math.round(100 * Math.hypot(hello.width, hello.depth));
    part("price").textContent = `A turn by angle a counts as ${turn} cm × sin(a/2).`;
    part("mode").replaceChildren(...Object.entries(MODES).map(([mode, name]) => new Option(name, mode)));
    /** @type {HTMLSelectElement} */ (part("mode")).value = hello.round?.mode ?? "free";
    choose("beside", ["", ...hello.methods], hello.beside ?? "");
    const alone = document.documentElement.dataset.alone !== undefined;
    const here = alone ? "No animals run here: they, other methods and adversaries come with farm-ar itself." : "";
    const said = { player: here, viewer: "You watch: somebody else plays this game.", watcher: "An environment, as it is played." };
    part("role").textContent = said[hello.role];
    if (hello.role === "watcher") document.documentElement.dataset.watcher = "";
    /** @type {HTMLInputElement} */ (part("seed")).value = String(hello.seed);
  }

  /** @param {State} state @param {boolean} live whether somebody plays */
  show(state, live) {
    part("phase").textContent =
      state.caption || (state.phase === "hand" ? "Hand in view: the animals wait" : "The animals run");
    part("effort").textContent = live ? this.price(state) : "";
    part("counts").textContent = `${state.arrived} home, ${state.astray} of them in a wrong building`;
    if (state.over) this.say("This game has gone on for two hours; begin a new one.");
  }

  /** @param {State} state */
  price(state) {
    if (state.left_cm !== undefined) return `${state.left_cm.toFixed(1)} cm are left to tidy up.`;
    const moved = `${state.visit_cm.toFixed(1)} cm moved in this visit, ${state.effort_cm.toFixed(1)} cm in all`;
    return state.par_cm === null
      ? moved
      : `${moved}. Nobody can fool it with less than ${state.par_cm.toFixed(1)} cm in one visit.`;
  }

  /**
   * @param {Place} place
   * @param {Snapshot} snapshot
   * @param {(string | null)[] | null} truth what the detections really are, where wrong answers are marked
   * @param {Record<string, string>} [guess] labels that the player gave
   * @returns {number | null} how many answers are wrong, null where that is not known
   */
  answer(place, snapshot, truth, guess) {
    const known = snapshot.detections.map((one, k) => ({ one, is: truth ? truth[k] : undefined }));
    const movable = known.filter(({ one }) => !place.objects[one.object]?.fixed);
    const others = guess ? movable.map(({ one }) => guessed(one, guess)) : (snapshot.beside?.detections ?? []);
    const beside = new Map(others.map((one) => [one.object, one]));
    const rows = movable.map(({ one, is }) => {
      const row = document.createElement("li");
      row.append(...told(one, is));
      const other = beside.get(one.object);
      if (other) {
        const before = document.createElement("span");
        before.textContent = `${guess ? "you" : snapshot.beside?.reid}:`;
        row.append(before, ...told(other, is, true));
      }
      return row;
    });
    part("answers").replaceChildren(...rows);
    return truth ? movable.filter(({ one, is }) => one.label !== is).length : null;
  }

  /**
   * Say how a snapshot came out.
   *
   * @param {Place} place @param {Snapshot} snapshot @param {number | null} fooled how many answers are wrong
   * @param {boolean} fresh whether the headset knew where everything was before the visit
   */
  judge(place, snapshot, fooled, fresh) {
    const seen = snapshot.detections.filter((one) => !place.objects[one.object]?.fixed).length;
    const price = snapshot.visit_cm === undefined ? "" : ` for ${snapshot.visit_cm.toFixed(1)} cm`;
    if (fooled === null) this.say(`Snapshot ${snapshot.number}: ${seen} buildings named. Do you believe it? Press T to see.`);
    else if (fooled && !fresh) this.say(`Snapshot ${snapshot.number}. ${fooled} of ${seen} wrong, after earlier visits: no record.`);
    else if (fooled) this.say(`Snapshot ${snapshot.number}. It was fooled${price}: ${fooled} of ${seen} wrong.`);
    else this.say(`Snapshot ${snapshot.number}. All ${seen} right.`);
  }

  /** Say it in writing, and to screen readers. @param {string} text */
  say(text) {
    if (text === this.said) return;
    this.said = text;
    part("news").textContent = text;
  }

  /** @param {boolean} there */
  connected(there) {
    part("lost").hidden = there;
  }
}
