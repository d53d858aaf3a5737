// The connection with the run: the token first, then commands as text; frames, answers and the graph come back. It is opened before
// the page's other code is there, which takes what has come until then.

class Session {
  constructor() {
    this.waiting = [];
    const token = location.hash.slice(1);
    this.socket = new WebSocket(`ws://${location.host}/live`);
    this.socket.binaryType = "arraybuffer";
    this.socket.addEventListener("open", () => this.socket.send(JSON.stringify({ token })));
    this.socket.addEventListener("close", ({ reason }) => {
      const whole = "open the whole address that the command printed, with all that follows #";
      this.hear(() => this.listeners.closed(token === "" ? whole : reason || "the connection is closed"));
    });
    this.socket.addEventListener("message", ({ data }) => this.hear(() => this.take(data)));
  }

  // Begins to tell listeners what comes.
  listen(listeners) {
    this.listeners = listeners;
    this.waiting.forEach((tell) => tell());
    this.waiting = null;
  }

  hear(tell) {
    if (this.waiting) this.waiting.push(tell);
    else tell();
  }

  take(data) {
    if (typeof data !== "string") {
      this.listeners.frame(readFrame(data));
      return;
    }
    const answer = JSON.parse(data);
    const [kind] = Object.keys(answer);
    this.listeners[kind]?.(answer[kind], answer);
  }

  // Sends a command such as `step` with its settings.
  send(name, settings = {}) {
    this.listeners.sent();
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ [name]: settings }));
  }
}

export const session = new Session();
