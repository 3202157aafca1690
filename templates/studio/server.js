// The server: questions to it, what its answers say, and whether it is still there.

const ALIVE = 2000, SILENT = 5000, RETRY = 3000; // milliseconds: between looks while an answer is due, until it counts as gone, between looks for its return
const pause = time => new Promise(done => { setTimeout(done, time); });
const isAlive = () => fetch("alive", { signal: AbortSignal.timeout(SILENT) }).then(() => true, () => false);

/** Asks the server. lost: called when it does not answer, back: when it does again. */
export class Server {
  constructor({ lost, back }) { Object.assign(this, { lost, back, due: 0, watched: false, gone: false }); }
  /** The answer, once `read` is through with it. A server that hangs is noticed while an answer is due. */
  async ask(path, options, read = response => response) {
    this.due += 1; this.watch();
    try { return await read(await fetch(path, options)); } catch (error) {
      if (error.name !== "AbortError") this.miss();
      throw error;
    } finally { this.due -= 1; }
  }
  async watch() {
    if (this.watched) return;
    this.watched = true;
    while (this.due && !this.gone) { await pause(ALIVE); if (this.due && !await isAlive()) this.miss(); }
    this.watched = false;
  }
  async miss() {
    this.lost();
    if (this.gone) return;
    this.gone = true;
    do await pause(RETRY); while (!await isAlive());
    this.gone = false; this.back();
  }
}

/** The lines of an answer as objects, while they arrive. */
export async function* lined(response) {
  let rest = "";
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader(); // Safari has no loop over streams
  for (let { done, value } = await reader.read(); !done; { done, value } = await reader.read()) {
    const parts = (rest + value).split("\n");
    rest = parts.pop();
    for (const part of parts) yield JSON.parse(part);
  }
}

/** A message as a sentence. Some begin with a verb, for the subject to be put in front. */
export function sentence(message, subject = "The drawing") {
  const text = /^(is|has|holds|draws|shows|states|declares|needs|cannot)\b/.test(message) ? `${subject} ${message}` : message[0].toUpperCase() + message.slice(1);
  return /[.!?]$/.test(text) ? text : `${text}.`;
}

/** What a refusal of the server says. */
export async function trouble(response, subject) {
  if (response.status === 403) return "The server was started again, and this page belongs to the earlier start. Save the drawing, go to the new address that “crossfield studio” printed, and open the saved file there.";
  const text = await response.text();
  try { return sentence(JSON.parse(text).message, subject); } catch { return `The server failed with status ${response.status}. Save the drawing, try again, and report it if that fails.`; }
}
