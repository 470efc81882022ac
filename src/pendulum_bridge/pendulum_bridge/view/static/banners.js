// What a person must not miss, one line each, by key; a line that stays the same is left alone.

import { made, say } from "./words.js";

export class Banners {
  constructor(element) {
    this.element = element;
    this.shown = new Map();
  }

  // tone: info, warn or error; text null takes the line away.
  set(key, tone, text) {
    const before = this.shown.get(key);
    if (!text) {
      before?.remove();
      this.shown.delete(key);
      return;
    }
    const banner = before ?? made("p", { className: "banner", data: { banner: key } });
    banner.dataset.tone = tone;
    say(banner, text);
    if (before) return;
    this.shown.set(key, banner);
    this.element.append(banner);
  }
}
