// @ts-check
/** @import {Hello, State} from "./messages.js" */
/** @import {Views} from "./views.js" */
import { scaleOf } from "./table.js";

const TURN_A_NOTCH = Math.PI / 24;
const KEY_STEP_M = 0.02;

/**
 * The player's pointer: mouse, pen, fingers and keys.
 *
 * It is away when it has left the table, and the hand with it: then the headset looks.
 */
export class Controls {
  /**
   * @param {HTMLElement} pane of the view from above
   * @param {Views} views
   * @param {(pointer: {x: number | null, z: number | null, grip: boolean, turn: number}) => void} changed
   */
  constructor(pane, views, changed) {
    this.views = views;
    this.changed = changed;
    this.pointer = { x: /** @type {number | null} */ (null), z: /** @type {number | null} */ (null), grip: false, turn: 0 };
    /** @type {Map<number, [number, number]>} */ this.fingers = new Map();
    this.twist = 0;
    /** Whether keys moved the hand last. */ this.keyed = false;
    pane.addEventListener("pointerdown", (event) => {
      this.keyed = false;
      pane.setPointerCapture(event.pointerId);
      this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
      if (this.fingers.size === 2) this.twist = this.angle();
      else this.move(event, true);
      pane.focus();
      event.preventDefault();
    });
    pane.addEventListener("pointermove", (event) => {
      if (this.fingers.has(event.pointerId)) this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
      if (this.fingers.size === 2) this.turn(this.angle());
      else this.move(event, this.pointer.grip);
    });
    pane.addEventListener("pointerup", (event) => this.up(event));
    pane.addEventListener("pointercancel", (event) => this.up(event));
    pane.addEventListener("pointerleave", (event) => {
      if (!this.fingers.size && event.pointerType === "mouse") this.leave();
    });
    pane.addEventListener("wheel", (event) => {
      this.set({ turn: this.pointer.turn + Math.sign(event.deltaY) * TURN_A_NOTCH });
      event.preventDefault();
    }, { passive: false });
    pane.addEventListener("keydown", (event) => this.key(event));
    pane.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  /** @param {PointerEvent} event @param {boolean} grip */
  move(event, grip) {
    const point = this.views.pointAt(event.clientX, event.clientY);
    if (point) this.set({ x: point[0], z: point[1], grip });
    else if (!grip) this.leave();
  }

  /** @param {PointerEvent} event */
  up(event) {
    const two = this.fingers.size === 2;
    this.fingers.delete(event.pointerId);
    if (two) return;
    this.set({ grip: false });
    // A lifted finger is a hand that leaves; a mouse still hovers over the table.
    if (event.pointerType !== "mouse") setTimeout(() => !this.fingers.size && this.leave(), 150);
  }

  /** The direction from the first finger to the second. */
  angle() {
    const [[ax, ay], [bx, by]] = [...this.fingers.values()];
    return Math.atan2(by - ay, bx - ax);
  }

  /** @param {number} angle */
  turn(angle) {
    const more = Math.atan2(Math.sin(angle - this.twist), Math.cos(angle - this.twist));
    this.twist = angle;
    this.set({ turn: this.pointer.turn + more });
  }

  /** The hand lets go and leaves the table. */
  leave() {
    this.set({ x: null, z: null, grip: false, turn: 0 });
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const hello = this.views.hello;
    if (!hello) return;
    const { x, z } = this.pointer;
    const [px, pz] = x === null || z === null ? [hello.width / 2, 0.05] : [x, z];
    const step = scaleOf(hello) * (event.shiftKey ? KEY_STEP_M / 4 : KEY_STEP_M);
    /** @type {Record<string, () => void>} */
    const keys = {
      ArrowLeft: () => this.set({ x: px - step, z: pz }),
      ArrowRight: () => this.set({ x: px + step, z: pz }),
      ArrowUp: () => this.set({ x: px, z: pz + step }),
      ArrowDown: () => this.set({ x: px, z: pz - step }),
      " ": () => this.set({ x: px, z: pz, grip: !this.pointer.grip }),
      q: () => this.set({ turn: this.pointer.turn - TURN_A_NOTCH }),
      e: () => this.set({ turn: this.pointer.turn + TURN_A_NOTCH }),
      Enter: () => this.leave(),
      Escape: () => this.leave(),
    };
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    this.keyed = true;
    act();
    event.preventDefault();
  }

  /** @param {Partial<Controls["pointer"]>} values */
  set(values) {
    Object.assign(this.pointer, values);
    this.changed(this.pointer);
  }
}
