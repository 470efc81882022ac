// Canvases that keep their sharpness at any size, and the colours of the style sheet.

const FONT = '11px "Inter", -apple-system, "Segoe UI", "Noto Sans", "Liberation Sans", Arial, sans-serif';
const NAMES = ["card", "well", "edge", "hair", "axis", "ink", "soft", "rig", "twin", "mismatch", "rail", "rail-edge"];

let colours = null;
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { colours = null; });

export function palette() {
  if (!colours) {
    const style = getComputedStyle(document.documentElement);
    colours = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }
  return colours;
}

// Returns a cleared context whose unit is one CSS pixel, with its width and height; null for a canvas that is not shown.
export function cleared(canvas) {
  const width = canvas.clientWidth, height = canvas.clientHeight, ratio = window.devicePixelRatio || 1;
  if (!width || !height) return null;
  const columns = Math.round(width * ratio), rows = Math.round(height * ratio);
  if (canvas.width !== columns || canvas.height !== rows) Object.assign(canvas, { width: columns, height: rows });
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = FONT;
  pen.lineJoin = pen.lineCap = "round";
  return { pen, width, height };
}

export function line(pen, x1, y1, x2, y2) {
  pen.beginPath();
  pen.moveTo(x1, y1);
  pen.lineTo(x2, y2);
  pen.stroke();
}
