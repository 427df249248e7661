// @ts-check
/** @import {Message} from "./messages.js" */

const AGAIN_MS = 1000;
const REFUSED = 1008;

/** A WebSocket to one game that comes back when it is lost. */
export class Connection {
  /**
   * @param {string} game name of the game, "new" for a new one
   * @param {string} token of the server, "" for none
   * @param {URLSearchParams} begin how a new game begins
   * @param {(message: Message) => void} heard
   * @param {(there: boolean) => void} changed called when the connection is there, and when it is lost
   */
  constructor(game, token, begin, heard, changed) {
    this.game = game;
    this.begin = begin;
    this.token = token;
    this.heard = heard;
    this.changed = changed;
    this.open();
  }

  open() {
    const url = new URL(`games/${encodeURIComponent(this.game)}`, location.href);
    url.protocol = url.protocol.replace("http", "ws");
    url.hash = "";
    const query = new URLSearchParams(this.begin);
    if (this.token) query.set("token", this.token);
    url.search = String(query);
    this.socket = new WebSocket(url);
    this.socket.onopen = () => this.changed(true);
    this.socket.onmessage = (event) => {
      const message = /** @type {Message} */ (JSON.parse(event.data));
      if (message.kind === "hello") this.game = message.game;
      this.heard(message);
    };
    this.socket.onclose = ({ code, reason }) => {
      if (code === REFUSED) this.begin = new URLSearchParams();
      if (reason) this.heard({ kind: "refused", reason });
      this.changed(false);
      setTimeout(() => this.open(), AGAIN_MS);
    };
  }

  /** @param {object} message */
  tell(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
}
