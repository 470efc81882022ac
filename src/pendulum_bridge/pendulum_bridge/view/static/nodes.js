// The health of the nodes: a level, a sentence, and the figures behind it for who asks.

import { made, say } from "./words.js";

const WORDS = { ok: "ok", warn: "warn", error: "error", stale: "silent" };

export class Nodes {
  constructor(element) {
    this.list = element.querySelector("ul");
    this.rows = new Map();
  }

  draw(nodes) {
    for (const [name, row] of this.rows) {
      if (nodes.some((node) => node.name === name)) continue;
      row.item.remove();
      this.rows.delete(name);
    }
    nodes.forEach((node, k) => {
      const row = this.rows.get(node.name) ?? this.added(node.name);
      if (this.list.children[k] !== row.item) this.list.insertBefore(row.item, this.list.children[k] ?? null);
      row.item.dataset.level = node.level;
      say(row.level, WORDS[node.level]);
      say(row.sentence, node.sentence);
      this.figures(row, node.figures);
    });
  }

  added(name) {
    const level = made("span", { className: "level" }), sentence = made("span", { className: "sentence" });
    const dot = made("span", { className: "dot" }), title = made("span", { className: "name", textContent: name });
    const summary = made("summary", {}, dot, level, title, sentence);
    const table = made("table");
    const item = made("li", { data: { node: name } }, made("details", {}, summary, table));
    const row = { item, level, sentence, table, cells: new Map() };
    this.rows.set(name, row);
    return row;
  }

  figures(row, figures) {
    for (const [key, cell] of row.cells) {
      if (key in figures) continue;
      cell.parentElement.remove();
      row.cells.delete(key);
    }
    for (const [key, value] of Object.entries(figures)) {
      if (!row.cells.has(key)) {
        const cell = made("td");
        row.table.append(made("tr", {}, made("td", { textContent: key }), cell));
        row.cells.set(key, cell);
      }
      say(row.cells.get(key), value);
    }
  }
}
