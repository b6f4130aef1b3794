"use strict";
// The cells of both maps, and pictures of them, a pixel a cell: A, B, what did not change, and masks of what did.

const DATA = JSON.parse(document.getElementById("data").textContent);
const UNKNOWN = 0, FREE = 1, OCCUPIED = 2;
const CHANGES = [
  { name: "free only in B", states: [1], pattern: "dots", side: "b", light: true },
  { name: "free only in A", states: [3], pattern: "dashes", side: "a", light: true },
  { name: "occupied only in B", states: [2, 5], pattern: "up", side: "b", light: false },
  { name: "occupied only in A", states: [6, 7], pattern: "down", side: "a", light: false },
];

// The map's own colours, which are those of the page's style.
function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--map-" + name).trim();
}

function rgb(name) {
  const hex = colour(name);
  return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
}

function unpacked(cells) {
  const bytes = Uint8Array.from(atob(cells.runs), (letter) => letter.charCodeAt(0));
  const states = new Uint8Array(cells.width * cells.height);
  for (let at = 0, place = 0; at < bytes.length;) {
    const state = bytes[at++];
    let length = 0, shift = 0, byte;
    do {
      byte = bytes[at++];
      length |= (byte & 127) << shift;
      shift += 7;
    } while (byte > 127);
    states.fill(state, place, place + length);
    place += length;
  }
  return states;
}

function painted(cells, states, colourOf) {
  const picture = document.createElement("canvas");
  picture.width = Math.max(1, cells.width);
  picture.height = Math.max(1, cells.height);
  const pen = picture.getContext("2d");
  const pixels = pen.createImageData(picture.width, picture.height);
  const table = Array.from({ length: 9 }, (_, state) => colourOf(state));
  for (let k = 0; k < states.length; k++) {
    const found = table[states[k]];
    if (found) {
      pixels.data[4 * k] = found[0];
      pixels.data[4 * k + 1] = found[1];
      pixels.data[4 * k + 2] = found[2];
      pixels.data[4 * k + 3] = 255;
    }
  }
  pen.putImageData(pixels, 0, 0);
  return picture;
}

// Pictures of one pair of maps; made again when the colour scheme changes.
function pictures(cells) {
  const states = unpacked(cells);
  const shades = [rgb("unknown"), rgb("free"), rgb("occupied")];
  const kept = rgb("kept");
  return {
    cells,
    states,
    a: painted(cells, states, (state) => shades[Math.floor(state / 3)]),
    b: painted(cells, states, (state) => shades[state % 3]),
    same: painted(cells, states, (state) => (state === 8 ? kept : state === 4 ? shades[FREE] : shades[UNKNOWN])),
    masks: CHANGES.map((change) => painted(cells, states, (state) => (change.states.includes(state) ? [0, 0, 0] : null))),
  };
}

// A tile of a change's colour with its pattern, so that the four are told apart without colour too.
function patternOf(change, ratio) {
  const size = Math.round(8 * ratio);
  const tile = document.createElement("canvas");
  tile.width = tile.height = size;
  const pen = tile.getContext("2d");
  pen.fillStyle = colour(change.light ? change.side + "-light" : change.side);
  pen.fillRect(0, 0, size, size);
  pen.strokeStyle = pen.fillStyle = change.light ? colour(change.side) : colour(change.side + "-light");
  pen.lineWidth = 1.3 * ratio;
  pen.beginPath();
  if (change.pattern === "dots") {
    pen.arc(size / 2, size / 2, 1.2 * ratio, 0, 7);
    pen.fill();
  } else if (change.pattern === "dashes") {
    pen.moveTo(size * 0.15, size / 2);
    pen.lineTo(size * 0.85, size / 2);
    pen.stroke();
  } else {
    const up = change.pattern === "up";
    for (const k of [-1, 0, 1]) {
      pen.moveTo((k - 0.1) * size, up ? 1.1 * size : -0.1 * size);
      pen.lineTo((k + 1.1) * size, up ? -0.1 * size : 1.1 * size);
    }
    pen.stroke();
  }
  return tile;
}
