// What the reader does: flip, zoom, move, choose walls.

const rows = [...document.querySelectorAll("tr.wall")];
const changed = rows.filter((row) => !row.classList.contains("same"));
const rowOf = new Map(rows.map((row) => [Number(row.dataset.wall), row]));

function setMode(mode) {
  const several = view.mode === "all";
  view.mode = mode;
  for (const button of document.querySelectorAll("#modes button")) {
    button.setAttribute("aria-pressed", button.dataset.mode === mode);
  }
  document.getElementById("swipe").hidden = mode !== "swipe";
  if (several !== (mode === "all")) fitAll();
  draw();
}

function zoom(factor, at) {
  const frame = frames().find((f) => !at || (at[0] >= f.x && at[0] <= f.x + f.width && at[1] >= f.y && at[1] <= f.y + f.height)) || frames()[0];
  const [px, py] = at || screen(frame, [view.x, view.y]);
  const [cx, cy] = screen(frame, [view.x, view.y]);
  const u = view.x + (px - cx) / view.scale, v = view.y - (py - cy) / view.scale;
  view.scale = Math.max(2, Math.min(2000, view.scale * factor));
  view.x = u - (px - cx) / view.scale;
  view.y = v + (py - cy) / view.scale;
  draw();
}

function choose(number, { look = false, scroll = false } = {}) {
  view.wall = number;
  rows.forEach((row) => row.classList.toggle("chosen", Number(row.dataset.wall) === number));
  if (number !== null && look) {
    const points = ["a", "b"].flatMap((side) => DATA.walls[number][side].flatMap((wall) =>
      [wall.ends.slice(0, 2), wall.ends.slice(2)].map((point) => placed(point, side))));
    const low = [0, 1].map((axis) => Math.min(...points.map((p) => p[axis])) - 1);
    const high = [0, 1].map((axis) => Math.max(...points.map((p) => p[axis])) + 1);
    fit(low, high, 250);
  }
  if (number !== null && scroll) rowOf.get(number).scrollIntoView({ block: "nearest" });
  draw();
}

function warm(number) {
  if (view.hot === number) return;
  view.hot = number;
  rows.forEach((row) => row.classList.toggle("hot", Number(row.dataset.wall) === number));
  draw();
}

// The wall under the pointer: the nearest within ten pixels.
function wallAt(px, py) {
  let best = null, least = 10;
  for (const frame of frames()) {
    if (px < frame.x || px > frame.x + frame.width || py < frame.y || py > frame.y + frame.height) continue;
    const sides = { a: ["a"], b: ["b"] }[frame.mode] || ["a", "b"];
    DATA.walls.forEach((change, number) => sides.forEach((side) => change[side].forEach((wall) => {
      const [[x0, y0], [x1, y1]] = wallEnds(frame, wall, side);
      const square = (x1 - x0) ** 2 + (y1 - y0) ** 2 || 1;
      const part = Math.max(0, Math.min(1, ((px - x0) * (x1 - x0) + (py - y0) * (y1 - y0)) / square));
      const off = Math.hypot(px - x0 - part * (x1 - x0), py - y0 - part * (y1 - y0));
      if (off < least) [least, best] = [off, number];
    })));
  }
  return best;
}

function told(number, px, py) {
  tip.hidden = number === null;
  if (number === null) return;
  const cells = rowOf.get(number).cells;
  tip.textContent = cells[0].textContent + ": " + cells[1].textContent.trim();
  tip.style.left = Math.max(4, Math.min(px + 14, canvas.clientWidth - tip.offsetWidth - 6)) + "px";
  tip.style.top = (py + 18 + tip.offsetHeight > canvas.clientHeight ? py - tip.offsetHeight - 8 : py + 18) + "px";
}

const fingers = new Map();
let moved = 0;
const inside = (event) => {
  const box = canvas.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
};

canvas.addEventListener("pointerdown", (event) => {
  canvas.focus({ preventScroll: true });
  canvas.setPointerCapture(event.pointerId);
  fingers.set(event.pointerId, inside(event));
  moved = 0;
});
canvas.addEventListener("pointermove", (event) => {
  const here = inside(event), before = fingers.get(event.pointerId);
  if (!before) {
    const number = shown.walls ? wallAt(...here) : null;
    warm(number);
    told(number, ...here);
    return;
  }
  const others = [...fingers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
  if (others.length) {
    const apart = (p) => Math.hypot(p[0] - others[0][0], p[1] - others[0][1]);
    zoom(apart(here) / Math.max(1, apart(before)), others[0]);
  } else if (view.mode === "swipe" && event.shiftKey) {
    setSwipe(here[0] / canvas.clientWidth);
  } else {
    view.x -= (here[0] - before[0]) / view.scale;
    view.y += (here[1] - before[1]) / view.scale;
    draw();
  }
  moved += Math.hypot(here[0] - before[0], here[1] - before[1]);
  fingers.set(event.pointerId, here);
});
for (const name of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(name, (event) => {
    fingers.delete(event.pointerId);
    if (name === "pointerup" && moved < 4 && shown.walls) {
      const here = inside(event), number = wallAt(...here);
      choose(number, { scroll: true });
      told(number, ...here);
    }
  });
}
canvas.addEventListener("pointerleave", () => { warm(null); told(null); });
canvas.addEventListener("dblclick", (event) => zoom(2, inside(event)));
canvas.addEventListener("wheel", (event) => {
  if (document.activeElement !== canvas && !event.ctrlKey) return;
  event.preventDefault();
  zoom(Math.exp(-event.deltaY * 0.0015), inside(event));
}, { passive: false });

function setSwipe(part) {
  view.swipe = Math.max(0, Math.min(1, part));
  document.getElementById("swipe").value = 100 * view.swipe;
  draw();
}

document.getElementById("modes").addEventListener("click", (event) => event.target.dataset.mode && setMode(event.target.dataset.mode));
document.getElementById("zoom").addEventListener("click", (event) => act(event.target.dataset.zoom));
document.getElementById("swipe").addEventListener("input", (event) => setSwipe(event.target.value / 100));
document.getElementById("checks").addEventListener("change", (event) => {
  shown[event.target.name] = event.target.checked;
  draw();
});
document.getElementById("same").addEventListener("change", (event) => {
  document.querySelector("table.walls")?.classList.toggle("every", event.target.checked);
});
for (const row of rows) {
  const number = Number(row.dataset.wall);
  row.addEventListener("pointerenter", () => warm(number));
  row.addEventListener("pointerleave", () => warm(null));
  row.addEventListener("click", () => choose(view.wall === number ? null : number, { look: view.wall !== number }));
  row.addEventListener("keydown", (event) => event.key === "Enter" && choose(number, { look: true }));
}

function act(what) {
  if (what === "in") zoom(1.5);
  if (what === "out") zoom(1 / 1.5);
  if (what === "fit") fitAll();
}

function step(by) {
  if (!changed.length) return;
  const at = changed.findIndex((row) => Number(row.dataset.wall) === view.wall);
  const next = changed[(at + by + changed.length + (at < 0 && by < 0 ? 1 : 0)) % changed.length];
  choose(Number(next.dataset.wall), { look: true, scroll: true });
}

const KEYS = {
  1: () => setMode("a"), 2: () => setMode("b"), 3: () => setMode("diff"), 4: () => setMode("all"), 5: () => setMode("swipe"),
  " ": () => setMode(view.mode === "a" ? "b" : "a"),
  "+": () => act("in"), "=": () => act("in"), "-": () => act("out"), 0: () => act("fit"),
  n: () => step(1), p: () => step(-1), Escape: () => choose(null),
};
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (["INPUT", "BUTTON", "SUMMARY"].includes(event.target.tagName) && [" ", "Enter"].includes(event.key)) return;
  if (event.target.tagName === "INPUT" && event.target.type === "range") return;
  if (KEYS[event.key]) {
    KEYS[event.key]();
    event.preventDefault();
  } else if (event.target === canvas && ARROWS[event.key]) {
    view.x += (ARROWS[event.key][0] * 60) / view.scale;
    view.y += (ARROWS[event.key][1] * 60) / view.scale;
    draw();
    event.preventDefault();
  }
});

function hide(name) {
  document.querySelector(`#checks input[name=${name}]`).parentElement.hidden = true;
}
if (!DATA.asIs) hide("aligned");
if (!DATA.surfaces.length && !DATA.truth.length) hide("truth");

repaint();
// The address may say where to begin: page.html#mode=swipe&wall=3
const asked = new URLSearchParams(location.hash.slice(1));
setMode(asked.get("mode") || (canvas.clientWidth < 640 ? "diff" : "all"));
fitAll();
plots();
if (asked.has("wall") && DATA.walls[asked.get("wall")]) choose(Number(asked.get("wall")), { look: true, scroll: true });
let width = 0;
new ResizeObserver(() => {
  if (canvas.clientWidth === width) return draw();
  width = canvas.clientWidth;
  fitAll();
  plots();
}).observe(canvas);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { repaint(); draw(); });
document.documentElement.dataset.ready = "yes";
