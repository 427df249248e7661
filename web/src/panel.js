// @ts-check
/** @import {Hello, Snapshot, State} from "./messages.js" */
import { colourOf, inkOn } from "./palette.js";

const CM = 100;

/** @template {HTMLElement} T @param {string} id @returns {T} */
export const part = (id) => /** @type {T} */ (document.getElementById(id));

/** @param {string} id of a select @param {string[]} names @param {string} chosen */
function choose(id, names, chosen) {
  part(id).replaceChildren(...names.map((name) => new Option(name, name, false, name === chosen)));
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
    part("role").textContent = hello.role === "viewer" ? "You watch: somebody else plays this game." : "";
    /** @type {HTMLInputElement} */ (part("seed")).value = String(hello.seed);
  }

  /** @param {Hello} hello @param {State} state */
  show(hello, state) {
    part("phase").textContent =
      state.phase === "hand" ? "Hand in view: the animals wait" : "The animals run";
    part("effort").textContent =
      `${(state.effort_m * CM).toFixed(1)} cm, ${((state.effort_rad * 180) / Math.PI).toFixed(0)}° moved`;
    const astray = state.misplaced.reduce((sum, n) => sum + n, 0);
    const home = state.counts.reduce((sum, n) => sum + n, 0);
    part("counts").textContent = `${home} home, ${astray} of them in a wrong building`;
    if (state.over) this.say("This game has gone on for two hours; begin a new one.");
  }

  /** @param {Hello} hello @param {Snapshot} snapshot @param {boolean} truth whether wrong answers are marked */
  answer(hello, snapshot, truth) {
    const movable = snapshot.detections.filter((one) => !hello.objects[one.object]?.fixed);
    const rows = movable.map((one) => {
      const row = document.createElement("li");
      const name = document.createElement("span");
      name.className = "name";
      name.textContent = one.label ?? "none";
      const colour = one.label ? colourOf(one.label) : "#dddddd";
      name.style.background = colour;
      name.style.color = inkOn(colour);
      const sure = document.createElement("span");
      sure.textContent = one.confidence === null ? "" : `${Math.round(one.confidence * CM)}% sure`;
      row.append(name, sure);
      if (truth && !one.right) {
        const really = document.createElement("strong");
        really.textContent = `✗ is ${hello.objects[one.object]?.label ?? "nothing"}`;
        row.append(really);
      }
      return row;
    });
    part("answers").replaceChildren(...rows);
    const seen = movable.length;
    const fooled = movable.filter((one) => !one.right).length;
    const verdict = fooled ? `It was fooled: ${fooled} of ${seen} wrong.` : `All ${seen} right.`;
    this.say(
      truth
        ? `Snapshot ${snapshot.number}. ${verdict}`
        : `Snapshot ${snapshot.number}: ${seen} buildings named. Do you believe it? Press T to see.`,
    );
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
