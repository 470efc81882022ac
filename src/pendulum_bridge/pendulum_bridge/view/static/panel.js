// The card of rig or twin: drawing, caption and numbers.

import { drawStage } from "./stage.js";
import { DEGREES, age, made, say, signed } from "./words.js";

const ROWS = [ // key, label, and the value in one or two units
  ["cart_m", "Cart", [[1, 4, "m"]]],
  ["pole_rad", "Pole", [[DEGREES, 1, "°"], [1, 3, "rad"]]],
  ["cart_m_s", "Cart velocity", [[1, 3, "m/s"]]],
  ["pole_rad_s", "Pole velocity", [[DEGREES, 1, "°/s"], [1, 2, "rad/s"]]],
  ["pwm", "Command asked for", [[1, 3, ""]]],
  ["applied_pwm", "Command applied", [[1, 3, ""]]],
];

export class Panel {
  constructor(element, other, caption) {
    Object.assign(this, { element, key: element.dataset.source, other, caption });
    this.canvas = element.querySelector("canvas");
    this.texts = Object.fromEntries([...element.querySelectorAll("[data-text]")].map((one) => [one.dataset.text, one]));
    const list = element.querySelector("dl");
    this.cells = ROWS.map(([key, label, units]) =>
      this.row(list, `${this.key}.${key}`, label, units.map(([, , unit]) => unit)));
    [this.age] = this.row(list, `${this.key}.stamp_age_s`, "Age of stamp", [""]);
    [this.refused] = this.row(list, `${this.key}.refused`, "Refused samples", [""]);
  }

  row(list, name, label, units) {
    const cells = units.map((unit, k) => {
      const value = made("span", { data: { value: k ? `${name}.${unit}` : name } });
      const small = unit ? [made("small", { textContent: unit })] : [];
      return { value, cell: made("dd", { className: k ? "also" : "" }, value, ...small) };
    });
    list.append(made("div", {}, made("dt", { textContent: label }), ...cells.map(({ cell }) => cell)));
    return cells.map(({ value }) => value);
  }

  draw(frame) {
    const source = frame[this.key], ghost = this.other && frame[this.other];
    this.element.hidden = !source;
    if (!source) return;
    this.element.dataset.state = source.state;
    say(this.texts.namespace, source.namespace);
    say(this.texts.pulse, { fresh: source.rate_hz ? `live, ${source.rate_hz.toFixed(0)} Hz` : "live",
      stale: `silent for ${age(source.silent_s)}`, never: "nothing heard yet" }[source.state]);
    const beyond = Math.abs(source.cart_m) > frame.rail_half_length_m ? "the cart is beyond the end of the rail" : "";
    say(this.texts.veil, { fresh: beyond, stale: "last sample, not live", never: "no sample yet" }[source.state]);
    const outlined = ghost?.state === "fresh" ? ghost : null;
    say(this.texts.caption, `arrow: command applied${outlined ? this.caption : ""}`);
    const drawn = source.state === "never" ? null : source;
    drawStage(this.canvas, frame.rail_half_length_m, drawn, this.key, outlined, this.other);
    ROWS.forEach(([key, , units], k) => units.forEach(([scale, digits], n) =>
      say(this.cells[k][n], signed(source[key], digits, scale))));
    say(this.age, age(source.stamp_age_s));
    say(this.refused, String(source.refused));
  }

  describe(frame) {
    const source = frame[this.key];
    if (!source) return;
    const cart = signed(source.cart_m, 3), pole = signed(source.pole_rad, 0, DEGREES);
    this.canvas.setAttribute("aria-label", `${this.key}: cart at ${cart} m, pole at ${pole} degrees from upright`);
  }
}
