// @ts-check
/** @import {Card} from "./messages.js" */
import { colourOf } from "./palette.js";
import { part } from "./panel.js";

const SVG = "http://www.w3.org/2000/svg";

/** @param {string} name @param {Record<string, string | number>} values @param {SVGElement} parent */
function draw(name, values, parent) {
  const one = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(values)) one.setAttribute(key, String(value));
  parent.append(one);
  return one;
}

/** A table from above: where buildings stood, and where those went that were moved. @param {Card} card */
function mapOf({ width, depth, labels, moved, ways }) {
  const map = document.createElementNS(SVG, "svg");
  map.setAttribute("viewBox", `0 0 ${width} ${depth}`);
  map.setAttribute("aria-hidden", "true");
  const unit = Math.hypot(width, depth) / 36;
  labels.forEach((label, i) => {
    const [x, z, toX, toZ] = ways[i];
    const fill = colourOf(label);
    draw("circle", { cx: x, cy: depth - z, r: unit, fill, stroke: "#222", "stroke-width": unit / 8 }, map);
    if (!moved.includes(i)) return;
    draw("line", { x1: x, y1: depth - z, x2: toX, y2: depth - toZ, stroke: "#222", "stroke-width": unit / 4 }, map);
    draw("circle", { cx: toX, cy: depth - toZ, r: unit * 0.6, fill, stroke: "#b00020", "stroke-width": unit / 3 }, map);
  });
  return map;
}

/**
 * Offer failures to look at.
 *
 * @param {Record<string, Card>} cards by the names of their recordings
 * @param {(name: string) => void} watch
 */
export function offerGallery(cards, watch) {
  part("gallery").hidden = !Object.keys(cards).length;
  const buttons = Object.entries(cards).map(([name, card]) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(mapOf(card), card.title);
    button.addEventListener("click", () => watch(name));
    return button;
  });
  part("cards").replaceChildren(...buttons);
}
