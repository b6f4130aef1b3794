// What colours, patterns and lines of the drawing mean.

function legend() {
  const row = document.getElementById("legend");
  row.textContent = "";
  const add = (text, paint) => {
    const item = document.createElement("span"), sample = document.createElement("canvas");
    sample.width = 30 * ratio;
    sample.height = 16 * ratio;
    sample.style.width = "30px";
    sample.style.height = "16px";
    const pen = sample.getContext("2d");
    paint(pen, sample);
    item.append(sample, text);
    row.append(item);
  };
  const filled = (style) => (pen, sample) => {
    pen.fillStyle = style(pen);
    pen.fillRect(0, 0, sample.width, sample.height);
  };
  for (const name of ["unknown", "free", "occupied"]) add(name, filled(() => colour(name)));
  CHANGES.forEach((change, k) => add(change.name, filled((pen) => pen.createPattern(tiles[k], "repeat"))));
  const lined = (name, dash) => (pen, sample) => {
    filled(() => colour("free"))(pen, sample);
    pen.strokeStyle = colour(name);
    pen.lineWidth = 3 * ratio;
    pen.setLineDash(dash.map((part) => part * ratio));
    stroke(pen, [[0, sample.height / 2], [sample.width, sample.height / 2]]);
  };
  add("path and walls of A", lined("a", [7, 4]));
  add("path and walls of B", lined("b", []));
  if (DATA.surfaces.length || DATA.truth.length) add("true", lined("true", [2, 4]));
}
