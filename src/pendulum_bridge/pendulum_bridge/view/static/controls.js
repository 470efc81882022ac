// The buttons, and Space or Escape for stop wherever the focus is; Enter presses the other buttons.

const LONGEST_MS = { stop: 4000, clear_stop: 4000, reset: 65000, reset_twin: 65000, play: 4000, abort: 4000,
  record: 4000, end_recording: 4000 };
const NAMES = { stop: "Stop", clear_stop: "Clear stop", reset: "Reset rig", reset_twin: "Reset twin",
  play: "Play plan", abort: "Abort plan", record: "Record", end_recording: "End recording" };

// said({button, name, success, sentence}); success is null while the answer is awaited.
// stopOverLink(): the stop once more, over the page's open connection, beside a request of its own.
export function control(said, stopOverLink) {
  const buttons = [...document.querySelectorAll("[data-button]")];

  async function press(element) {
    const button = element.dataset.button, name = NAMES[button];
    if (element.ariaDisabled === "true") return;
    if (button !== "stop") element.ariaDisabled = "true"; // a disabled one would lose the focus
    said({ button, name, success: null, sentence: "asked" });
    const request = ask(button, LONGEST_MS[button]);
    const answer = button !== "stop" ? await request
      : await Promise.any([request, stopOverLink()].map(demandSuccess)).catch(() => request);
    element.ariaDisabled = element.dataset.idle === "true" ? "true" : null;
    said({ button, name, ...answer });
  }

  for (const element of buttons) element.addEventListener("click", () => press(element));
  const stop = buttons.find((element) => element.dataset.button === "stop");
  const isStop = (event) => event.code === "Space" || event.key === "Escape";
  window.addEventListener("keydown", (event) => {
    if (!isStop(event)) return;
    event.preventDefault();
    event.stopPropagation();
    if (!event.repeat) press(stop);
  }, true);
  window.addEventListener("keyup", (event) => { if (isStop(event)) event.preventDefault(); }, true);
}

// A button that has nothing to do is greyed and keeps the focus; one whose answer is awaited is left alone.
export function setIdle(element, idle) {
  if ((element.dataset.idle === "true") === idle) return;
  element.dataset.idle = String(idle);
  element.ariaDisabled = idle ? "true" : null;
}

async function demandSuccess(asked) {
  const answer = await asked;
  if (!answer.success) throw new Error(answer.sentence);
  return answer;
}

// Resolves to {success, sentence}, whatever happens.
export async function ask(path, longest_ms = 4000) {
  try {
    const response = await fetch(`/${path}`, { method: "POST", signal: AbortSignal.timeout(longest_ms) });
    return await response.json();
  } catch (error) {
    const late = error.name === "TimeoutError";
    return { success: false, sentence: late ? "view_node gave no answer in time" : "view_node cannot be reached" };
  }
}
