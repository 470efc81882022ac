// Frames from the server: each is asked for by the number of the last, so that a slow page never works off a queue.

const SILENT_AFTER_MS = 1500;
const AGAIN_AFTER_MS = 700;

// frame(object): a new frame; state("open" | "lost"): how the link is. Returns stop(): stops the rig over the open
// connection, which needs no new one, and resolves to the answer; rejects when the connection is lost or silent.
export function follow(frame, state) {
  let socket = null, heard = 0, number = -1, awaited = [];

  function connect() {
    number = -1;
    heard = performance.now();
    const mine = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
    socket = mine;
    mine.onopen = () => mine.send("-1");
    mine.onmessage = (message) => {
      if (socket !== mine) return;
      const latest = JSON.parse(message.data);
      if (latest.answer) {
        awaited.shift()?.resolve(latest.answer);
        return;
      }
      const first = number < 0;
      number = latest.number;
      heard = performance.now();
      mine.send(String(number));
      state("open");
      frame(latest, first);
    };
    mine.onclose = () => lost(mine);
  }

  function lost(mine) {
    if (socket !== mine) return;
    socket = null;
    mine.close();
    for (const { reject } of awaited.splice(0)) reject(new Error("connection lost"));
    state("lost");
    setTimeout(connect, AGAIN_AFTER_MS);
  }

  connect();
  setInterval(() => {
    if (socket && performance.now() - heard > SILENT_AFTER_MS) lost(socket);
  }, 250);

  return function stop() {
    return new Promise((resolve, reject) => {
      if (socket?.readyState !== WebSocket.OPEN) return reject(new Error("no connection"));
      awaited.push({ resolve, reject });
      socket.send("stop");
    });
  };
}
