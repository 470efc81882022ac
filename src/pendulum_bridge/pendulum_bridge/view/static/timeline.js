// The plots' time: live, or frozen and scrolled back; what is shown can be downloaded as CSV.

import { say, tick } from "./words.js";

const by = (id) => document.getElementById(id);

export class Timeline {
  // shown(): called when another stretch is to be drawn.
  constructor(shown) {
    Object.assign(this, { shown, points: [], columns: [], now_s: 0, span_s: 15, kept_s: 600, frozen_s: null, asked: false });
    by("freeze").addEventListener("click", () => (this.frozen_s === null ? this.freeze() : this.release()));
    by("live").addEventListener("click", () => this.release());
    by("back").addEventListener("input", () => this.scroll(Number(by("back").value)));
    by("csv").addEventListener("click", () => this.download());
  }

  keep(latest, first) {
    if (first) this.points = [];
    Object.assign(this, { columns: latest.columns, now_s: latest.time_s, span_s: latest.history_s, kept_s: latest.kept_s });
    for (const values of latest.points) this.points.push(this.named(latest.columns, values));
    const oldest = latest.time_s - latest.kept_s;
    let old = 0;
    while (old < this.points.length && this.points[old].time_s < oldest) old += 1;
    if (old > 100) this.points.splice(0, old); // not one by one: the list is long
  }

  named(columns, values) {
    return Object.fromEntries(columns.map((column, k) => [column, values[k]]));
  }

  freeze() {
    this.frozen_s = this.now_s;
    this.fetchEarlier();
    this.tell();
  }

  release() {
    this.frozen_s = null;
    by("back").value = 0;
    this.tell();
  }

  // back_s: from the moment of freezing.
  scroll(back_s) {
    if (this.frozen_s === null) this.freeze();
    this.tell(back_s);
  }

  tell() {
    const frozen = this.frozen_s !== null;
    by("freeze").ariaPressed = String(frozen);
    by("live").hidden = !frozen;
    document.body.dataset.time = frozen ? "frozen" : "live";
    this.shown();
  }

  // Points from before this page was opened are asked for once, when a person looks back.
  async fetchEarlier() {
    if (this.asked) return;
    this.asked = true;
    try {
      const { columns, points } = await (await fetch("/history", { method: "POST" })).json();
      const first_s = this.points[0]?.time_s ?? Infinity;
      const earlier = points.filter(([time_s]) => time_s < first_s).map((values) => this.named(columns, values));
      this.points.unshift(...earlier);
    } catch {
      this.asked = false;
    }
    this.shown();
  }

  // Returns the points to draw, and by how much their end lies back, s.
  stretch() {
    const back = Number(by("back").value), end_s = this.frozen_s === null ? this.now_s : this.frozen_s - back;
    const back_s = this.now_s - end_s;
    say(by("when"), this.frozen_s === null ? "live" : `frozen, ${tick(back_s, 1)} s ago`);
    const begin_s = end_s - this.span_s;
    const points = this.points.slice(this.find(begin_s), this.find(end_s + 1e-6));
    return { points, back_s, end_s };
  }

  // Returns the number of points before a time, s.
  find(time_s) {
    let low = 0, high = this.points.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.points[middle].time_s < time_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  download() {
    const lines = [this.columns, ...this.stretch().points.map((point) => this.columns.map((column) => point[column] ?? ""))];
    const text = `${lines.map((cells) => cells.join(",")).join("\n")}\n`;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
    link.download = "rig_and_twin.csv";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
}
