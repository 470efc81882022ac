// Ranges and ticks of an axis: round numbers, and no twitching while the data move.

const DECIMAL = [1, 2, 5];
const TURNS = [15, 30, 45, 90, 180, 360, 720, 1440]; // degrees: from 15 on by these, below by decimals

export function roundStep(least, degrees) {
  if (degrees && least > 10) return TURNS.find((step) => step >= least) ?? 1440 * Math.ceil(least / 1440);
  const power = 10 ** Math.floor(Math.log10(least));
  return power * (DECIMAL.find((step) => step * power >= least * 0.999) ?? 10);
}

export function digitsOf(step) {
  return Math.max(0, Math.min(6, Math.ceil(-Math.log10(step) - 1e-9)));
}

export function ticks(range) {
  const count = Math.round((range.high - range.low) / range.step);
  return Array.from({ length: Math.min(count, 50) + 1 }, (_, k) => range.low + k * range.step);
}

export class AutoRange {
  // narrowest: the least span; parts: about how many steps are wanted.
  constructor(narrowest, degrees = false) {
    Object.assign(this, { narrowest, degrees, range: null });
  }

  // Returns {low, high, step} that holds the data. It widens at once, and narrows when half of it is empty.
  around(least, most, parts) {
    if (least > most) [least, most] = [0, 0];
    const fitting = this.fitting(least, most, parts);
    const now = this.range;
    const holds = now && now.parts === parts && now.low <= least && now.high >= most;
    if (!holds || fitting.high - fitting.low < 0.6 * (now.high - now.low)) this.range = { ...fitting, parts };
    return this.range;
  }

  fitting(least, most, parts) {
    const middle = (least + most) / 2;
    const half = Math.max(0.54 * (most - least), this.narrowest / 2, Math.abs(middle) * 1e-9);
    const step = roundStep((2 * half) / parts, this.degrees);
    return { low: Math.floor((middle - half) / step) * step, high: Math.ceil((middle + half) / step) * step, step };
  }
}
