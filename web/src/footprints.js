// @ts-check
/** @typedef {[number, number, number]} Pose x, z, yaw */

/** So much may footprints overlap, and lie beyond the table's edge. */
export const TOUCHING_M = 1e-9;

/** A vector of an object's own axes in the plane. @param {number} yaw @param {number} right @param {number} ahead */
export const outward = (yaw, right, ahead) => [
  Math.cos(yaw) * right + Math.sin(yaw) * ahead,
  Math.cos(yaw) * ahead - Math.sin(yaw) * right,
];

/** @param {Pose} pose @param {[number, number, number]} size @returns {number[][]} of the footprint, in turn */
export function corners([x, z, yaw], [width, , depth]) {
  return [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([a, b]) => {
    const [right, ahead] = outward(yaw, (a * width) / 2, (b * depth) / 2);
    return [x + right, z + ahead];
  });
}

/** Whether an axis of one of two rectangles separates them. @param {number[][]} first @param {number[][]} second */
export function apart(first, second) {
  return [first, second].some((one) =>
    [0, 1].some((k) => {
      const axis = [one[k][0] - one[k + 1][0], one[k][1] - one[k + 1][1]];
      const length = Math.hypot(axis[0], axis[1]);
      /** @param {number[][]} points */
      const along = (points) => points.map(([x, z]) => (x * axis[0] + z * axis[1]) / length);
      const [a, b] = [along(first), along(second)];
      return Math.max(Math.min(...a) - Math.max(...b), Math.min(...b) - Math.max(...a)) >= -TOUCHING_M;
    }),
  );
}
