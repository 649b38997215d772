// The page's line to its server: what the rig does, and the few words that a page may say.

/** What the document says of its server; an offline page has none. */
export interface Server {
  socket: string;
}

export interface RigState {
  kind: "state";
  state: "idle" | "running" | "ending";
  command: string | null;
  /** How it goes, or how it ended. */
  sentence: string;
  code: number | null;
  /** What a person has to confirm before anything moves; null: nothing. */
  request: string | null;
  /** Number of the question that waits while a command runs; its answer names it. */
  question: number;
  /** Which recording is followed, or how it ended. */
  following: string;
  /** What may be started; none without a rig. */
  commands: string[];
}

/** Newest last; time is the rig's, from the beginning of the recording. */
export interface RigSamples {
  kind: "samples";
  time_s: number[];
  opening_rad: number[];
  advance_m: number[];
  torque_Nm: number[];
  force_N: number[];
  /** Samples that were left out before these, because the page or the disk was too slow. */
  lost: number;
  /** Of a tracked plate: quaternion (w, x, y, z), then its place (m). */
  pose: number[] | null;
  recording: string;
}

export interface Handlers {
  /** Of a line that is broken the sentence says why, and what to do. */
  connected(isConnected: boolean, sentence: string): void;
  state(state: RigState): void;
  samples(samples: RigSamples): void;
  refused(sentence: string): void;
}

export interface Line {
  /** Ask what has to be confirmed before a command is started. */
  arm(command: string): void;
  /** Start what was armed; or confirm what a running command asks for. */
  start(command: string, question: number): void;
  stop(): void;
  close(): void;
}

const SOONEST_ms = 300;
const LATEST_ms = 5000;
const GIVES_UP_ms = 10_000; // without an answer: a computer that wakes up has its network back by then
const GOES_AWAY = 1001; // code with which an ending server closes its sockets
const [FORBIDDEN, UNAVAILABLE] = [403, 503];
const AGAIN = "The server cannot be reached; trying again.";
const FULL = "The server shows as many pages as it can: close another one.";
const GONE = "The server of this page has ended, and no other one takes its place: start scissorcal prototype again and open the address "
  + "that it prints. The package on this page can be used as before.";
const COLUMNS = ["time_s", "opening_rad", "advance_m", "torque_Nm", "force_N"] as const;
const MOST_ROWS = 1000; // of a message; the server sends 250 at most

/**
 * Opens the line and keeps it: where it breaks it is opened again, later and later, as long as that
 * can succeed. A server has its own token, so once it has ended, each other one refuses this page.
 */
export function connect(server: Server, handlers: Handlers): Line {
  let socket: WebSocket | null = null;
  let wait = SOONEST_ms;
  let timer = 0;
  let isOver = false;
  let lostAt: number | null = null;

  function open(): void {
    const own = new WebSocket(`ws://${location.host}${server.socket}`);
    socket = own;
    own.onopen = () => {
      wait = SOONEST_ms;
      lostAt = null;
      handlers.connected(true, "");
    };
    own.onmessage = (event) => hear(event.data, handlers);
    own.onclose = (event) => {
      if (socket !== own) return;
      socket = null;
      lostAt ??= Date.now();
      if (event.code === GOES_AWAY) handlers.connected(false, GONE);
      else void again();
    };
  }

  /** Open the line again, if that can succeed: a socket does not say why it was refused. */
  async function again(): Promise<void> {
    if (isOver) return;
    handlers.connected(false, AGAIN);
    const status = await fetch(server.socket).then((answer) => answer.status, () => null);
    const isGone = status === FORBIDDEN || (status === null && Date.now() - (lostAt ?? 0) > GIVES_UP_ms);
    if (isOver) return;
    if (isGone) return handlers.connected(false, GONE);
    if (status === UNAVAILABLE) handlers.connected(false, FULL);
    timer = window.setTimeout(open, wait);
    wait = Math.min(2 * wait, LATEST_ms);
  }

  function say(message: { do: string; command?: string; question?: number }): void {
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
    else handlers.refused("Nothing was sent: the server cannot be reached.");
  }

  open();
  return {
    arm: (command) => say({ do: "arm", command }),
    start: (command, question) => say({ do: "start", command, question }),
    stop: () => say({ do: "stop" }),
    close: () => {
      isOver = true;
      window.clearTimeout(timer);
      socket?.close();
    },
  };
}

function hear(text: unknown, handlers: Handlers): void {
  if (typeof text !== "string") return;
  const message = JSON.parse(text) as RigState | RigSamples | { kind: "refused"; sentence: string };
  if (message.kind === "state") handlers.state(message);
  else if (message.kind === "refused") handlers.refused(message.sentence);
  else if (message.kind === "samples" && isWhole(message)) handlers.samples(message);
}

function isWhole(samples: RigSamples): boolean {
  const count = samples.time_s.length;
  return count <= MOST_ROWS && COLUMNS.every((name) => samples[name].length === count);
}

/** The last seconds of a rig: columns that never grow beyond what is kept. */
export class Recent {
  readonly columns: Record<(typeof COLUMNS)[number], number[]> = {
    time_s: [], opening_rad: [], advance_m: [], torque_Nm: [], force_N: [],
  };
  recording = "";
  lost = 0;

  constructor(readonly kept_s = 10) {}

  get newestTorque(): number | undefined {
    return this.columns.torque_Nm.at(-1);
  }

  /** Add samples; another recording, or a clock that went back, begins anew. */
  add(samples: RigSamples): void {
    const { time_s } = this.columns;
    const isNew = samples.recording !== this.recording
      || (samples.time_s.length > 0 && samples.time_s[0] < (time_s[time_s.length - 1] ?? 0));
    if (isNew) for (const name of COLUMNS) this.columns[name].length = 0;
    if (isNew) this.lost = 0;
    this.recording = samples.recording;
    this.lost += samples.lost;
    for (const name of COLUMNS) this.columns[name].push(...samples[name]);
    const newest = time_s[time_s.length - 1] ?? 0;
    const old = time_s.findIndex((time) => time >= newest - this.kept_s);
    if (old > 0) for (const name of COLUMNS) this.columns[name].splice(0, old);
  }
}
