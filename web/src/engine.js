// @ts-check
/** @import {Hello, Message, Round, State} from "./messages.js" */
/** @import {Pose} from "./footprints.js" */
import { Spatial } from "../../clients/js/farm-ar.js";
import { TOUCHING_M, apart, corners, outward } from "./footprints.js";

/**
 * How a game without a server begins: what a server would tell first, and what only the referee knows.
 *
 * @typedef {{hello: Hello, state: State, weights: {translation: number, rotation: number},
 *   eye: {x: number, z: number, yaw: number, left: number, right: number, range: number},
 *   rest: [number, number], plan: [number, number, number, number][], pair: string[]}} Start
 * @typedef {{x: number | null, z: number | null, grip: boolean, turn: number}} Pointer
 */

const STEPS_PER_SECOND = 30;
const HAND_M = 1.5 / STEPS_PER_SECOND;
const SHOWN_M = 0.5 / STEPS_PER_SECOND;
const HAND_RAD = Math.PI / STEPS_PER_SECOND;
const REACH_M = 0.06;
const WAITS_Z = -0.5;
const ARM = { half: 0.03, elbow: -0.45, points: 96 };
const TICKS = 2;
const AWAY_TICKS = (TICKS * STEPS_PER_SECOND) / 2;
/** Of the way back along which room is looked for; halvings between two steps of it. */
const STRIDE_M = 0.005;
const HALVINGS = 20;

/** @param {number} angle */
const wrap = (angle) => Math.atan2(Math.sin(angle), Math.cos(angle));

/**
 * The game on a page without a server: it hears a pointer and tells what the server would, by the paper's method.
 * There are no animals.
 */
export class LocalGame {
  /** @type {Pose[]} */ objects = [];
  /** @type {Pose[]} */ believed = [];
  /** @type {Pose[]} */ stood = [];
  /** @type {number[]} the object of each label */ holder = [];
  /** @type {(string | null)[]} what was in the last snapshot */ labels = [];
  /** @type {{thing: number, right: number, ahead: number, turn: number, from: Pose} | null} */ held = null;
  /** @type {Iterator<Pointer> | null} */ plan = null;
  /** @type {Round} */ round = { kind: "round", mode: "free", stage: "free" };
  /** @type {Pointer} */ pointer = { x: null, z: null, grip: false, turn: 0 };
  hand = { x: 0, z: WAITS_Z, yaw: 0 };
  steps = 0;
  away = 0;
  snapshots = 0;
  effort = 0;
  visited = false;
  /** Whether it knew where everything was when the last visit began. */ knew = true;
  /** Likewise now. */ knows = true;

  /**
   * @param {Start[]} starts
   * @param {URLSearchParams} begin how the first game begins
   * @param {(message: Message) => void} heard
   */
  constructor(starts, begin, heard) {
    this.starts = starts;
    this.begin = begin;
    this.heard = heard;
    this.game = "";
    this.start = starts[0];
    this.things = starts[0].hello.objects;
    this.new(Number(begin.get("seed")) || 0, begin.get("mode") === "show");
    this.clock = setInterval(() => this.step(), 1000 / STEPS_PER_SECOND);
  }

  /** @param {number} seed @param {boolean} [shown] */
  new(seed, shown = false) {
    const { length } = this.starts;
    this.start = this.starts[((seed % length) + length) % length];
    this.things = this.start.hello.objects;
    this.restart();
    this.plan = shown ? this.exchange() : null;
    this.round = shown
      ? { kind: "round", mode: "show", stage: "showing", pair: this.start.pair }
      : { kind: "round", mode: "free", stage: "free" };
    this.heard(this.hello());
  }

  restart() {
    const { believed } = this.start.state;
    this.objects = structuredClone(believed);
    this.believed = structuredClone(believed);
    this.stood = structuredClone(believed);
    this.holder = believed.map((_, i) => i);
    this.hand = this.waiting();
    this.held = null;
    this.pointer = { x: null, z: null, grip: false, turn: 0 };
    this.labels = [];
    this.steps = this.away = this.snapshots = this.effort = 0;
    this.visited = false;
    this.knew = this.knows = true;
  }

  /** A hand out of view. */
  waiting() {
    return { x: this.start.hello.width / 2, z: WAITS_Z, yaw: 0 };
  }

  hello() {
    return { ...this.start.hello, game: "", role: /** @type {const} */ ("player"), round: this.round };
  }

  /** @param {any} message of the page */
  tell(message) {
    if (message.do === "new") this.new(message.seed, message.mode === "show");
    else if (message.do === "truth") this.heard(this.truth());
    else if (message.do === "hello") this.heard(this.hello());
    else if (message.do === "play") this.play();
    else this.pointer = { ...message };
  }

  play() {
    this.restart();
    this.plan = null;
    this.heard((this.round = { kind: "round", mode: "free", stage: "free" }));
  }

  truth() {
    const wrong = this.holder.flatMap((holder, i) => (holder === i ? [] : [i]));
    return { kind: /** @type {const} */ ("truth"), number: this.snapshots, labels: this.labels, wrong, fresh: this.knew };
  }

  step() {
    if (this.plan && this.pointer.grip) this.play();
    const away = { x: null, z: null, grip: false, turn: 0 };
    this.follow(this.plan ? (this.plan.next().value ?? away) : this.pointer);
    this.steps++;
    this.heard(this.state());
  }

  /** Begin a visit when hand or forearm are seen. @returns {boolean} whether the visit is over */
  watch() {
    const seen = this.seesArm();
    this.away = seen || this.held ? 0 : this.away + 1;
    this.visited ||= seen;
    return this.visited && this.away >= AWAY_TICKS;
  }

  /** The hand goes to where the pointer is, or out of view. @param {Pointer} pointer */
  follow({ x, z, grip, turn }) {
    const { hand } = this;
    const gone = x === null || z === null;
    const [dx, dz] = gone ? [this.start.hello.width / 2 - hand.x, WAITS_Z - hand.z] : [x - hand.x, z - hand.z];
    const share = Math.min(1, HAND_M / (Math.hypot(dx, dz) || 1));
    const spin = gone ? 0 : Math.max(-HAND_RAD, Math.min(HAND_RAD, wrap(turn - hand.yaw)));
    for (let tick = 0; tick < TICKS; tick++) {
      if (!grip || gone) this.setDown();
      else if (!this.held) this.take();
      hand.x += (share * dx) / TICKS;
      hand.z += (share * dz) / TICKS;
      hand.yaw += spin / TICKS;
      if (this.held) this.objects[this.held.thing] = this.carried();
      if (this.watch()) return this.look();
    }
  }

  /** Where what the hand holds is now. @returns {Pose} */
  carried() {
    const { right, ahead, turn } = /** @type {NonNullable<LocalGame["held"]>} */ (this.held);
    const yaw = this.hand.yaw - turn;
    const [x, z] = outward(yaw, right, ahead);
    return [this.hand.x - x, this.hand.z - z, yaw];
  }

  /** Take hold of the nearest building in reach and in view. */
  take() {
    const { x: hx, z: hz, yaw: turned } = this.hand;
    const near = this.objects.map(([x, z, yaw], i) => {
      const [right, ahead] = outward(-yaw, hx - x, hz - z);
      const [w, , d] = this.things[i].size;
      const gap = Math.hypot(Math.max(Math.abs(right) - w / 2, 0), Math.max(Math.abs(ahead) - d / 2, 0));
      return { thing: i, right, ahead, gap, turn: turned - yaw, from: /** @type {Pose} */ ([x, z, yaw]) };
    });
    const best = near.filter(({ thing }) => !this.things[thing].fixed).sort((a, b) => a.gap - b.gap)[0];
    const [x, z] = best.from;
    if (best.gap <= REACH_M && this.sees(x, z)) this.held = best;
  }

  /** Put down what is held: where it is, or on the straight way back as soon as there is room. */
  setDown() {
    if (!this.held) return;
    const { thing, from } = this.held;
    const [x, z, yaw] = from;
    const [toX, toZ, toYaw] = this.objects[thing];
    const turn = wrap(toYaw - yaw);
    /** @param {number} share @returns {Pose} */
    const at = (share) => [x + share * (toX - x), z + share * (toZ - z), yaw + share * turn];
    const count = Math.ceil(Math.max(Math.hypot(toX - x, toZ - z) / STRIDE_M, Math.abs(turn) / (Math.PI / 90)));
    let k = count;
    while (k > 0 && !this.hasRoom(thing, at(k / count))) k--;
    let share = count ? k / count : 0;
    let high = k > 0 && k < count ? (k + 1) / count : share;
    for (let n = 0; n < HALVINGS && high > share; n++) {
      const middle = (share + high) / 2;
      if (this.hasRoom(thing, at(middle))) share = middle;
      else high = middle;
    }
    this.objects[thing] = at(share);
    this.held = null;
  }

  /** Whether a building lies on the table and overlaps no other. @param {number} thing @param {Pose} pose */
  hasRoom(thing, pose) {
    const { width, depth } = this.start.hello;
    const mine = corners(pose, this.things[thing].size);
    const e = TOUCHING_M;
    if (mine.some(([x, z]) => x < -e || z < -e || x > width + e || z > depth + e)) return false;
    return this.objects.every((other, i) => i === thing || apart(mine, corners(other, this.things[i].size)));
  }

  /** Whether the camera sees a point, metres. @param {number} x @param {number} z */
  sees(x, z) {
    const { eye } = this.start;
    const bearing = wrap(Math.atan2(x - eye.x, z - eye.z) - eye.yaw);
    return Math.hypot(x - eye.x, z - eye.z) <= eye.range && -eye.left <= bearing && bearing <= eye.right;
  }

  /** Whether hand or forearm are in view. */
  seesArm() {
    const { x, z } = this.hand;
    const [far, near] = [z + ARM.half, Math.min(ARM.elbow, z)];
    for (let k = 0; k < ARM.points; k++) {
      const at = far + (k / (ARM.points - 1)) * (near - far);
      if (this.sees(x - ARM.half, at) || this.sees(x + ARM.half, at)) return true;
    }
    return false;
  }

  /** One snapshot, its answers, and what the headset believes from then on. */
  look() {
    this.visited = false;
    this.hand = this.waiting();
    const { eye, hello: { width, depth } } = this.start;
    /** @param {Pose} pose */
    const bearing = ([x, z]) => wrap(Math.atan2(x - eye.x, z - eye.z) - eye.yaw);
    const seen = [...this.objects.keys()]
      .filter((i) => this.sees(this.objects[i][0], this.objects[i][1]))
      .sort((a, b) => bearing(this.objects[a]) - bearing(this.objects[b]));
    /** @param {Pose} pose @param {number} i */
    const posed = ([x, z, yaw_rad], i) => ({ x, z, yaw_rad, category: this.things[i].category, size_whd: this.things[i].size });
    const method = new Spatial({
      frame: "unity",
      size_m: [width, depth],
      weights: this.start.weights,
      objects: this.believed.map((pose, i) => ({ label: this.things[i].label, ...posed(pose, i) })),
    });
    const detections = seen.map((i) => posed(this.objects[i], i));
    const given = method.identify({ frame: "unity", camera: null, detections }).detections.map(({ id }) => id);
    const names = this.things.map(({ label }) => label);
    this.labels = seen.map((i) => names[i]);
    this.snapshots++;
    const cm = this.cm();
    seen.forEach((i, k) => {
      const label = names.indexOf(given[k] ?? "");
      if (label < 0 || this.things[label].fixed) return;
      this.believed[label] = [...this.objects[i]];
      this.holder[label] = i;
    });
    this.effort += cm;
    this.knew = this.knows;
    this.knows = this.objects.every((pose, i) => pose.every((value, k) => value === this.believed[i][k]));
    this.stood = structuredClone(this.objects);
    const answers = seen.map((object, k) => ({ object, label: given[k], confidence: null }));
    this.heard({ kind: "snapshot", number: this.snapshots, detections: answers, visit_cm: cm });
    if (this.round.mode === "show") this.heard((this.round = { ...this.round, stage: "fooled", cm }));
  }

  /** What the visit has moved: straight ways, and a turn's price. */
  cm() {
    const diagonal = Math.hypot(this.start.hello.width, this.start.hello.depth);
    const ways = this.objects.map(([x, z, yaw], i) => {
      const [a, b, was] = this.stood[i];
      return Math.hypot(x - a, z - b) + diagonal * Math.abs(Math.sin((yaw - was) / 2));
    });
    return Math.round(1e4 * ways.reduce((sum, way) => sum + way, 0)) / 100;
  }

  /** @returns {State} */
  state() {
    const { hand, held } = this;
    const moved = this.cm();
    return {
      ...this.start.state,
      step: this.steps,
      phase: this.visited ? "hand" : "play",
      objects: this.objects.map((pose) => /** @type {Pose} */ ([...pose])),
      believed: this.believed,
      hand: [hand.x, hand.z, hand.yaw, held ? held.thing : null],
      effort_cm: this.effort + moved,
      visit_cm: moved,
      par_cm: this.snapshots ? null : this.start.state.par_cm,
      snapshots: this.snapshots,
    };
  }

  /** The pointer of a hand that exchanges two buildings, step by step. @returns {Generator<Pointer, void>} */
  *exchange() {
    const game = this;
    /** @param {number} x @param {number} z @param {boolean} grip @param {number} turn @returns {Generator<Pointer, void>} */
    function* until(x, z, grip, turn) {
      for (;;) {
        const { hand } = game;
        const way = Math.hypot(x - hand.x, z - hand.z);
        if (way < 1e-3 && Math.abs(wrap(turn - hand.yaw)) < 5e-3) return;
        const share = Math.min(1, SHOWN_M / (way || 1));
        yield { x: hand.x + share * (x - hand.x), z: hand.z + share * (z - hand.z), grip, turn };
      }
    }
    for (const [thing, x, z, yaw] of this.start.plan) {
      const [fromX, fromZ, fromYaw] = this.objects[thing];
      const turn = this.hand.yaw;
      yield* until(fromX, fromZ, false, turn);
      for (let k = 0; k < 3; k++) yield { x: fromX, z: fromZ, grip: true, turn };
      const turned = turn + wrap(yaw - fromYaw);
      yield* until(x, z, true, turned);
      yield { x, z, grip: false, turn: turned };
    }
    yield* until(...this.start.rest, false, this.hand.yaw);
  }
}
