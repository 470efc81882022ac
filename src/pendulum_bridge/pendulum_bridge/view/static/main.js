// The page: frames in, drawings and numbers out.

import { Banners } from "./banners.js";
import { control, setIdle } from "./controls.js";
import { follow } from "./link.js";
import { Nodes } from "./nodes.js";
import { Panel } from "./panel.js";
import { Plot } from "./plot.js";
import { Recordings } from "./recordings.js";
import { Timeline } from "./timeline.js";
import { DEGREES, made, say, signed, tick } from "./words.js";

const by = (id) => document.getElementById(id);
const banners = new Banners(by("banners"));
const nodes = new Nodes(by("nodes"));
const recordings = new Recordings(by("recordings"), tell);
const panels = [new Panel(by("rig"), "twin", ", dashed: the twin"), new Panel(by("twin"), null, "")];

const both = (column) => ["rig", "twin"].map((source) =>
  ({ key: `${source}_${column}`, label: source, colour: source, source, broad: source === "rig" }));
const commands = ["rig", "twin"].flatMap((source) => {
  const common = { colour: source, source, broad: source === "rig", stepped: true };
  return [
    { key: `${source}_pwm`, label: `${source} asked for`, dashed: true, ...common },
    { key: `${source}_applied_pwm`, label: source, ...common },
  ];
});
const apart = (column) => [{ key: `mismatch_${column}`, label: "rig − twin", colour: "mismatch", source: "mismatch" }];
const plots = [
  new Plot({ title: "Cart position", unit: "m", digits: 3, narrowest: 0.02, series: both("cart_m") }),
  new Plot({ title: "Mismatch of the cart", unit: "mm", scale: 1000, digits: 1, narrowest: 1, series: apart("cart_m") }),
  new Plot({ title: "Pole angle", unit: "°", scale: DEGREES, digits: 1, narrowest: 2, degrees: true,
    series: both("pole_rad") }),
  new Plot({ title: "Mismatch of the pole", unit: "°", scale: DEGREES, digits: 2, narrowest: 0.2, degrees: true,
    jump: Math.PI, series: apart("pole_rad") }),
  new Plot({ title: "Command applied", unit: "", digits: 2, narrowest: 0.1, series: commands }),
];
by("plots").prepend(...plots.map((plot) => plot.element));
const [, , , poleMismatch] = plots;
const also = made("span", { data: { value: "mismatch.also" } });
poleMismatch.series[0].item.append(also);

let frame = null, asked = false;
const timeline = new Timeline(soon);

function draw() {
  asked = false;
  if (!frame) return;
  const there = ["rig", "twin"].filter((key) => frame[key]);
  if (there.length === 2) there.push("mismatch");
  for (const panel of panels) panel.draw(frame);
  const { points, back_s, end_s } = timeline.stretch();
  for (const plot of plots) {
    plot.show(there);
    plot.draw(points, frame.history_s, end_s, back_s);
  }
  by("plots").toggleAttribute("data-single", there.length < 3);
  say(also, alsoOf(frame.mismatch));
}

function alsoOf(mismatch) {
  if (!mismatch || mismatch.pole_rad === null) return "";
  const turns = mismatch.turns ? ` and ${signed(mismatch.turns, 0)} turns` : "";
  return `(${signed(mismatch.pole_rad, 1, 1000)} mrad${turns})`;
}

function soon() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(draw);
}

function warn() {
  for (const key of ["rig", "twin"]) {
    const source = frame[key];
    banners.set(key, source?.state === "stale" ? "warn" : "info", source?.notice);
  }
  warnOfStop(frame.rig ? frame.rig.stopped : null);
  for (const element of document.querySelectorAll("[data-button]")) {
    const owner = { reset_twin: "twin", play: "plan", abort: "plan", record: "", end_recording: "" }[element.dataset.button] ?? "rig";
    if (!owner) continue; // those of recordings are drawn with them
    element.hidden = owner === "plan" ? !frame.plan.offered : !frame[owner];
    if (owner === "plan") setIdle(element, frame.plan.playing === (element.dataset.button === "play"));
  }
  by("plan").hidden = !frame.plan.offered || !frame.plan.outcome;
  say(by("plan"), `Plan ${frame.plan.outcome}${frame.plan.playing ? `, ${(100 * frame.plan.share).toFixed(0)} % played` : ""}`);
  setIdle(by("clear-stop"), frame.rig?.stopped === false); // nothing is latched
}

function warnOfStop(stopped) {
  const latch = by("latch");
  latch.dataset.latch = stopped === null ? "unknown" : stopped ? "latched" : "clear";
  say(latch, stopped === null ? "stop state unknown" : stopped ? "stop latched" : "stop not latched");
  banners.set("stop", "error", stopped ? "The stop is latched: the rig takes no command until it is cleared." : null);
}

const stopOverLink = follow((latest, first) => {
  timeline.keep(latest, first);
  frame = latest;
  warn();
  nodes.draw(frame.nodes);
  recordings.draw(frame.recordings);
  soon();
}, (state) => {
  document.body.dataset.link = state;
  say(by("link"), state === "open" ? "connected" : "connection lost");
  const lost = "Connection lost: nothing here is live, and Stop may not get through. Trying again.";
  banners.set("link", "error", state === "lost" ? lost : null);
  if (state !== "lost") return;
  for (const key of ["rig", "twin"]) banners.set(key, "info", null);
  warnOfStop(null);
});

// The answer to a button; success is null while it is awaited.
function tell({ name, success, sentence }) {
  const answer = by("answer");
  if (success === null) delete answer.dataset.success;
  else answer.dataset.success = String(success);
  say(answer, `${name}: ${sentence}`);
}

control(({ button, name, success, sentence }) => {
  tell({ name, success, sentence });
  if (button !== "stop" || success === null) return;
  banners.set("unstopped", "error", success ? null : `Stop did not get through: ${sentence}. Use the switch of the rig.`);
}, stopOverLink);

new ResizeObserver(soon).observe(document.body);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", soon);
setInterval(() => {
  if (!frame) return;
  for (const panel of panels) panel.describe(frame);
  for (const plot of plots) plot.describe();
}, 1000);
