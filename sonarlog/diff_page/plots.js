// Numbers over sweeps, as small plots that share one cursor with the map.

const SVG = "http://www.w3.org/2000/svg";
const HEIGHT = 150, LEFT = 40, BELOW = 18, ABOVE = 8;
const cursors = [];

function element(name, attributes, parent) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent.append(made);
  return made;
}

function plots() {
  const box = document.getElementById("plots");
  box.textContent = "";
  cursors.length = 0;
  // All of them take their places first: only then is it known how wide each is.
  const figures = DATA.plots.map((plot) => titled(plot, box));
  DATA.plots.forEach((plot, k) => cursors.push(drawn(plot, ...figures[k])));
  pointAt(view.sweep);
}

function titled(plot, box) {
  const figure = document.createElement("div");
  figure.className = "plot";
  const title = document.createElement("h3"), said = document.createElement("span");
  title.append(plot.title + ", " + plot.unit, said);
  figure.append(title);
  box.append(figure);
  return [figure, said];
}

function drawn(plot, figure, said) {
  const width = figure.clientWidth || 320;
  const svg = element("svg", { viewBox: `0 0 ${width} ${HEIGHT}`, height: HEIGHT, role: "img", "aria-label": plot.title }, figure);
  const values = plot.lines.flatMap((line) => line.values);
  const count = Math.max(2, ...plot.lines.map((line) => line.values.length));
  const low = Math.min(0, ...values), high = Math.max(low + 1e-6, ...values);
  const x = (k) => LEFT + (k / (count - 1)) * (width - LEFT - 8);
  const y = (v) => ABOVE + (1 - (v - low) / (high - low)) * (HEIGHT - ABOVE - BELOW);
  for (const value of ticks(low, high, 4)) {
    element("line", { class: "grid", x1: LEFT, x2: width - 8, y1: y(value), y2: y(value) }, svg);
    element("text", { x: LEFT - 5, y: y(value) + 4, "text-anchor": "end" }, svg).textContent = +value.toFixed(6);
  }
  for (const k of ticks(0, count - 1, 6).filter(Number.isInteger)) {
    element("text", { x: x(k), y: HEIGHT - 4, "text-anchor": "middle" }, svg).textContent = k;
  }
  if (DATA.first !== null) {
    element("line", { class: "first", x1: x(DATA.first), x2: x(DATA.first), y1: ABOVE, y2: HEIGHT - BELOW }, svg);
  }
  for (const line of plot.lines) {
    const points = line.values.map((v, k) => `${k ? "L" : "M"}${x(k).toFixed(1)} ${y(v).toFixed(1)}`).join("");
    element("path", { class: line.style, d: points || "M0 0" }, svg);
  }
  const cursor = element("line", { class: "cursor", y1: ABOVE, y2: HEIGHT - BELOW, visibility: "hidden" }, svg);
  const sweepAt = (event) => {
    const inside = event.clientX - svg.getBoundingClientRect().left;
    return Math.max(0, Math.min(count - 1, Math.round(((inside - LEFT) / (width - LEFT - 8)) * (count - 1))));
  };
  svg.addEventListener("pointermove", (event) => pointAt(sweepAt(event)));
  svg.addEventListener("pointerdown", (event) => pointAt(sweepAt(event)));
  svg.addEventListener("pointerleave", () => pointAt(null));
  return (sweep) => {
    cursor.setAttribute("visibility", sweep === null ? "hidden" : "visible");
    const names = { a: "┅ ", b: "━ ", plain: "━ ", faint: "┈ " };
    const told = (line) => (sweep === null ? "" : " " + (line.values[sweep] === undefined ? "–" : line.values[sweep].toFixed(2)));
    said.textContent = (sweep === null ? "" : `sweep ${sweep}: `) +
      plot.lines.map((line) => names[line.style] + line.name + told(line)).join("  ");
    if (sweep !== null) {
      cursor.setAttribute("x1", x(sweep));
      cursor.setAttribute("x2", x(sweep));
    }
  };
}

function ticks(low, high, about) {
  const rough = (high - low) / about, power = Math.pow(10, Math.floor(Math.log10(rough)));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough);
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) => (first + k) * step);
}

function pointAt(sweep) {
  view.sweep = sweep;
  cursors.forEach((point) => point(sweep));
  draw();
}
