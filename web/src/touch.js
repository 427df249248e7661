// @ts-check
/** @import {Place, State} from "./messages.js" */

const OVER_M = 0.06;

/** @param {[number, number, number]} pose */
export function where([x, z]) {
  return `${Math.round(100 * x)} cm from the left, ${Math.round(100 * z)} cm from you`;
}

/** What a hand that is moved by keys is over, takes and sets down, in words for who does not see it. */
export class Touch {
  constructor() {
    /** @type {number | null} */ this.held = null;
    /** @type {number | null} */ this.over = null;
  }

  /**
   * What is to be said of a moment; "" where nothing has changed.
   *
   * @param {State} state @param {Place} place
   */
  say({ hand, objects }, place) {
    const held = hand?.[3] ?? null;
    const was = this.held;
    this.held = held;
    if (held !== was) return held === null ? `Set down ${where(objects[/** @type {number} */ (was)])}.` : `You hold a ${place.objects[held].category}.`;
    const over = held ?? (hand && this.nearest(hand, objects, place));
    const same = over === this.over;
    this.over = over;
    return over === null || held !== null || same ? "" : `Over a ${place.objects[over].category}, ${where(objects[over])}.`;
  }

  /**
   * The building under the hand; null where there is none.
   *
   * @param {NonNullable<State["hand"]>} hand @param {State["objects"]} objects @param {Place} place
   */
  nearest([x, z], objects, place) {
    const away = objects.map((one, i) => (place.objects[i].fixed ? Infinity : Math.hypot(one[0] - x, one[1] - z)));
    const nearest = away.indexOf(Math.min(...away));
    const { size } = place.objects[nearest];
    return away[nearest] <= Math.max(OVER_M, Math.min(size[0], size[2]) / 2) ? nearest : null;
  }
}
