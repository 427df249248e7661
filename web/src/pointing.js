// @ts-check
/** @import {Place} from "./messages.js" */
import * as THREE from "three";

const MARGIN_M = 0.15;
/** Seldom enough for the network, often enough for the eye. */
const TOLD_MS = 30;

/** What a controller does to the table, in whose corner the origin is. */
export class Pointing {
  /** @param {(pointer: {x: number | null, z: number | null, grip: boolean, turn: number}) => void} changed */
  constructor(changed) {
    this.changed = changed;
    /** @type {XRInputSource | null} */ this.active = null;
    this.closed = false;
    this.away = true;
    this.told = 0;
  }

  /** @param {XRInputSource} source @param {boolean} closed */
  grip(source, closed) {
    if (closed) this.active = source;
    if (source === this.active) this.closed = closed;
  }

  leave() {
    this.closed = false;
    if (!this.away) this.changed({ x: null, z: null, grip: false, turn: 0 });
    this.away = true;
  }

  /** @param {XRFrame} frame @param {XRReferenceSpace} space @param {Place} place */
  follow(frame, space, place) {
    const now = performance.now();
    if (now - this.told < TOLD_MS) return;
    this.told = now;
    const sources = [...frame.session.inputSources];
    const source = this.active && sources.includes(this.active) ? this.active : sources[0];
    const pose = source && frame.getPose(source.targetRaySpace, space);
    const hit = pose ? this.meets(pose.transform, place) : null;
    if (!hit) this.leave();
    else {
      this.away = false;
      this.changed({ ...hit, grip: this.closed });
    }
  }

  /**
   * Where a ray meets the table, and the turn of the wrist about it, clockwise from above; null beside the table.
   *
   * @param {XRRigidTransform} ray @param {Place} place
   */
  meets({ position, orientation }, { width, depth }) {
    const turned = new THREE.Quaternion(orientation.x, orientation.y, orientation.z, orientation.w);
    const way = new THREE.Vector3(0, 0, -1).applyQuaternion(turned);
    if (way.y > -1e-3) return null;
    const far = -position.y / way.y;
    const [x, z] = [position.x + far * way.x, -(position.z + far * way.z)];
    const inside = far > 0 && x > -MARGIN_M && x < width + MARGIN_M && z > -MARGIN_M && z < depth + MARGIN_M;
    return inside ? { x, z, turn: roll(turned, way) } : null;
  }
}

/** How far a controller is rolled about the way it points, radians. @param {THREE.Quaternion} turned @param {THREE.Vector3} way */
function roll(turned, way) {
  const right = new THREE.Vector3(1, 0, 0).applyQuaternion(turned);
  const level = new THREE.Vector3().crossVectors(way, new THREE.Vector3(0, 1, 0));
  if (level.lengthSq() < 1e-6) return 0; // straight down there is no level
  level.normalize();
  return Math.atan2(level.clone().cross(right).dot(way), level.dot(right));
}
