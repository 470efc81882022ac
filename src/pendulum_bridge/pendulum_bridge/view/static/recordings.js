// Recordings made from this page, a row each: how far they are, then the verdict with its report.

import { age, made, say } from "./words.js";
import { ask, setIdle } from "./controls.js";

const WORDS = {
  starting: "starting", recording: "recording", closing: "closing", waiting: "waits for an earlier diagnosis",
  diagnosing: "diagnosing", done: "verdict", kept: "kept", given_up: "given up", failed: "failed",
};
const GIVE_UP = "Give up";
const LINKS = { "report.html": "Report", "twin.yaml": "Improved twin", "next.yaml": "Next experiment", "verdict.json": "verdict.json" };

export class Recordings {
  // said({name, success, sentence}): the answer to a row's button; success is null while it is awaited.
  constructor(element, said) {
    this.element = element;
    this.said = said;
    this.list = element.querySelector("ul");
    this.status = element.querySelector("[role=status]");
    this.record = document.querySelector("[data-button=record]");
    this.end = document.querySelector("[data-button=end_recording]");
    this.rows = new Map();
    this.stages = new Map();
  }

  // recordings: of a frame, the newest first; null where this page makes none.
  draw(recordings) {
    this.record.hidden = this.end.hidden = !recordings;
    this.element.hidden = !recordings?.length;
    const all = recordings ?? [];
    const underWay = all.some(({ stage }) => stage === "starting" || stage === "recording" || stage === "closing");
    setIdle(this.record, underWay);
    setIdle(this.end, !underWay);
    for (const [name, row] of this.rows) {
      if (all.some((each) => each.name === name)) continue;
      row.item.remove();
      this.rows.delete(name);
    }
    all.forEach((recording, k) => {
      const row = this.rows.get(recording.name) ?? this.added(recording.name);
      if (this.list.children[k] !== row.item) this.list.insertBefore(row.item, this.list.children[k] ?? null);
      this.fill(row, recording);
    });
  }

  added(name) {
    const title = made("span", { className: "name", textContent: name }), stage = made("span", { className: "level" });
    const bar = made("progress", { max: 1, hidden: true, ariaLabel: `Diagnosis of ${name}` });
    const sentence = made("p", { className: "sentence" }), links = made("p", { className: "links" });
    const giveUp = made("button", { type: "button", textContent: GIVE_UP, hidden: true, ariaLabel: `${GIVE_UP} the diagnosis of ${name}` });
    const progress = made("div", { className: "progress" }, bar, giveUp);
    const item = made("li", { tabIndex: -1, data: { recording: name } }, made("div", { className: "head" }, title, stage),
      progress, sentence, links);
    const row = { item, stage, bar, giveUp, sentence, links };
    giveUp.addEventListener("click", () => this.giveUp(row, name));
    this.rows.set(name, row);
    return row;
  }

  async giveUp({ giveUp }, name) {
    if (giveUp.ariaDisabled === "true") return;
    giveUp.ariaDisabled = "true";
    this.said({ name: GIVE_UP, success: null, sentence: "asked" });
    this.said({ name: GIVE_UP, ...await ask(`recordings/${encodeURIComponent(name)}/give_up`) });
    giveUp.ariaDisabled = null;
  }

  fill(row, { name, stage, seconds, sentence, share, outcome, files }) {
    row.item.dataset.stage = stage;
    row.item.dataset.outcome = outcome;
    const word = stage === "done" ? `${WORDS.done}: ${outcome.replaceAll("_", " ")}` : WORDS[stage];
    say(row.stage, stage === "recording" ? `${word}, ${age(seconds)}` : word);
    say(row.sentence, sentence);
    row.bar.hidden = stage !== "diagnosing";
    row.bar.value = share;
    const idle = stage !== "diagnosing" && stage !== "waiting";
    if (idle && document.activeElement === row.giveUp) row.item.focus(); // a hidden button would lose the focus
    row.giveUp.hidden = idle;
    if (row.links.childElementCount !== files.length) row.links.replaceChildren(...files.map((file) => link(name, file)));
    if (this.stages.get(name) === stage) return;
    this.stages.set(name, stage); // read aloud once a stage, not once a line of progress
    say(this.status, `${name}: ${word}${stage === "done" || stage === "failed" || stage === "given_up" ? `. ${sentence}` : ""}`);
  }
}

// A report is a tab of its own, so that no work of it can hold up this page and its stop.
function link(name, file) {
  return made("a", { href: `/recordings/${name}/${file}`, target: "_blank", rel: "noopener", textContent: LINKS[file] ?? file });
}
