// The connection to the studio that served the page.

const WAITS = [0.3, 0.6, 1.2, 2.5, 5]; // seconds between attempts to reconnect

export class Link {
  // `heard` receives each message, `changed` whether the studio is connected, `failed` internal errors.
  constructor(heard, changed, failed) {
    Object.assign(this, { heard, changed, failed, tries: 0, turn: Promise.resolve() });
    this.connect();
  }

  connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/socket`);
    this.socket.addEventListener("open", () => {
      this.tries = 0;
      this.changed(true);
    });
    this.socket.addEventListener("message", (event) => {
      const message = JSON.parse(event.data);
      this.turn = this.turn.then(() => this.heard(message)).catch((error) => this.failed(error)); // in turn
    });
    this.socket.addEventListener("close", () => {
      this.changed(false);
      const wait = WAITS[Math.min(this.tries++, WAITS.length - 1)];
      setTimeout(() => this.connect(), 1000 * wait);
    });
  }

  ask(wish) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(wish));
  }
}
