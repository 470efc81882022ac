// What a reader can do with a report: copy commands, zoom into every plot, look at any window.
// The page says everything without this script: it replaces pictures by plots of the same numbers.
"use strict";
(() => {
const data = JSON.parse(document.getElementById("data").textContent);
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const dark = matchMedia("(prefers-color-scheme: dark)");
const plots = new Set();
document.documentElement.classList.add("scripted");
for (const element of document.querySelectorAll(".interactive[hidden]")) element.hidden = false;

// Numbers

function decode(text, kind) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new kind(bytes.buffer);
}
function digits(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(3) : String(Number(value.toPrecision(5)));
  return text.replaceAll("-", "−");
}

// Copies of commands

for (const box of document.querySelectorAll(".copyable")) {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = "Copy";
  button.addEventListener("click", async () => {
    const said = await copy(box.querySelector("code").textContent);
    button.textContent = said ? "Copied" : "Select it and press Ctrl+C";
    setTimeout(() => { button.textContent = "Copy"; }, 2000);
  });
  box.append(button);
}
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch { // a page from a file may be refused the clipboard
    const field = document.createElement("textarea");
    field.value = text;
    document.body.append(field);
    field.select();
    const done = document.execCommand("copy");
    field.remove();
    return done;
  }
}

// Plots: hover is the legend, dragging zooms, Shift and dragging moves, a double click shows all

const LOOKS = {
  before: { stroke: "ink", dash: [5, 3], width: 1.3 }, after: { stroke: "accent", width: 1.8 },
  measured: { stroke: "pale", width: 5 }, noise: { stroke: "soft", dash: [2, 3], width: 1 },
  band: { stroke: "accent", dash: [1, 3], width: 0.7 },
};
function axis(label, more) {
  const grid = { stroke: () => css("line"), width: 1 };
  const values = (u, ticks) => ticks.map((tick) => (tick === null ? "" : digits(tick).replace(/\.?0*e/, "e")));
  return { label, size: 30, labelSize: 18, labelFont: "12px system-ui, sans-serif", font: "12px system-ui, sans-serif",
    stroke: () => css("ink"), grid, ticks: { ...grid, size: 4 }, values, ...more };
}
function line(label, look, more) {
  return { label, stroke: () => css(look.stroke), width: look.width, dash: look.dash, points: { show: false },
    value: (u, value) => digits(value), ...more };
}
function moving(u) { // Shift and dragging moves along x
  u.over.addEventListener("mousedown", (event) => {
    if (!event.shiftKey || event.button !== 0) return;
    event.stopImmediatePropagation();
    const { min, max } = u.scales.x, from = event.clientX, share = (max - min) / u.over.clientWidth;
    const move = (later) => {
      const by = (from - later.clientX) * share;
      u.setScale("x", { min: min + by, max: max + by });
    };
    const end = () => { removeEventListener("mousemove", move); removeEventListener("mouseup", end); };
    addEventListener("mousemove", move);
    addEventListener("mouseup", end);
  }, true);
}
function draw(element, options, values) {
  const width = () => Math.max(element.clientWidth, 200);
  const hooks = options.hooks ?? {};
  const plot = new uPlot({ width: width(), height: 220, legend: { live: true }, ...options,
    scales: { x: { time: false }, ...options.scales },
    cursor: { drag: { x: true, y: false, dist: 5 }, ...options.cursor },
    hooks: { ...hooks, ready: [moving, ...(hooks.ready ?? [])] } }, values, element);
  plot.over.setAttribute("role", "img");
  plot.over.setAttribute("aria-label", element.dataset.title || options.axes[1].label);
  plots.add(plot);
  new ResizeObserver(() => {
    if (Math.abs(plot.width - width()) > 1) plot.setSize({ width: width(), height: plot.height });
  }).observe(element);
  return plot;
}
dark.addEventListener("change", () => { for (const plot of plots) plot.redraw(); });

function drawSpec(element) {
  const spec = data.plots[element.dataset.plot];
  if (!spec) return;
  const series = [{ label: spec.xLabel, value: (u, value) => digits(value) }];
  for (const { label, role } of spec.lines) series.push(line(label, LOOKS[role]));
  const [low, high] = spec.lines.flatMap(({ role }, k) => (role === "band" ? [k + 1] : []));
  const bands = high ? [{ series: [high, low], fill: () => css("band") }] : undefined;
  const scale = spec.log ? { distr: 3 } : {}, plain = spec.log ? { grid: { show: false } } : {};
  draw(element, { series, bands, axes: [axis(spec.xLabel, plain), axis(spec.yLabel, { size: 62, ...plain })],
    scales: { x: { time: false, ...scale }, y: scale } }, [spec.x, ...spec.lines.map(({ values }) => values)]);
}
for (const element of document.querySelectorAll("[data-plot]")) drawSpec(element);

// The recording whole

const windows = data.windows.rows.map(([number, held, begin, end, before, after]) =>
  ({ number, held: Boolean(held), begin, end, before, after }));
let chosen = null;
const tracks = [];

function shade(u) { // windows by purpose, gaps, samples left out, and the window that is chosen
  const { ctx } = u, { left, top, width, height } = u.bbox;
  const at = (time) => u.valToPos(time, "x", true);
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, height);
  ctx.clip();
  for (const row of windows) {
    ctx.fillStyle = css(row.held ? "held" : "learned");
    if (row.held) ctx.fillRect(at(row.begin), top, at(row.end) - at(row.begin), height);
    else ctx.fillRect(at(row.begin), top + height - 3, at(row.end) - at(row.begin) - 1, 3);
  }
  ctx.fillStyle = css("pale");
  for (const [begin, end] of data.motion.breaks) ctx.fillRect(at(begin), top, Math.max(at(end) - at(begin), 1), height);
  ctx.fillStyle = css("red");
  for (const mark of data.motion.marks) ctx.fillRect(at(mark) - 1, top + height - 9, 2, 9);
  if (chosen) {
    ctx.strokeStyle = css("accent");
    ctx.lineWidth = 2;
    ctx.strokeRect(at(chosen.begin), top + 1, at(chosen.end) - at(chosen.begin), height - 2);
  }
  ctx.restore();
}
function follow(u, key) { // all plots of the recording show the same stretch
  if (key !== "x" || u.following) return;
  const { min, max } = u.scales.x;
  for (const other of tracks) {
    if (other === u || (other.scales.x.min === min && other.scales.x.max === max)) continue;
    other.following = true;
    other.setScale("x", { min, max });
    other.following = false;
  }
}
function choosing(u) { // a click, not a drag, chooses the window under it
  let from = 0;
  u.over.addEventListener("mousedown", (event) => { from = event.clientX; });
  u.over.addEventListener("click", (event) => {
    if (Math.abs(event.clientX - from) > 4 || event.shiftKey) return;
    const time = u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x");
    const row = windows.find(({ begin, end }) => begin <= time && time <= end);
    if (row) choose(row.number);
  });
}
function track(title, unit, values, more = {}) {
  const element = document.createElement("div");
  element.className = "plot";
  element.dataset.title = title;
  document.getElementById("tracks").append(element);
  const label = unit ? `${title} (${unit})` : title;
  const { series = [line(label, { stroke: "accent", width: 1.2 })], scales = {}, y = {} } = more;
  const plot = draw(element, { height: 130, scales, axes: [axis(null), axis(unit || " ", { size: 62, space: 18, ...y })],
    series: [{ label: "time (s)", value: (u, value) => digits(value) }, ...series],
    cursor: { drag: { x: true, y: false, dist: 5 }, sync: { key: "recording", setSeries: false } },
    hooks: { drawClear: [shade], setScale: [follow], ready: [choosing] } }, values);
  tracks.push(plot);
}
function drawRecording() {
  const times = Array.from(decode(data.motion.times, Float32Array), (time) => time + data.motion.begin);
  for (const { title, unit, values } of data.motion.tracks) {
    const numbers = Array.from(decode(values, Float32Array), (value) => (Number.isNaN(value) ? null : value));
    track(title, unit, [times, numbers]);
  }
  if (windows.length) drawErrors();
  for (const button of document.querySelectorAll("[data-zoom]")) button.addEventListener("click", () => zoom(button.dataset.zoom));
}
const DEEPEST = 1000; // times below the median: an error of a rig at rest stays under the frame
function drawErrors() { // error of every window over time, a plot each channel, on a logarithmic axis
  const middles = windows.map(({ begin, end }) => (begin + end) / 2);
  const { min, max } = tracks[0].scales.x;
  data.windows.channels.forEach(({ name, unit }, k) => {
    const positive = (value) => (value > 0 ? value : null);
    const lines = ["before", "after"].map((when) => windows.map((row) => positive(row[when][k])));
    const dots = (when) => line(`${name}: error ${when} (${unit})`, LOOKS[when], { points: { show: true, size: 5 }, paths: () => null });
    const drawn = lines.flat().filter((value) => value !== null).sort((a, b) => a - b);
    if (!drawn.length) return;
    const lowest = drawn[Math.floor(drawn.length / 2)] / DEEPEST;
    const range = (u, min, max) => uPlot.rangeLog(max > lowest ? Math.max(min, lowest) : min, max, 10, true);
    track(`error of each window, ${name}`, unit, [middles, ...lines],
      { series: [dots("before"), dots("after")], scales: { y: { distr: 3, range } }, y: { grid: { show: false } } });
    tracks.at(-1).setScale("x", { min, max });
  });
}
function zoom(way) {
  const { min, max } = tracks[0].scales.x, span = max - min;
  const times = tracks[0].data[0], whole = [times[0], times.at(-1)];
  const range = {
    in: [min + span / 4, max - span / 4], out: [min - span / 2, max + span / 2],
    left: [min - span / 2, max - span / 2], right: [min + span / 2, max + span / 2], all: whole,
  }[way];
  const [least, most] = [Math.max(range[0], whole[0]), Math.min(range[1], whole[1])];
  if (most > least) tracks[0].setScale("x", { min: least, max: most });
}

// Any window, before and after

let pictures = [];
function choose(number) {
  const row = windows[Math.min(Math.max(number, 1), windows.length) - 1];
  if (!row) return;
  chosen = row;
  document.getElementById("window-number").value = row.number;
  const errors = data.windows.channels.map(({ name, unit }, k) =>
    `${name} ${digits(row.before[k])} → ${digits(row.after[k])} ${unit}`).join(", ");
  const runs = data.windows.runs[row.number];
  document.getElementById("window-facts").textContent =
    `Window ${row.number}, ${row.begin.toFixed(2)} to ${row.end.toFixed(2)} s, ${row.held ? "held out" : "learned on"}: error ${errors}.` +
    (runs ? "" : " Its runs are not in this page, which holds 200 of them.");
  for (const picture of pictures) { plots.delete(picture); picture.destroy(); }
  const area = document.getElementById("window-plots");
  area.replaceChildren();
  pictures = runs ? runs.map((run, k) => drawRuns(area, run, data.windows.channels[k])) : [];
  for (const plot of tracks) plot.redraw(false);
}
function drawRuns(area, run, { name, unit }) {
  const raw = decode(run.lines, Int16Array), count = raw.length / 3;
  const lines = [0, 1, 2].map((k) => Array.from(raw.subarray(k * count, (k + 1) * count),
    (value) => (value === -32768 ? null : run.middle + value * run.step)));
  const times = lines[0].map((_, k) => run.begin + ((run.end - run.begin) * k) / Math.max(count - 1, 1));
  const element = document.createElement("div");
  element.className = "plot";
  element.dataset.title = `${name} in the chosen window: measured, before and after`;
  area.append(element);
  return draw(element, { height: 240, axes: [axis("time (s)"), axis(`${name} (${unit})`, { size: 64 })],
    series: [{ label: "time (s)", value: (u, value) => digits(value) }, line("measured", LOOKS.measured),
      line("before", LOOKS.before), line("after", LOOKS.after)] }, [times, ...lines]);
}
function step(by) {
  if (by === "worst") return choose(data.windows.worst || 1);
  const only = document.getElementById("only-held-out").checked;
  let k = (chosen?.number ?? 1) - 1;
  do k += Number(by); while (windows[k] && only && !windows[k].held);
  if (windows[k]) choose(windows[k].number);
}

if (data.motion && document.getElementById("tracks")) drawRecording();
if (windows.length && document.getElementById("picker")) {
  for (const button of document.querySelectorAll("[data-step]")) button.addEventListener("click", () => step(button.dataset.step));
  document.getElementById("window-number").addEventListener("change", (event) => choose(Number(event.target.value)));
  for (const link of document.querySelectorAll("[data-window]")) {
    link.addEventListener("click", () => choose(Number(link.dataset.window)));
  }
  choose(data.windows.worst || 1);
}
document.documentElement.dataset.ready = "true";
})();
