// @ts-check
/**
 * What the server tells. Metres and radians; x to the right, z away from the player, y up, yaw clockwise from
 * above with 0 along +z. `objects` has what stands on the table by numbers that say nothing of labels, `believed` and
 * `wrong` the labels; a number's category and size are the same in both.
 *
 * @typedef {{label: string, category: string, size: [number, number, number], fixed: boolean}} Thing
 * @typedef {{kind: "hello", scene: string, seed: number, reid: string, jitter: string, beside: string | null, gaze: string,
 *   gazes: string[], methods: string[], round: Round, width: number,
 *   depth: number, objects: Thing[], game: string, role: "player" | "viewer" | "watcher"}} Hello
 * @typedef {{x: number, z: number, height: number, yaw: number, pitch: number, left: number, right: number,
 *   range: number}} Headset
 * @typedef {{kind: "state", step: number, phase: "play" | "hand", objects: [number, number, number][],
 *   believed: [number, number, number][], wrong: number[], arrived: number, astray: number,
 *   hand: [number, number, number, number | null] | null, animals: [number, number, number, number][],
 *   camera: Headset, caption: string, effort_cm: number, visit_cm: number, par_cm: number | null,
 *   snapshots: number, over: boolean, left_cm?: number}} State
 * @typedef {{object: number, label: string | null, confidence: number | null}} Detection
 * @typedef {{kind: "snapshot", number: number, detections: Detection[], visit_cm?: number,
 *   beside?: {reid: string, detections: Detection[]}}} Snapshot
 * @typedef {{kind: "truth", number: number, labels: (string | null)[], wrong: number[],
 *   fresh: boolean}} Truth
 * @typedef {{kind: "round", mode: "free" | "show" | "guess" | "duel" | "tidy", stage: string,
 *   by?: "farm-slot" | "analytic", pair?: string[], cm?: number, in_view?: number[], guess?: Record<string, string>, yours?: number, its?: number, of?: number,
 *   adversary?: {wrong: number, cm: number}, player?: {wrong: number, cm: number},
 *   home?: [number, number, number][], start_cm?: number, left_cm?: number, seconds?: number, right?: number}} Round
 * @typedef {{kind: "refused", reason: string}} Refused
 * @typedef {{kind: "recording", title: string, rate: number, width: number, depth: number, objects: Thing[],
 *   frames: (State & {snapshot?: Snapshot})[]}} Recording
 * @typedef {{title: string, width: number, depth: number, labels: string[], moved: number[],
 *   ways: [number, number, number, number][]}} Card
 * @typedef {{width: number, depth: number, objects: Thing[]}} Place
 * @typedef {Hello | State | Snapshot | Truth | Round | Refused} Message
 */
export {};
