// @ts-check
/**
 * The client of `farm-ar serve` for browsers and Node, and the paper's method itself for when the service is
 * out of reach. One file, no dependencies. Bodies are those of docs/headset.md in farm-ar.
 *
 * @typedef {"unity" | "openxr" | "ros"} Frame  Whose axes. WebXR's are openxr.
 *
 * @typedef {object} Pose  A place, and perhaps a heading; or a rigid 4x4 matrix by rows.
 * @property {number} [x]
 * @property {number} [y]
 * @property {number} [z]
 * @property {number} [yaw_deg]
 * @property {number} [yaw_rad]
 * @property {number[]} [quaternion]  [x, y, z, w] of length 1.
 * @property {number[][]} [matrix]
 *
 * @typedef {Pose & {label: string, category?: string | null, size_whd?: number[], fixed?: boolean}} LayoutObject
 * @typedef {{frame: Frame, units?: string, objects: LayoutObject[], size_m?: number[], size?: number[],
 *   bounds?: any, weights?: {translation: number, rotation?: number}}} Layout
 * @typedef {Pose & {id?: string, track_id?: string | null, category?: string | null, size_whd?: number[],
 *   confidence?: number}} Detection
 * @typedef {{frame: Frame, units?: string, timestamp?: number, camera: any, detections: Detection[]}} Snapshot
 *
 * @typedef {object} Answer
 * @property {string} detection
 * @property {string | null} id  The label; null for none.
 * @property {string | null} reason  Why there is none.
 * @property {number | null} confidence
 * @property {number | null} margin
 * @property {number | null} cost
 * @property {{id: string | null, confidence: number | null}[]} alternatives
 *
 * @typedef {{detections: Answer[], revision: number, snapshot: string | null, missing: string[],
 *   new: string[], warnings: string[], offline?: boolean}} Reply
 */

const METRES = { m: 1, cm: 0.01, mm: 0.001, km: 1000, in: 0.0254, ft: 0.3048, yd: 0.9144 };

/** What the service refused: `status` of HTTP, and which `field` should have been what. */
export class FarmArError extends Error {
  /** @param {number} status @param {{field?: string, expected?: string, message?: string}} error */
  constructor(status, error) {
    super(error.message ?? `status ${status}`);
    this.name = "FarmArError";
    this.status = status;
    this.field = error.field;
    this.expected = error.expected;
  }
}

/** A session of the service. */
export class FarmAr {
  /**
   * @param {string} url  As `farm-ar serve` prints it.
   * @param {{session: string, token?: string, timeoutMs?: number, fetch?: typeof fetch, WebSocket?: any}} options
   */
  constructor(url, options) {
    this.url = new URL(url).origin;
    this.session = options.session;
    this.token = options.token;
    this.timeoutMs = options.timeoutMs ?? 5000;
    this.fetch = options.fetch ?? ((...args) => globalThis.fetch(...args));
    this.WebSocket = options.WebSocket ?? globalThis.WebSocket;
    /** @type {number} */ this.revision = 0;
    /** @type {{revision: number, snapshot: string | null} | null} The last answer, for `confirm`. */ this.seen = null;
    /** @type {Layout | null} */ this.layout = null;
    /** @type {PlanePose | null} */ this.origin = null;
  }

  /**
   * Begin with a layout.
   * @param {Layout} layout
   * @param {{method?: string, options?: object, replace?: boolean}} [how]
   */
  async begin(layout, how = {}) {
    this.layout = layout;
    this.origin = null;
    const body = { ...layout, method: how.method ?? "adaptive", options: how.options ?? {} };
    if (how.replace) {
      const { sessions } = await this._ask("GET", "/v1/sessions");
      if (sessions.includes(this.session)) {
        const state = await this._ask("GET", `${this._path("state")}?frame=${layout.frame}`);
        Object.assign(body, { revision: state.revision });
      }
    }
    const reply = await this._ask("PUT", this._path("layout"), body);
    this.revision = reply.revision;
    return reply;
  }

  /**
   * Which detection is which. Where the service does not answer, the paper's method answers here, and the reply
   * has `offline: true`; such an answer cannot be confirmed.
   * @param {Snapshot} snapshot
   * @returns {Promise<Reply>}
   */
  async identify(snapshot) {
    let reply;
    try {
      reply = await this._ask("POST", this._path("snapshots"), snapshot);
    } catch (problem) {
      if (problem instanceof FarmArError || this.layout === null) throw problem;
      this.seen = null; // what was seen before is not what is confirmed now
      return { ...new Spatial(this.layout, this.origin).identify(snapshot), revision: this.revision, offline: true };
    }
    this.revision = reply.revision;
    this.seen = { revision: reply.revision, snapshot: reply.snapshot };
    return reply;
  }

  /**
   * The labels of the last answer of the service are right, but for these.
   * @param {Record<string, string | null>} [labels]  By detection.
   * @param {boolean} [force]  Whether a label may go to a detection of another category.
   */
  async confirm(labels = {}, force = false) {
    if (this.seen === null) throw new FarmArError(409, { field: "snapshot", message: "snapshot: must have been answered by the service" });
    const reply = await this._decided("confirm", { ...this.seen, labels, force });
    await this.state();
    return reply;
  }

  /** Take back the last decision. */
  async undo() {
    const reply = await this._decided("undo", { revision: this.revision });
    await this.state();
    return reply;
  }

  /**
   * Find the frame of the snapshots from here on: by what stands where, or by a pose that is known in both frames.
   * @param {{frame: Frame, anchor?: {here: Pose, map: Pose}} & Partial<Snapshot>} body
   */
  async align(body) {
    const reply = await this._decided("align", { ...body, revision: this.revision });
    await this.state();
    return reply;
  }

  /** All that is known, in a frame; the layout's by default. @param {Frame} [frame] */
  async state(frame) {
    const wanted = frame ?? this.layout?.frame ?? "unity";
    const state = await this._ask("GET", `${this._path("state")}?frame=${wanted}`);
    this.revision = state.revision;
    if (this.layout !== null && wanted === this.layout.frame && (this.layout.units ?? "m") === "m") {
      const objects = state.objects.map((/** @type {any} */ one) => ({
        label: one.id,
        ...(one.category === null ? {} : { category: one.category }),
        ...one.pose.position,
        ...(one.pose.orientation === null ? {} : { quaternion: ["x", "y", "z", "w"].map((c) => one.pose.orientation[c]) }),
        ...(one.size === null ? {} : { size_whd: [one.size.x, one.size.y, one.size.z] }),
        fixed: one.fixed,
      }));
      this.layout = { ...this.layout, objects };
      const origin = state.origin;
      const turn = origin && ["x", "y", "z", "w"].map((c) => origin.orientation[c]);
      this.origin = origin && onPlane({ ...origin.position, quaternion: turn }, wanted);
    }
    return state;
  }

  /**
   * Be told what is `added`, `updated` and `removed`, until the function that is returned is called.
   * @param {(change: any) => void} tell
   * @param {Frame} [frame]
   */
  listen(tell, frame) {
    if (!this.WebSocket) throw new FarmArError(0, { field: "WebSocket", message: "WebSocket: must be given as an option: Node has none before 22" });
    let over = false;
    let wait = 1000;
    /** @type {any} */ let line = null;
    const begin = () => {
      if (over) return;
      const token = this.token === undefined ? "" : `&token=${encodeURIComponent(this.token)}`;
      const where = `${this.url.replace(/^http/, "ws")}${this._path("events")}`;
      line = new this.WebSocket(`${where}?frame=${frame ?? this.layout?.frame ?? "unity"}${token}`);
      line.onmessage = (/** @type {{data: string}} */ event) => tell(JSON.parse(event.data));
      line.onopen = () => void (wait = 1000);
      line.onclose = () => {
        setTimeout(begin, wait);
        wait = Math.min(2 * wait, 30000); // asked again and again, a wrong token would shut out all of this machine
      };
    };
    begin();
    return () => {
      over = true;
      line?.close();
    };
  }

  /** @param {string} action */
  _path(action) {
    return `/v1/sessions/${encodeURIComponent(this.session)}/${action}`;
  }

  /** @param {string} action @param {object} body */
  async _decided(action, body) {
    const reply = await this._ask("POST", this._path(action), body);
    this.revision = reply.revision;
    return reply;
  }

  /** @param {string} method @param {string} path @param {object} [body] @returns {Promise<any>} */
  async _ask(method, path, body) {
    const headers = {
      "Content-Type": "application/json",
      ...(this.token === undefined ? {} : { Authorization: `Bearer ${this.token}` }),
    };
    const signal = AbortSignal.timeout(this.timeoutMs);
    const sent = body === undefined ? {} : { body: JSON.stringify(body) };
    const reply = await this.fetch(this.url + path, { method, headers, signal, ...sent });
    const values = await reply.json();
    if (!reply.ok) throw new FarmArError(reply.status, values.error ?? {});
    return values;
  }
}

/**
 * @typedef {{x: number, z: number, yaw: number}} PlanePose  Metres and radians in Unity's frame: yaw clockwise
 *   from above, 0 along +z, NaN where it is not known.
 */

/**
 * A pose of a frame on the plane of Unity's frame.
 * @param {Pose} pose
 * @param {Frame} frame
 * @param {number} [metres]  In a unit of length.
 * @returns {PlanePose}
 */
export function onPlane(pose, frame, metres = 1) {
  const matrix = pose.matrix;
  const at = (/** @type {number | undefined} */ v) => (typeof v === "number" ? v * metres : NaN);
  const up = frame === "ros" ? "z" : "y";
  const [x, y, z] = matrix
    ? [0, 1, 2].map((i) => at(matrix[i][3]))
    : ["x", "y", "z"].map((axis) => (axis === up && pose[/** @type {"x"} */ (axis)] == null ? 0 : at(pose[/** @type {"x"} */ (axis)])));
  const place = frame === "ros" ? { x: -y, z: x } : { x, z: frame === "openxr" ? -z : z };
  const sense = frame === "unity" ? 1 : -1;
  if (typeof pose.yaw_rad === "number") return { ...place, yaw: sense * pose.yaw_rad };
  if (typeof pose.yaw_deg === "number") return { ...place, yaw: (sense * pose.yaw_deg * Math.PI) / 180 };
  const turn = matrix ? matrix.slice(0, 3).map((row) => row.slice(0, 3)) : pose.quaternion && rotation(pose.quaternion);
  return { ...place, yaw: turn ? heading(turn, frame) : NaN };
}

/** @param {number[]} q  [x, y, z, w] @returns {number[][]} */
function rotation(q) {
  const length = Math.hypot(...q);
  if (!(Math.abs(length - 1) <= 0.01)) throw new FarmArError(422, { field: "quaternion", message: "quaternion: must be unit" });
  const [x, y, z, w] = q.map((v) => v / length);
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

/**
 * The heading in Unity's frame of a rotation in another: where its forward points, or, if that is up or down, by
 * its right-hand side.
 * @param {number[][]} r @param {Frame} frame
 */
function heading(r, frame) {
  // Forward and right of a body, and the axes that are right and forward in the world.
  const [forward, right] = { unity: [[0, 0, 1], [1, 0, 0]], openxr: [[0, 0, -1], [1, 0, 0]], ros: [[1, 0, 0], [0, -1, 0]] }[frame];
  const turned = (/** @type {number[]} */ v) => {
    const [x, y, z] = r.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
    return frame === "ros" ? [-y, x] : [x, frame === "openxr" ? -z : z];
  };
  const [fx, fz] = turned(forward);
  if (Math.hypot(fx, fz) > 1e-9) return Math.atan2(fx, fz);
  const [rx, rz] = turned(right);
  return Math.atan2(-rz, rx);
}

/** The paper's method, without a service: the assignment of labels with the least sum of costs (Eqs. 4 to 8). */
export class Spatial {
  /** @param {Layout} layout @param {PlanePose | null} [origin]  Of the snapshots' frame, in the map. */
  constructor(layout, origin = null) {
    if (layout.objects.length === 0) throw new FarmArError(422, { field: "objects", message: "objects: must be at least one" });
    const metres = METRES[/** @type {"m"} */ (layout.units ?? "m")];
    this.origin = origin;
    this.objects = layout.objects.map((one) => ({
      label: one.label,
      category: one.category ?? null,
      sides: sortedLogs(one.size_whd, metres),
      ...onPlane(one, layout.frame, metres),
    }));
    this.categories = new Set(this.objects.map((one) => one.category));
    const { diagonal, area } = extent(layout, this.objects, metres);
    const weights = layout.weights ?? { translation: 0.36 * Math.sqrt(area), rotation: 1 };
    this.perMetre = weights.translation / diagonal;
    this.perTurn = weights.rotation ?? 1;
  }

  /** @param {Snapshot} snapshot @returns {Reply} */
  identify(snapshot) {
    const metres = METRES[/** @type {"m"} */ (snapshot.units ?? "m")];
    const named = !this.categories.has(null);
    const seen = snapshot.detections.map((one, i) => ({
      id: one.id ?? String(i),
      category: named ? (one.category ?? null) : null,
      sides: sortedLogs(one.size_whd, metres),
      ...this._inMap(onPlane(one, snapshot.frame, metres)),
    }));
    const reasons = seen.map((one) => {
      if (!Number.isFinite(one.x) || !Number.isFinite(one.z)) return "its pose is broken";
      return one.category !== null && !this.categories.has(one.category) ? `the scene has no '${one.category}'` : null;
    });
    const rows = seen.filter((_, i) => reasons[i] === null);
    const costs = rows.map((one) => this.objects.map((label) => this._cost(one, label)));
    const given = assign(costs);
    let row = 0;
    const detections = seen.map((one, i) => {
      const j = reasons[i] === null ? given[row++] : -1;
      const why = reasons[i] ?? (j < 0 ? "all labels that it may have are given to others" : null);
      return {
        detection: one.id,
        id: j < 0 ? null : this.objects[j].label,
        reason: why,
        confidence: null,
        margin: null,
        cost: j < 0 ? null : costs[row - 1][j],
        alternatives: [],
      };
    });
    return { detections, revision: 0, snapshot: null, missing: [], new: [], warnings: [] };
  }

  /** @param {PlanePose} pose @returns {PlanePose} */
  _inMap(pose) {
    if (this.origin === null) return pose;
    const { x, z, yaw } = this.origin;
    const [s, c] = [Math.sin(yaw), Math.cos(yaw)];
    return { x: x + c * pose.x + s * pose.z, z: z - s * pose.x + c * pose.z, yaw: pose.yaw + yaw };
  }

  /** @param {any} seen @param {any} label  Infinite where the categories differ. */
  _cost(seen, label) {
    if (seen.category !== null && seen.category !== label.category) return Infinity;
    const shift = this.perMetre * Math.hypot(seen.x - label.x, seen.z - label.z);
    const half = Math.abs(Math.sin((seen.yaw - label.yaw) / 2));
    const turn = Number.isNaN(half) ? 0 : this.perTurn * half;
    if (seen.sides === null || label.sides === null) return shift + turn;
    let gap = 0;
    for (let k = 0; k < 3; k++) gap += Math.abs(seen.sides[k] - label.sides[k]);
    return Math.exp(gap) * (shift + turn);
  }
}

/** @param {number[] | undefined | null} size @param {number} metres */
function sortedLogs(size, metres) {
  return size ? size.map((side) => Math.log(side * metres)).sort((a, b) => a - b) : null;
}

/** The diagonal (the `l` of Eq. 4) and the area of a layout, metres. @param {Layout} layout @param {PlanePose[]} objects @param {number} metres */
function extent(layout, objects, metres) {
  const bounds = layout.bounds;
  const rectangle = layout.size_m ?? layout.size ?? bounds?.size_m ?? bounds?.size;
  if (rectangle) {
    const [w, d] = rectangle.map((/** @type {number} */ side) => side * metres);
    return { diagonal: Math.hypot(w, d), area: w * d };
  }
  if (bounds) {
    /** @type {number[][]} */ const corners = bounds.map((/** @type {number[]} */ [a, b]) => [a * metres, b * metres]);
    let twice = 0;
    corners.forEach(([a, b], i) => {
      const [c, d] = corners[(i + 1) % corners.length];
      twice += a * d - b * c;
    });
    return { diagonal: farthest(corners), area: Math.abs(twice) / 2 };
  }
  const sizes = layout.objects.filter((one) => one.size_whd).map((one) => metres * Math.hypot((one.size_whd ?? [])[0], (one.size_whd ?? [])[2]));
  const diagonal = farthest(objects.map((one) => [one.x, one.z])) || Math.max(...sizes, 0) || 1;
  return { diagonal, area: diagonal ** 2 / 2 };
}

/** @param {number[][]} points */
function farthest(points) {
  let most = 0;
  for (const [a, b] of points) for (const [c, d] of points) most = Math.max(most, Math.hypot(a - c, b - d));
  return most;
}

/**
 * The cheapest assignment of columns to rows that leaves as few rows as possible without one: the Hungarian
 * algorithm with shortest paths. Infinite costs are no pairs; a row without a column gets -1.
 * @param {number[][]} costs
 * @returns {number[]}
 */
export function assign(costs) {
  const n = costs.length;
  const m = n ? costs[0].length : 0;
  const dearest = Math.max(0, ...costs.flat().filter(Number.isFinite));
  const none = (n + 1) * (dearest + 1); // more than any rearrangement of the others costs
  const never = (n + 1) * none;
  const cost = (/** @type {number} */ i, /** @type {number} */ j) =>
    j >= m ? (j - m === i ? none : never) : Number.isFinite(costs[i][j]) ? costs[i][j] : never;
  const width = m + n;
  const u = new Float64Array(n + 1);
  const v = new Float64Array(width + 1);
  const row = new Int32Array(width + 1); // that a column is given to, from 1; 0 for none
  for (let i = 1; i <= n; i++) {
    row[0] = i;
    const least = new Float64Array(width + 1).fill(Infinity);
    const way = new Int32Array(width + 1);
    const done = new Uint8Array(width + 1);
    let j0 = 0;
    do {
      done[j0] = 1;
      let delta = Infinity;
      let next = 0;
      for (let j = 1; j <= width; j++) {
        if (done[j]) continue;
        const reduced = cost(row[j0] - 1, j - 1) - u[row[j0]] - v[j];
        if (reduced < least[j]) [least[j], way[j]] = [reduced, j0];
        if (least[j] < delta) [delta, next] = [least[j], j];
      }
      for (let j = 0; j <= width; j++) {
        if (done[j]) {
          u[row[j]] += delta;
          v[j] -= delta;
        } else least[j] -= delta;
      }
      j0 = next;
    } while (row[j0] !== 0);
    while (j0) [row[j0], j0] = [row[way[j0]], way[j0]];
  }
  const given = new Array(n).fill(-1);
  for (let j = 1; j <= m; j++) if (row[j]) given[row[j] - 1] = j - 1;
  return given;
}

/**
 * A snapshot out of WebXR: of what the browser tracks (meshes, planes, images, anchors), in one reference space.
 * @param {any} frame  XRFrame
 * @param {any} space  XRReferenceSpace in which the layout is, too
 * @param {any} view  XRView
 * @param {Iterable<{space: any, category?: string, trackId?: string, size?: number[]}>} things
 * @param {number} rangeM  How far things are detected.
 * @returns {Snapshot}
 */
export function snapshotOfXR(frame, space, view, things, rangeM = 5) {
  const eye = view.transform;
  const p = view.projectionMatrix;
  const deg = (/** @type {number} */ tangent) => (Math.atan(tangent) * 180) / Math.PI;
  const posed = (/** @type {any} */ t) => ({
    ...{ x: t.position.x, y: t.position.y, z: t.position.z },
    quaternion: [t.orientation.x, t.orientation.y, t.orientation.z, t.orientation.w],
  });
  const detections = [];
  for (const thing of things) {
    const pose = frame.getPose(thing.space, space);
    if (!pose) continue;
    const track = thing.trackId === undefined ? {} : { track_id: thing.trackId };
    const size = thing.size === undefined ? {} : { size_whd: thing.size };
    detections.push({ category: thing.category ?? null, ...track, ...size, ...posed(pose.transform) });
  }
  return {
    frame: "openxr",
    timestamp: (frame.predictedDisplayTime ?? 0) / 1000,
    camera: {
      ...posed(eye),
      fov_left_deg: deg((1 - p[8]) / p[0]),
      fov_right_deg: deg((1 + p[8]) / p[0]),
      fov_up_deg: deg((1 + p[9]) / p[5]),
      fov_down_deg: deg((1 - p[9]) / p[5]),
      range_m: rangeM,
    },
    detections,
  };
}
