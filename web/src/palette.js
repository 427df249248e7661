// @ts-check
/** Colours of labels by the word before the dash, apart from one another for every kind of colour vision. */
export const COLOURS = {
  yellow: "#f0e442",
  blue: "#2f6fd0",
  red: "#d33c2c",
  orange: "#f08c1a",
  green: "#1f9d62",
  cyan: "#5cc8ee",
  magenta: "#d85ca8",
  purple: "#7a4fc0",
  white: "#f6f6f2",
  brown: "#8a5a33",
};

/** @param {string} label */
export function colourOf(label) {
  const word = label.split("-")[0];
  return /** @type {Record<string, string>} */ (COLOURS)[word] ?? "#c8c8c8";
}

/** Black or white, whichever differs more from a colour by WCAG's luminance. @param {string} colour */
export function inkOn(colour) {
  const value = Number.parseInt(colour.slice(1), 16);
  const [r, g, b] = [value >> 16, (value >> 8) & 255, value & 255].map((part) => {
    const share = part / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  });
  const light = 0.2126 * r + 0.7152 * g + 0.0722 * b;
  return (light + 0.05) ** 2 > 1.05 * 0.05 ? "#000" : "#fff";
}
