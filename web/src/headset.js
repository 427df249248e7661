// @ts-check
/** @import {Place, State} from "./messages.js" */
/** @import {Table} from "./table.js" */
import * as THREE from "three";
import { Pointing } from "./pointing.js";

const NEAREST_M = 0.2;
/** Least upward part of a surface's normal: no table stands on a wall or a ceiling. */
const LEVEL = 0.9;
const LOOK = "Look at a table or the floor, and select to put the game there.";

/**
 * The table in a room, through a headset or a phone (WebXR, experimental).
 *
 * First the table is put on a surface that the device finds, then the controller, or a finger on the phone's
 * screen, is the hand. The origin of what is drawn is moved to the table, so that all else is as on the page.
 */
export class Headset {
  /**
   * @param {THREE.WebGLRenderer} renderer
   * @param {(pointer: {x: number | null, z: number | null, grip: boolean, turn: number}) => void} changed
   * @param {(text: string) => void} say
   * @param {() => void} ended
   */
  constructor(renderer, changed, say, ended) {
    this.renderer = renderer;
    this.changed = changed;
    this.say = say;
    this.ended = ended;
    /** @type {Place | null} */ this.place = null;
    /** @type {XRSession | null} */ this.session = null;
    /** @type {XRHitTestSource | null} */ this.found = null;
    /** @type {XRReferenceSpace | null} */ this.room = null;
    /** @type {DOMPointReadOnly | null} */ this.eye = null;
    this.placed = false;
    this.pointing = new Pointing(changed);
    this.waiting = new THREE.Scene();
    this.waiting.add(new THREE.HemisphereLight("#ffffff", "#8c8474", 2));
    this.ring = new THREE.Mesh(
      new THREE.RingGeometry(0.06, 0.08, 32).rotateX(-Math.PI / 2),
      new THREE.MeshBasicMaterial({ color: "#c2347e" }),
    );
    this.ring.visible = false;
    this.waiting.add(this.ring);
  }

  /** Whether this browser and device can show the table in a room. */
  static async possible() {
    try {
      return (await navigator.xr?.isSessionSupported("immersive-ar")) ?? false;
    } catch {
      return false;
    }
  }

  /** Begin; called when the player has pressed the button. */
  async begin() {
    if (this.session) return;
    const session = await /** @type {XRSystem} */ (navigator.xr).requestSession("immersive-ar", {
      requiredFeatures: ["hit-test", "local-floor"],
    });
    this.session = session;
    session.addEventListener("end", () => this.end());
    try {
      await this.enter(session);
    } catch (problem) {
      await session.end();
      throw problem;
    }
  }

  /** @param {XRSession} session that has just begun */
  async enter(session) {
    session.addEventListener("select", () => this.put());
    session.addEventListener("selectstart", (event) => this.grip(event, true));
    session.addEventListener("selectend", (event) => this.grip(event, false));
    this.renderer.xr.enabled = true;
    this.renderer.xr.setReferenceSpaceType("local-floor");
    await this.renderer.xr.setSession(session);
    this.room = this.renderer.xr.getReferenceSpace();
    this.room?.addEventListener("reset", () => this.search());
    await this.search();
  }

  /** Have the player choose a place: at the beginning, and when the device has lost where things were. */
  async search() {
    const { session, room } = this;
    if (!session || !room) return;
    this.placed = this.ring.visible = false;
    this.pointing.leave();
    this.renderer.xr.setReferenceSpace(room);
    this.found?.cancel();
    this.found = null;
    const viewer = await session.requestReferenceSpace("viewer");
    this.found = (await session.requestHitTestSource?.({ space: viewer })) ?? null;
    this.say(this.found ? LOOK : "This device finds no tables and no floor.");
  }

  end() {
    this.session = this.found = this.room = null;
    this.placed = false;
    this.renderer.xr.enabled = false;
    this.pointing.leave();
    this.ended();
  }

  /** Put the middle of the table where the ring is, its near edge to the player. */
  put() {
    if (this.placed || !this.ring.visible || !this.place || !this.room) return;
    const { eye } = this;
    const { x, y, z } = this.ring.position;
    const yaw = eye ? Math.atan2(eye.x - x, eye.z - z) : 0;
    const { width, depth } = this.place;
    // The corner from which metres on the table are counted, from its middle, turned.
    const [dx, dz] = [-width / 2, depth / 2];
    const corner = {
      x: x + Math.cos(yaw) * dx + Math.sin(yaw) * dz,
      y,
      z: z - Math.sin(yaw) * dx + Math.cos(yaw) * dz,
    };
    const turn = { x: 0, y: Math.sin(yaw / 2), z: 0, w: Math.cos(yaw / 2) };
    this.renderer.xr.setReferenceSpace(this.room.getOffsetReferenceSpace(new XRRigidTransform(corner, turn)));
    this.placed = true;
    this.found?.cancel();
    this.found = null;
    this.say("Point at a building, hold select to carry it, turn your wrist to turn it. Point away to leave.");
  }

  /** @param {XRInputSourceEvent} event @param {boolean} closed */
  grip(event, closed) {
    if (this.placed) this.pointing.grip(event.inputSource, closed);
  }

  /**
   * Draw a moment.
   *
   * @param {Table} table @param {State} state @param {XRFrame} frame
   */
  draw(table, state, frame) {
    const scene = this.placed ? table.scene : this.waiting;
    if (this.placed) this.point(frame);
    else this.look(frame);
    const { background } = table.scene;
    table.scene.background = null; // the room is behind it
    table.view.visible = true;
    this.renderer.setScissorTest(false);
    this.renderer.render(scene, new THREE.PerspectiveCamera());
    this.renderer.setScissorTest(true);
    table.scene.background = background;
  }

  /** Have the ring lie on what the device looks at. @param {XRFrame} frame */
  look(frame) {
    this.eye = (this.room && frame.getViewerPose(this.room)?.transform.position) ?? null;
    const hit = this.found && frame.getHitTestResults(this.found)[0];
    const pose = hit && this.room ? hit.getPose(this.room) : undefined;
    if (pose) this.ring.position.copy(/** @type {THREE.Vector3Like} */ (pose.transform.position));
    const up = pose ? pose.transform.matrix[5] : 0; // of the normal, which is the pose's y axis
    const { x, y, z } = this.ring.position;
    // What is that near is no surface: some devices say so before they have found one.
    const far = this.eye !== null && Math.hypot(x - this.eye.x, y - this.eye.y, z - this.eye.z) > NEAREST_M;
    this.ring.visible = up > LEVEL && far;
  }

  /** Have the hand be where a controller points to. @param {XRFrame} frame */
  point(frame) {
    const space = this.renderer.xr.getReferenceSpace();
    if (space && this.place) this.pointing.follow(frame, space, this.place);
  }
}
