// @ts-check
/** @import {Place, State} from "./messages.js" */
/** @import {Table} from "./table.js" */
import * as THREE from "three";
import { at, scaleOf } from "./table.js";

const MARGIN_M = 0.09;

/** Two views of one table, on one canvas: from above, and through the headset. */
export class Views {
  /**
   * @param {HTMLCanvasElement} canvas that covers both
   * @param {HTMLElement} above where the view from above goes
   * @param {HTMLElement} headset where that through the headset goes
   */
  constructor(canvas, above, headset) {
    this.canvas = canvas;
    this.panes = { above, headset };
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setScissorTest(true);
    this.renderer.shadowMap.enabled = true;
    this.top = new THREE.OrthographicCamera();
    this.top.up.set(0, 0, -1);
    this.eye = new THREE.PerspectiveCamera(40, 16 / 9, 0.02, 10);
    /** @type {Place | null} */ this.hello = null;
  }

  /** @param {Place} hello */
  meet(hello) {
    this.hello = hello;
    const high = 2 * Math.hypot(hello.width, hello.depth);
    this.top.position.copy(at(hello.width / 2, high, hello.depth / 2));
    this.top.lookAt(at(hello.width / 2, 0, hello.depth / 2));
    this.top.near = 0.1;
    this.top.far = 2 * high;
    this.eye.far = Math.max(10, high);
  }

  /** @param {Table} table @param {State} state */
  draw(table, state) {
    this.fit();
    const { camera } = state;
    this.eye.position.copy(at(camera.x, camera.height, camera.z));
    const flat = Math.cos(camera.pitch);
    this.eye.lookAt(
      at(
        camera.x + Math.sin(camera.yaw) * flat,
        camera.height + Math.sin(camera.pitch),
        camera.z + Math.cos(camera.yaw) * flat,
      ),
    );
    const across = Math.tan(Math.min((camera.left + camera.right) / 2, 1.4));
    const box = this.canvas.getBoundingClientRect();
    for (const [name, lens] of /** @type {const} */ ([["above", this.top], ["headset", this.eye]])) {
      const pane = this.panes[name].getBoundingClientRect();
      if (pane.width < 2 || pane.height < 2) continue;
      if (lens instanceof THREE.PerspectiveCamera) {
        lens.aspect = pane.width / pane.height;
        lens.fov = (2 * Math.atan(across / lens.aspect) * 180) / Math.PI;
      } else {
        const [right, up] = this.reach(pane);
        Object.assign(lens, { left: -right, right, top: up, bottom: -up });
      }
      lens.updateProjectionMatrix();
      const bottom = box.bottom - pane.bottom;
      this.renderer.setViewport(pane.left - box.left, bottom, pane.width, pane.height);
      this.renderer.setScissor(pane.left - box.left, bottom, pane.width, pane.height);
      table.view.visible = name === "above";
      this.renderer.render(table.scene, lens);
    }
  }

  /** Half of what the view from above shows, metres. @param {DOMRect} pane @returns {[number, number]} */
  reach(pane) {
    const place = /** @type {Place} */ (this.hello);
    const margin = MARGIN_M * scaleOf(place);
    const wide = place.width / 2 + margin;
    const deep = place.depth / 2 + margin;
    const shape = pane.width / pane.height;
    return wide / deep > shape ? [wide, wide / shape] : [deep * shape, deep];
  }

  /**
   * The point of the table under a point of the page, metres; null outside the view from above.
   *
   * @param {number} clientX @param {number} clientY @returns {[number, number] | null}
   */
  pointAt(clientX, clientY) {
    const pane = this.panes.above.getBoundingClientRect();
    const right = (2 * (clientX - pane.left)) / pane.width - 1;
    const up = 1 - (2 * (clientY - pane.top)) / pane.height;
    if (!this.hello || Math.abs(right) > 1 || Math.abs(up) > 1) return null;
    const [wide, deep] = this.reach(pane);
    return [this.hello.width / 2 + right * wide, this.hello.depth / 2 + up * deep];
  }

  fit() {
    const { clientWidth, clientHeight } = this.canvas;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== clientWidth || size.y !== clientHeight || this.renderer.getPixelRatio() !== ratio) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(clientWidth, clientHeight, false);
    }
  }
}
