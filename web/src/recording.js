// @ts-check
/** @import {Recording, Snapshot, State} from "./messages.js" */
import { part } from "./panel.js";

/** Plays a recording: a bar to drag, a button to stop and go on. */
export class Player {
  /** @param {(snapshot: Snapshot) => void} answered called when the bar passes a snapshot */
  constructor(answered) {
    this.answered = answered;
    /** @type {Recording | null} */ this.recording = null;
    this.time = 0;
    this.last = 0;
    this.running = false;
    this.said = -1;
    this.bar = /** @type {HTMLInputElement} */ (part("bar"));
    this.bar.addEventListener("input", () => this.seek(Number(this.bar.value)));
    part("run").addEventListener("click", () => this.run(!this.running));
  }

  /** @param {Recording} recording */
  open(recording) {
    this.recording = recording;
    this.bar.max = String(recording.frames.length - 1);
    this.said = -1;
    this.seek(0);
    this.run(true);
  }

  /** @param {boolean} running */
  run(running) {
    if (running && this.recording && this.time >= this.recording.frames.length - 1) this.seek(0);
    this.running = running;
    this.last = performance.now();
    part("run").textContent = running ? "Stop" : "Go on";
  }

  /** @param {number} time in frames */
  seek(time) {
    this.time = time;
    this.bar.value = String(Math.floor(time));
  }

  /** The moment that is shown now. @returns {State | null} */
  now() {
    if (!this.recording) return null;
    const { frames, rate } = this.recording;
    const clock = performance.now();
    if (this.running) {
      this.seek(Math.min(this.time + ((clock - this.last) / 1000) * rate, frames.length - 1));
      if (this.time >= frames.length - 1) this.run(false);
    }
    this.last = clock;
    const at = Math.floor(this.time);
    this.tell(at);
    return between(frames[at], frames[Math.min(at + 1, frames.length - 1)], this.time - at);
  }

  /** Say what the last snapshot before a frame answered. @param {number} at */
  tell(at) {
    const { frames } = /** @type {Recording} */ (this.recording);
    let last = at;
    while (last >= 0 && !frames[last].snapshot) last--;
    if (last !== this.said) {
      this.said = last;
      const snapshot = frames[last]?.snapshot;
      if (snapshot) this.answered(snapshot);
    }
  }
}

/**
 * A moment between two.
 *
 * @param {State} was @param {State} now @param {number} share of the way @returns {State}
 */
export function between(was, now, share) {
  /** @param {number} a @param {number} b */
  const mix = (a, b) => a + share * (b - a);
  const same = was.animals.length === now.animals.length;
  return {
    ...was,
    objects: now.objects.map(([x, z, yaw], i) => [mix(was.objects[i][0], x), mix(was.objects[i][1], z), yaw]),
    hand:
      now.hand && was.hand
        ? [mix(was.hand[0], now.hand[0]), mix(was.hand[1], now.hand[1]), now.hand[2], was.hand[3]]
        : was.hand,
    animals: same
      ? now.animals.map(([x, z, heading, goal], k) => {
          const [wx, wz, , wgoal] = was.animals[k];
          const near = wgoal === goal && Math.hypot(x - wx, z - wz) < 0.1;
          return near ? [mix(wx, x), mix(wz, z), heading, goal] : [wx, wz, heading, wgoal];
        })
      : was.animals,
  };
}
