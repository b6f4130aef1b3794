// The drawing: one canvas with one, two or three views of the same part of the plane.

const canvas = document.getElementById("map");
const tip = document.getElementById("tip");
const view = { x: 0, y: 0, scale: 50, mode: "all", swipe: 0.5, wall: null, hot: null, sweep: null };
const shown = { aligned: true, walls: true, paths: true, truth: true };
const TITLES = { a: "A  " + DATA.names[0], b: "B  " + DATA.names[1], diff: "Difference" };
const LETTERS = "600 13px system-ui, 'DejaVu Sans', sans-serif";
const ROOM = 26;  // for a title
let images = {}, tiles = [], ratio = 1;

function repaint() {
  ratio = window.devicePixelRatio || 1;
  images = { laid: pictures(DATA.laid) };
  images.asIs = DATA.asIs ? pictures(DATA.asIs) : images.laid;
  tiles = CHANGES.map((change) => patternOf(change, ratio));
  legend();
}

// From a map's frame to the plane of the page, in metres: B's is laid on A's first, then both are turned level.
function placed(point, side) {
  let [x, y] = point;
  if (side === "b" && shown.aligned) {
    const [dx, dy, turn] = DATA.lay;
    [x, y] = [dx + Math.cos(turn) * x - Math.sin(turn) * y, dy + Math.sin(turn) * x + Math.cos(turn) * y];
  }
  const cosine = Math.cos(DATA.level), sine = Math.sin(DATA.level);
  return [cosine * x + sine * y, cosine * y - sine * x];
}

// Where each view stands, as (x, y, width, height) in parts of the canvas: the way that shows the map largest.
const STANDING = [
  [[0, 0, 1, 1 / 3], [0, 1 / 3, 1, 1 / 3], [0, 2 / 3, 1, 1 / 3]],
  [[0, 0, 1 / 3, 1], [1 / 3, 0, 1 / 3, 1], [2 / 3, 0, 1 / 3, 1]],
  [[0, 0, 1 / 2, 1 / 2], [1 / 2, 0, 1 / 2, 1 / 2], [0, 1 / 2, 1, 1 / 2]],
];

function frames() {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const made = ([x, y, w, h], mode) => ({ mode, x: x * width, y: y * height, width: w * width, height: h * height });
  if (view.mode !== "all") return [made([0, 0, 1, 1], view.mode)];
  const [low, high] = extent();
  const scale = ([[, , w, h]]) => Math.min((w * width) / (high[0] - low[0]), (h * height - ROOM) / (high[1] - low[1]));
  const best = STANDING.reduce((one, other) => (scale(other) > scale(one) ? other : one));
  return ["a", "b", "diff"].map((mode, k) => made(best[k], mode));
}

// What has to be seen, in the plane of the page: every known cell and every path.
let known = null;
function extent() {
  if (known) return known;
  const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  const add = (point, side) => placed(point, side).forEach((value, axis) => {
    low[axis] = Math.min(low[axis], value);
    high[axis] = Math.max(high[axis], value);
  });
  const { cells, states } = images.laid;
  for (let k = 0; k < states.length; k++) {
    if (states[k]) {
      const column = k % cells.width, row = (k - column) / cells.width;
      add([(cells.left + column) * DATA.cell_m, (cells.bottom + row) * DATA.cell_m], "a");
    }
  }
  DATA.paths[0].forEach((pose) => add(pose, "a"));
  if (low[0] > high[0]) return [[-1, -1], [1, 1]];
  known = [low.map((value) => value - 0.3), high.map((value) => value + 0.3)];
  return known;
}

function fit(low, high, atMost = 400) {
  const frame = frames()[0];
  view.x = (low[0] + high[0]) / 2;
  view.y = (low[1] + high[1]) / 2;
  view.scale = Math.min(atMost, frame.width / (high[0] - low[0]), (frame.height - ROOM) / (high[1] - low[1]));
  draw();
}

// As high as the map needs, but never more than the reader's window has room for.
function setHeight() {
  const [low, high] = extent(), width = canvas.parentElement.clientWidth;
  const views = view.mode === "all" ? 3 : 1;
  const one = width * (high[1] - low[1]) / (high[0] - low[0]) + 70;
  const most = Math.max(340, 0.7 * window.innerHeight);
  canvas.parentElement.style.height = Math.round(Math.max(260, Math.min(most, views * one))) + "px";
}

function fitAll() {
  setHeight();
  fit(...extent());
}

function screen(frame, [u, v]) {
  return [frame.x + frame.width / 2 + (u - view.x) * view.scale, frame.y + frame.height / 2 + 10 - (v - view.y) * view.scale];
}

function draw() {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  for (const frame of frames()) {
    pen.save();
    pen.beginPath();
    pen.rect(frame.x, frame.y, frame.width, frame.height);
    pen.clip();
    pen.fillStyle = colour("unknown");
    pen.fillRect(frame.x, frame.y, frame.width, frame.height);
    if (frame.mode === "swipe") drawSwipe(pen, frame);
    else drawView(pen, frame, frame.mode);
    pen.restore();
    pen.strokeStyle = colour("rule");
    pen.lineWidth = 1;
    pen.strokeRect(frame.x, frame.y, frame.width, frame.height);
  }
}

function drawSwipe(pen, frame) {
  const border = frame.x + frame.width * view.swipe;
  for (const [mode, x, width] of [["a", frame.x, border - frame.x], ["b", border, frame.x + frame.width - border]]) {
    pen.save();
    pen.beginPath();
    pen.rect(x, frame.y, width, frame.height);
    pen.clip();
    drawView(pen, frame, mode, x + 8);
    pen.restore();
  }
  pen.strokeStyle = colour("focus");
  pen.lineWidth = 3;
  stroke(pen, [[border, frame.y], [border, frame.y + frame.height]]);
}

function drawView(pen, frame, mode, titleAt = frame.x + 8) {
  const set = shown.aligned ? images.laid : images.asIs;
  drawCells(pen, frame, set, mode);
  pen.lineJoin = pen.lineCap = "round";
  if (shown.truth) drawTruth(pen, frame);
  if (shown.walls) drawWalls(pen, frame, mode);
  if (shown.paths) drawPaths(pen, frame, mode);
  drawMarks(pen, frame, mode);
  pen.font = LETTERS;
  label(pen, TITLES[mode], titleAt, frame.y + 18, mode === "diff" ? colour("ink") : colour(mode));
  drawScale(pen, frame);
}

function drawCells(pen, frame, set, mode) {
  const place = (target, offset) => {
    const [x, y] = screen(frame, [0, 0]);
    const scale = view.scale * DATA.cell_m, cosine = Math.cos(DATA.level), sine = Math.sin(DATA.level);
    target.setTransform(
      ratio * scale * cosine, ratio * scale * sine, ratio * scale * sine, -ratio * scale * cosine,
      ratio * (x - offset[0]), ratio * (y - offset[1]));
    target.imageSmoothingEnabled = false;
  };
  const at = [set.cells.left, set.cells.bottom];
  pen.save();
  place(pen, [0, 0]);
  pen.drawImage(mode === "diff" ? set.same : set[mode], ...at);
  pen.restore();
  if (mode !== "diff") return;
  const layer = document.createElement("canvas");
  layer.width = Math.ceil(frame.width * ratio);
  layer.height = Math.ceil(frame.height * ratio);
  const brush = layer.getContext("2d");
  set.masks.forEach((mask, k) => {
    brush.setTransform(1, 0, 0, 1, 0, 0);
    brush.globalCompositeOperation = "source-over";
    brush.clearRect(0, 0, layer.width, layer.height);
    place(brush, [frame.x, frame.y]);
    brush.drawImage(mask, ...at);
    brush.setTransform(1, 0, 0, 1, 0, 0);
    brush.globalCompositeOperation = "source-in";
    brush.fillStyle = brush.createPattern(tiles[k], "repeat");
    brush.fillRect(0, 0, layer.width, layer.height);
    pen.drawImage(layer, frame.x, frame.y, layer.width / ratio, layer.height / ratio);
  });
}

function stroke(pen, points) {
  pen.beginPath();
  points.forEach((point, k) => (k ? pen.lineTo(...point) : pen.moveTo(...point)));
  pen.stroke();
}

function drawTruth(pen, frame) {
  pen.strokeStyle = colour("true");
  pen.lineWidth = 2;
  pen.setLineDash([1, 5]);
  for (const [x0, y0, x1, y1] of DATA.surfaces) stroke(pen, [[x0, y0], [x1, y1]].map((p) => screen(frame, placed(p, "a"))));
  pen.setLineDash([]);
}

function drawPaths(pen, frame, mode) {
  const line = (rows, side, name, width, dash) => {
    pen.strokeStyle = colour(name);
    pen.lineWidth = width;
    pen.setLineDash(dash);
    stroke(pen, rows.map((row) => screen(frame, placed(row, side))));
    pen.setLineDash([]);
  };
  if (shown.truth && DATA.truth.length) line(DATA.truth, "a", "true", 1.5, [1, 4]);
  if (mode !== "b") line(DATA.paths[0], "a", "a", 2.5, [7, 4]);
  if (mode !== "a") line(DATA.paths[1], "b", "b", 2.5, []);
}

// Every wall as a line with bars at its ends; a changed one is thick, the chosen one has a halo.
function drawWalls(pen, frame, mode) {
  const sides = mode === "diff" ? ["a", "b"] : [mode];
  DATA.walls.forEach((change, number) => {
    for (const side of sides) {
      for (const wall of change[side]) {
        const ends = wallEnds(frame, wall, side);
        const chosen = number === view.wall || number === view.hot;
        if (chosen) {
          pen.strokeStyle = colour("focus");
          pen.lineWidth = 12;
          pen.globalAlpha = 0.55;
          stroke(pen, ends);
          pen.globalAlpha = 1;
        }
        pen.strokeStyle = colour(side);
        pen.lineWidth = change.kinds.length ? 2.5 : 1.2;
        pen.setLineDash(side === "a" ? [8, 5] : []);
        stroke(pen, ends);
        pen.setLineDash([]);
        pen.lineWidth = 1.5;
        bars(pen, ends);
        if (chosen) label(pen, wall.n + "", ends[1][0] + 6, ends[1][1] - 6, colour(side));
      }
    }
  });
}

function wallEnds(frame, wall, side) {
  return [wall.ends.slice(0, 2), wall.ends.slice(2)].map((point) => screen(frame, placed(point, side)));
}

function bars(pen, [start, end]) {
  const length = Math.hypot(end[0] - start[0], end[1] - start[1]) || 1;
  const aside = [((end[1] - start[1]) / length) * 4, ((start[0] - end[0]) / length) * 4];
  for (const [x, y] of [start, end]) stroke(pen, [[x - aside[0], y - aside[1]], [x + aside[0], y + aside[1]]]);
}

// Where the first difference arose, and the sweep that is pointed at in a plot.
function drawMarks(pen, frame, mode) {
  pen.font = LETTERS;
  const sides = mode === "diff" ? ["a", "b"] : [mode];
  const rings = [[DATA.first, "first difference", 10], [view.sweep, "sweep " + view.sweep, 7]];
  for (const [sweep, text, size] of rings) {
    if (sweep === null) continue;
    for (const side of sides) {
      const pose = DATA.paths[side === "a" ? 0 : 1][sweep];
      if (!pose) continue;
      const [x, y] = screen(frame, placed(pose, side));
      pen.strokeStyle = colour("focus");
      pen.lineWidth = 3;
      pen.beginPath();
      pen.arc(x, y, size, 0, 7);
      pen.stroke();
      const room = frame.x + frame.width - x - size - pen.measureText(text).width;
      const left = room > 0 ? x + size : x - size - pen.measureText(text).width;
      if (side === sides[0]) label(pen, text, left, y - size, colour("focus"));
    }
  }
}

function label(pen, text, x, y, ink) {
  pen.font = LETTERS;
  pen.strokeStyle = colour("paper");
  pen.lineWidth = 4;
  pen.lineJoin = "round";
  pen.strokeText(text, x, y);
  pen.fillStyle = ink;
  pen.fillText(text, x, y);
}

function drawScale(pen, frame) {
  const metres = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50].filter((m) => m * view.scale <= frame.width / 5).pop() || 0.1;
  const x = frame.x + frame.width - 12, y = frame.y + frame.height - 10, length = metres * view.scale;
  pen.strokeStyle = colour("ink");
  pen.lineWidth = 2;
  stroke(pen, [[x - length, y - 5], [x - length, y], [x, y], [x, y - 5]]);
  pen.textAlign = "right";
  label(pen, metres + " m", x - 2, y - 6, colour("ink"));
  pen.textAlign = "left";
}
