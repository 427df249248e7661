// @ts-check
/** @import {Place, Round, Snapshot, State} from "./messages.js" */
import { part } from "./panel.js";
import { where } from "./touch.js";

/** What can be played, and what it is called. */
export const MODES = { free: "freely", show: "show me how", guess: "guess first", duel: "against the adversary", tidy: "tidy up" };

const WHO = { "farm-slot": "A trained policy", analytic: "A policy that plans" };

/** Wrong labels for ten centimetres. @param {{wrong: number, cm: number}} one */
const rate = ({ wrong, cm }) => (cm > 0 ? (10 * wrong) / cm : 0);

/** @param {string} who @param {{wrong: number, cm: number}} one */
const did = (who, one) =>
  `${who}: ${one.wrong} wrong labels for ${one.cm.toFixed(1)} cm, ${rate(one).toFixed(2)} for 10 cm.`;

/** @param {{wrong: number, cm: number}} mine @param {{wrong: number, cm: number}} its */
const verdict = (mine, its) => (rate(mine) > rate(its) ? "You win." : rate(mine) < rate(its) ? "It wins." : "A draw.");

/** What is said of a stage. @param {Round} round @returns {string} */
function saidOf(round) {
  const { mode, yours, its, of, adversary, player } = round;
  const pair = (round.pair ?? []).join(" and ");
  switch (round.stage) {
    case "showing":
      return `Watch: ${pair} look alike, and change places while the headset does not look.`;
    case "fooled":
      return `Fooled for ${round.cm?.toFixed(0)} cm: it took ${pair} for each other. Your turn!`;
    case "study":
      return "Remember which is which. An adversary then rearranges the table while you do not look.";
    case "moving":
      return mode === "tidy" ? "The table is being put out of order …" : "The adversary rearranges the table …";
    case "guess":
      return `${WHO[round.by ?? "analytic"]} was here. Which is which now? Say so before the headset does.`;
    case "leaving":
      return "The headset looks …";
    case "answered":
      return `You have ${yours} of ${of} right, the headset ${its} of ${of}.`;
    case "turn":
      return `The same table again, your turn: fool it in one visit. ${adversary ? did("The adversary", adversary) : ""}`;
    case "scored":
      return player && adversary ? `${did("You", player)} ${did("The adversary", adversary)} ${verdict(player, adversary)}` : "";
    case "tidy":
      return "Put every building back where its colour lies on the table.";
    case "tidied":
      return `${round.left_cm?.toFixed(1)} cm of ${round.start_cm?.toFixed(1)} are left after ${round.seconds?.toFixed(0)} s; the headset has ${round.right} of ${of} right.`;
    default:
      return "";
  }
}

/** What the button says in a stage, and what it asks for; null where there is none. @param {Round} round */
function onwardOf({ mode, stage }) {
  if (stage === "showing") return ["Let me play", "play"];
  if (stage === "fooled") return ["Now I try", "play"];
  if (stage === "study") return ["Rearrange it", "rearrange"];
  if (stage === "guess") return ["That is my guess", "guess"];
  if (stage === "answered" && mode === "duel") return ["Now I rearrange it", "turn"];
  if (stage === "answered" || stage === "scored" || stage === "tidied") return ["Another table", "another"];
  return null;
}

/** What is better in each mode: a number of a round that is over, and how it is said. */
const RECORDS = {
  /** @param {Round} round */
  guess: (round) => (round.stage === "answered" ? (round.yours ?? 0) - (round.its ?? 0) : null),
  /** @param {Round} round */
  duel: (round) => (round.stage === "scored" && round.player?.wrong ? rate(round.player) : null),
  /** @param {Round} round */
  tidy: (round) => (round.stage === "tidied" ? 100 * (1 - (round.left_cm ?? 0) / (round.start_cm || 1)) : null),
};
const RECORD_SAID = {
  /** @param {number} best */
  guess: (best) => `Your best: ${Math.abs(best)} ${best < 0 ? "fewer" : "more"} right than the headset.`,
  /** @param {number} best */
  duel: (best) => `Your best: ${best.toFixed(2)} wrong labels for 10 cm.`,
  /** @param {number} best */
  tidy: (best) => `Your best: ${best.toFixed(1)}% tidied up.`,
};

/** A round of one of the modes: what is asked of the player, a form to guess in, a button that goes on. */
export class Rounds {
  /**
   * @param {(message: object) => void} tell the server
   * @param {() => void} another begins another table
   */
  constructor(tell, another) {
    /** @type {Round} */ this.round = { kind: "round", mode: "free", stage: "free" };
    /** @type {Place | null} */ this.place = null;
    /** What is asked of the player now. */ this.said = "";
    this.tell = tell;
    this.another = another;
    part("onward").addEventListener("click", () => this.onward());
    part("guesses").addEventListener("change", () => this.count());
  }

  /** @param {Round} round @param {Place} place @param {State | null} state @returns {string} what is said of it */
  show(round, place, state) {
    if (round.stage !== this.round.stage) part("onward").closest("aside")?.scrollTo(0, 0);
    this.round = round;
    this.place = place;
    const onward = onwardOf(round);
    part("onward").hidden = onward === null;
    part("onward").textContent = onward ? onward[0] : "";
    part("round").hidden = round.stage === "free";
    document.body.classList.toggle("round", round.stage !== "free");
    document.body.classList.toggle("curtain", this.curtain);
    document.body.classList.toggle("waits", !["free", "fooled", "turn", "tidy", "tidied"].includes(round.stage));
    /** @type {HTMLSelectElement} */ (part("mode")).value = round.mode;
    this.ask(round.stage === "guess" ? (round.in_view ?? []) : [], state);
    this.count();
    this.describe(state);
    this.keep();
    return (this.said = saidOf(round));
  }

  /** Whether nothing is to be seen now. */
  get curtain() {
    return this.round.stage === "moving" && this.round.mode !== "tidy";
  }

  /** Buildings that have numbers in place of labels; null where labels are shown. @returns {number[] | null} */
  get numbered() {
    return ["guess", "leaving"].includes(this.round.stage) ? (this.round.in_view ?? []) : null;
  }

  /** What the player said, once the headset has answered, too. */
  get guess() {
    return this.round.stage === "answered" ? this.round.guess : undefined;
  }

  onward() {
    const onward = onwardOf(this.round);
    if (!onward) return;
    if (onward[1] === "another") this.another();
    else if (onward[1] === "guess") this.tell({ do: "guess", labels: this.guesses() });
    else this.tell({ do: onward[1] });
  }

  /** Say how many are named; with none there is nothing to send. */
  count() {
    const button = /** @type {HTMLButtonElement} */ (part("onward"));
    const guessing = this.round.stage === "guess";
    const named = Object.keys(this.guesses()).length;
    button.disabled = guessing && !named;
    if (guessing) button.textContent = `That is my guess (${named} of ${this.round.in_view?.length} named)`;
  }

  /** @returns {Record<string, string>} */
  guesses() {
    const given = /** @type {NodeListOf<HTMLSelectElement>} */ (part("guesses").querySelectorAll("select"));
    return Object.fromEntries([...given].filter((one) => one.value).map((one) => [one.dataset.object, one.value]));
  }

  /** @param {number[]} indices of buildings that the player is to name @param {State | null} state */
  ask(indices, state) {
    const { objects } = /** @type {Place} */ (this.place);
    const rows = indices.map((index, k) => {
      const kind = objects[index].category;
      const labels = objects.filter((one) => one.category === kind && !one.fixed).map((one) => one.label);
      const chooser = document.createElement("select");
      chooser.dataset.object = String(index);
      chooser.append(new Option("?", ""), ...labels.map((label) => new Option(label, label)));
      chooser.setAttribute("aria-label", `Number ${k + 1}, a ${kind}${state ? `, ${where(state.objects[index])}` : ""}`);
      const row = document.createElement("li");
      row.append(chooser);
      return row;
    });
    part("guesses").replaceChildren(...rows);
  }

  /** Choose for the building nearest to a point of the table. @param {[number, number] | null} point @param {State} state */
  pick(point, state) {
    if (!point || !this.numbered?.length) return;
    /** @param {number} i */
    const away = (i) => Math.hypot(state.objects[i][0] - point[0], state.objects[i][1] - point[1]);
    const nearest = this.numbered.reduce((a, b) => (away(a) <= away(b) ? a : b));
    /** @type {HTMLElement | null} */ (part("guesses").querySelector(`[data-object="${nearest}"]`))?.focus();
  }

  /** Say to screen readers what stands where, as far as the player is to know. @param {State | null} state */
  describe(state) {
    const { mode, stage, home } = this.round;
    const poses = mode === "tidy" ? home : state?.believed; // where labels are, not what bears them
    const { objects } = /** @type {Place} */ (this.place);
    const known = ["free", "study", "turn"].includes(stage) || mode === "tidy";
    const rows = (known && poses ? objects : []).map((one, i) => {
      const row = document.createElement("li");
      row.textContent = `${one.label}: ${where(/** @type {[number, number, number][]} */ (poses)[i])}`;
      return row;
    });
    part("stands").replaceChildren(...rows);
  }

  /** Keep what is better than before, and say the best. */
  keep() {
    const { mode } = this.round;
    if (mode === "free" || mode === "show") return;
    const value = RECORDS[mode](this.round);
    const kept = localStorage.getItem(`record-${mode}`);
    const best = value === null || (kept !== null && Number(kept) >= value) ? kept : String(value);
    if (best !== null) localStorage.setItem(`record-${mode}`, best);
    part("record").textContent = best === null ? "" : RECORD_SAID[mode](Number(best));
  }
}
