// Figures grow when they are clicked; residuals are drawn from numbers, to be zoomed and dragged.
for (const image of document.querySelectorAll("figure img"))
  image.addEventListener("click", () => image.closest("figure").classList.toggle("zoomed"));

const runs = JSON.parse(document.getElementById("residual-data").textContent);
const NS = "http://www.w3.org/2000/svg", H = 240, LEFT = 60, FOOT = 34;

function element(name, attributes, parent, text) {
  const made = document.createElementNS(NS, name);
  for (const key in attributes) made.setAttribute(key, attributes[key]);
  if (text !== undefined) made.textContent = text;
  return parent.appendChild(made);
}

// Round values within [low, high], about `count` of them.
function ticks(low, high, count) {
  const rough = (high - low) / count, decade = 10 ** Math.floor(Math.log10(rough));
  const step = decade * [1, 2, 5, 10].find(m => m * decade >= rough);
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push([k * step, (k * step).toFixed(digits)]);
  return found;
}

function residuals(place, data) {
  const svg = element("svg", {}, place);
  const note = document.createElement("p");
  note.textContent = `${place.dataset.run}: reading minus mean model, with the predictions' central 50 and ` +
    "90 %. The wheel zooms, dragging moves, double click shows all.";
  place.appendChild(note);
  const all = [data.time[0], data.time[data.time.length - 1]];
  const most = 1.05 * Math.max(...data.residual.map(Math.abs), ...data.q95.map(Math.abs));
  let [from, to] = all, drag = null, W = 0;
  const x = t => LEFT + (W - LEFT) * (t - from) / (to - from);
  const y = r => (H - FOOT) * (0.5 - 0.5 * r / most);

  function draw() {
    svg.replaceChildren();
    W = svg.clientWidth;  // so that text has its size on every screen
    svg.setAttribute("viewBox", `0 0 ${W} ${H}`);
    const seen = data.time.map((t, i) => i).filter(i => data.time[i] >= from && data.time[i] <= to);
    for (const [low, high, colour] of [["q05", "q95", "#C7DFEE"], ["q25", "q75", "#7DB6D9"]]) {
      const up = seen.map(i => `${x(data.time[i])},${y(data[high][i])}`);
      const down = seen.map(i => `${x(data.time[i])},${y(data[low][i])}`).reverse();
      element("polygon", { points: [...up, ...down].join(" "), fill: colour }, svg);
    }
    element("line", { x1: LEFT, x2: W, y1: y(0), y2: y(0), stroke: "#0072B2" }, svg);
    for (const i of seen) element("circle", { cx: x(data.time[i]), cy: y(data.residual[i]), r: 1.6 }, svg);
    for (const [t, text] of ticks(from, to, W / 70))
      element("text", { x: x(t), y: H - FOOT + 14, class: "time", "text-anchor": "middle" }, svg, text);
    for (const [r, text] of ticks(-most, most, 5))
      element("text", { x: LEFT - 6, y: y(r) + 4, "text-anchor": "end" }, svg, text);
    element("text", { x: LEFT + (W - LEFT) / 2, y: H - 5, "text-anchor": "middle" }, svg, "time [s]");
    element("text", { x: -(H - FOOT) / 2, y: 12, transform: "rotate(-90)", "text-anchor": "middle" }, svg,
      `residual [${data.unit}]`);
  }
  function show(low, high) {
    const width = Math.min(Math.max(high - low, 1e-3 * (all[1] - all[0])), all[1] - all[0]);
    from = Math.min(Math.max(low, all[0]), all[1] - width);
    to = from + width;
    draw();
  }
  const at = event => {
    const box = svg.getBoundingClientRect();
    const share = ((event.clientX - box.left) / box.width * W - LEFT) / (W - LEFT);
    return from + share * (to - from);
  };
  svg.addEventListener("wheel", event => {
    event.preventDefault();
    const t = at(event), factor = event.deltaY < 0 ? 0.8 : 1.25;
    show(t - factor * (t - from), t + factor * (to - t));
  }, { passive: false });
  svg.addEventListener("pointerdown", event => { drag = at(event); });
  window.addEventListener("pointerup", () => { drag = null; });
  svg.addEventListener("pointermove", event => {
    if (drag !== null) { const moved = drag - at(event); show(from + moved, to + moved); }
  });
  svg.addEventListener("dblclick", () => show(...all));
  window.addEventListener("resize", draw);
  draw();
}

for (const place of document.querySelectorAll(".residuals")) residuals(place, runs[place.dataset.run]);
