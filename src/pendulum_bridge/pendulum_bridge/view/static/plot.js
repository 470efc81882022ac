// A plot over the last seconds; its lines break where nothing is known.
// A series is {key, label, source, colour, broad, dashed, stepped}; the rig's lines are broad, so that equal ones both show;
// dashed ones are in the legend once, all together.

import { AutoRange, digitsOf, ticks } from "./axis.js";
import { cleared, line, palette } from "./canvas.js";
import { made, say, signed, tick } from "./words.js";

const LEFT = 50, RIGHT = 12, TOP = 7, BOTTOM = 20;
const GAP_S = 0.25; // points further apart are not joined

export class Plot {
  // scale: from the frame's unit to the plot's. narrowest: least span. jump: values further apart are not joined.
  constructor({ title, unit, scale = 1, digits, narrowest, degrees = false, jump = Infinity, series }) {
    Object.assign(this, { title, unit, scale, digits, jump, series, axis: new AutoRange(narrowest, degrees) });
    this.canvas = made("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `Plot of ${title}`);
    this.legend = made("ul", { className: "legend" });
    for (const each of series) each.output = made("output", { data: { value: each.key } });
    for (const each of series) each.item = each.dashed ? made("li") : made("li", {}, sample(each), each.label, each.output);
    this.legend.append(...series.filter((each) => !each.dashed).map((each) => each.item));
    if (series.some((each) => each.dashed)) {
      this.legend.append(made("li", {}, sample({ colour: "soft", dashed: true }), "asked for"));
    }
    const heading = made("h2", {}, title, made("span", { className: "unit", textContent: unit }), this.legend);
    this.element = made("article", { className: "card plot" }, heading, made("div", { className: "canvas" }, this.canvas));
  }

  show(names) {
    for (const each of this.series) each.item.hidden = each.hidden = !names.includes(each.source);
    this.element.hidden = this.series.every((each) => each.hidden);
  }

  // points: objects with time_s, oldest first. span_s: what the time axis holds, up to end_s; back_s: how long ago that was.
  draw(points, span_s, end_s, back_s) {
    const shown = this.series.filter((each) => !each.hidden);
    const last = points.at(-1);
    for (const each of shown) say(each.output, signed(last?.[each.key], this.digits, this.scale));
    const sheet = this.element.hidden ? null : cleared(this.canvas);
    if (!sheet) return;
    const box = { left: LEFT, right: sheet.width - RIGHT, top: TOP, bottom: sheet.height - BOTTOM };
    const range = this.rangeOf(points, shown, sheet.height);
    const x = (time_s) => box.right + ((time_s - end_s) / span_s) * (box.right - box.left);
    const y = (value) => box.bottom - ((value - range.low) / (range.high - range.low)) * (box.bottom - box.top);
    this.grid(sheet.pen, box, range, x, y, end_s, span_s, back_s);
    sheet.pen.save();
    sheet.pen.beginPath();
    sheet.pen.rect(box.left, box.top - 3, box.right - box.left + RIGHT, box.bottom - box.top + 6);
    sheet.pen.clip();
    for (const each of shown.filter((one) => !one.dashed)) this.trace(sheet.pen, each, points, x, y);
    for (const each of shown.filter((one) => one.dashed)) this.trace(sheet.pen, each, points, x, y);
    sheet.pen.restore();
  }

  rangeOf(points, shown, height) {
    let least = Infinity, most = -Infinity;
    for (const point of points) {
      for (const each of shown) {
        const value = point[each.key];
        if (value === null) continue;
        least = Math.min(least, value * this.scale);
        most = Math.max(most, value * this.scale);
      }
    }
    return this.axis.around(least, most, height < 125 ? 3 : height < 190 ? 4 : 5);
  }

  grid(pen, box, range, x, y, end_s, span_s, ago_s) {
    const colours = palette(), digits = digitsOf(range.step);
    pen.lineWidth = 1;
    pen.fillStyle = colours.soft;
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    for (const value of ticks(range)) {
      const row = Math.round(y(value)) + 0.5;
      pen.strokeStyle = Math.abs(value) < range.step / 1e6 ? colours.axis : colours.hair;
      line(pen, box.left, row, box.right, row);
      pen.fillText(tick(value, digits), box.left - 8, row);
    }
    pen.textBaseline = "top";
    pen.strokeStyle = colours.hair;
    for (let back_s = 0; back_s <= span_s + 1e-6; back_s += 5) {
      const column = Math.round(x(end_s - back_s)) + 0.5;
      line(pen, column, box.top, column, box.bottom);
      pen.textAlign = back_s ? "center" : "right";
      pen.fillText(ago_s < 0.05 && !back_s ? "now" : `−${tick(back_s + ago_s, ago_s < 0.05 ? 0 : 1)} s`, back_s ? column : box.right + 2, box.bottom + 6);
    }
  }

  trace(pen, series, points, x, y) {
    pen.strokeStyle = pen.fillStyle = palette()[series.colour];
    pen.lineWidth = series.dashed ? 1.25 : series.broad ? 2.75 : 1.5;
    pen.setLineDash(series.dashed ? [4, 4] : []);
    pen.beginPath();
    let before = null;
    for (const point of points) {
      const value = point[series.key];
      if (value === null) { before = null; continue; }
      const at = { time_s: point.time_s, column: x(point.time_s), row: y(value * this.scale), value };
      const joined = before && at.time_s - before.time_s < GAP_S && Math.abs(value - before.value) < this.jump;
      if (!joined) pen.moveTo(at.column, at.row);
      else if (series.stepped) { pen.lineTo(at.column, before.row); pen.lineTo(at.column, at.row); }
      else pen.lineTo(at.column, at.row);
      before = at;
    }
    pen.stroke();
    pen.setLineDash([]);
    if (!before || series.dashed || before.time_s !== points.at(-1).time_s) return;
    pen.beginPath();
    pen.arc(before.column, before.row, 3, 0, 2 * Math.PI);
    pen.fill();
  }

  describe() {
    const shown = this.series.filter((each) => !each.hidden);
    const values = shown.map((each) => `${each.label} ${each.output.textContent}`).join(", ");
    this.canvas.setAttribute("aria-label", `Plot of ${this.title}${this.unit && ` in ${this.unit}`}: ${values}`);
  }
}

// A short line as the plot draws it, for the legend.
function sample({ colour, dashed, broad }) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 22 8");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS(svg.namespaceURI, "path");
  path.setAttribute("d", "M1 4H21");
  path.style.stroke = `var(--${colour})`;
  path.style.strokeWidth = dashed ? "1.5" : broad ? "3.5" : "2";
  if (dashed) path.style.strokeDasharray = "4 3";
  svg.append(path);
  return svg;
}
