// Numbers as people read them: a fixed count of digits, a real minus sign, a dash for what is not known.

export const DEGREES = 180 / Math.PI;

export function signed(value, digits, unit = 1) {
  if (value === null || value === undefined) return "–";
  const scaled = value * unit;
  if (Math.abs(scaled) >= 1e6) return scaled.toExponential(2).replace("-", "−").replace("e+", "e");
  const text = Math.abs(scaled).toFixed(digits);
  return (Number(text) === 0 ? "" : scaled < 0 ? "−" : "+") + text;
}

export function tick(value, digits) {
  return (Math.abs(value) < 1e-12 ? 0 : value).toFixed(digits).replace("-", "−");
}

export function age(seconds) {
  if (seconds === null || seconds === undefined) return "–";
  if (Math.abs(seconds) < 0.9995) return `${tick(seconds * 1000, 0)} ms`;
  return `${tick(seconds, Math.abs(seconds) < 100 ? 1 : 0)} s`;
}

// Sets a text only when it is another one, so that nothing is laid out or read aloud again.
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function made(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "data") Object.assign(element.dataset, value);
    else element[name] = value;
  }
  element.append(...children);
  return element;
}
