// Asks for a page's live events before all else: they come while its scripts and styles load. `listen` takes them over.
// @ts-check

/** Changes with the messages of the hub: tabs of an older studio keep theirs. */
const HUB = "tropism hub 1";

/**
 * Who listens to a topic. Before there is a `take`, messages wait.
 * @typedef {import("./types.d.ts").Topics} Topics
 * @typedef {{ key: string, topic: keyof Topics, at: string, take: ((message: Message<any>) => void) | null, waiting: Message<any>[] }} Listener
 */
/**
 * A message of the hub: what a topic has to tell, that it cannot be listened to, a beat, or that the connection is lost.
 * @template News
 * @typedef {{ event?: string, data?: News, error?: string, beat?: number, isLost?: boolean }} Message
 */
/** @type {Map<string, Listener>} */
const listeners = new Map();
/** @type {MessagePort} */
let port;
/** Whether all tabs share a connection. Where they do not, a hidden tab has none: a browser opens six to one address. */
let isShared = true;

/** @param {MessagePort} to */
function use(to) {
  port = to;
  port.onmessage = ({ data }) => {
    const listener = listeners.get(data.key);
    if (listener?.take) listener.take(data);
    else listener?.waiting.push(data);
  };
  for (const listener of listeners.values()) ask(listener);
}
/** The hub as a part of this page. */
function useOwn() {
  isShared = false;
  const { port1, port2 } = new MessageChannel();
  import("./hub.js").then(({ join }) => join(port2));
  use(port1);
}
/** A hidden tab without a share asks when it is seen. @param {Listener} listener */
function ask({ key, topic, at }) {
  if (isShared || !document.hidden) port.postMessage({ listen: { key, topic, at } });
}
/** @param {Listener} listener */
const drop = ({ key }) => port.postMessage({ drop: key });

/** @param {keyof Topics} topic @param {string} at @returns {Listener} */
function add(topic, at) {
  const key = `${Date.now().toString(36)}-${Math.random().toString(36).slice(2)}`;
  const listener = { key, topic, at, take: null, waiting: [] };
  listeners.set(key, listener);
  ask(listener);
  return listener;
}

/**
 * Listens to a topic: `take` gets each message, also those that came before. Gives what ends it.
 * @template {keyof Topics} T
 * @param {T} topic @param {string} at @param {(message: Message<Topics[T]>) => void} take
 */
export function hear(topic, at, take) {
  const begun = [...listeners.values()].find((one) => !one.take && one.topic === topic && one.at === at);
  const listener = begun ?? add(topic, at);
  // After the rest of the page's script.
  queueMicrotask(() => {
    listener.take = take;
    for (const message of listener.waiting.splice(0)) take(message);
  });
  return () => {
    listeners.delete(listener.key);
    drop(listener);
  };
}

const page = location.pathname.split("/").at(-1) ?? "";
if (page !== "login") {
  try {
    const worker = new SharedWorker(new URL("hub.js", import.meta.url), { type: "module", name: HUB });
    worker.onerror = useOwn;
    use(worker.port);
  } catch {
    // Some phones have none, and browsers that may keep nothing refuse it.
    useOwn();
  }
  const at = new URLSearchParams(location.search).get("at") ?? "";
  if (page === "run" || page === "evolution") add(page, at);
  else add("items", "");
  addEventListener("pagehide", () => listeners.forEach(drop));
  // Another may have logged in, or out, since.
  addEventListener("pageshow", (event) => event.persisted && location.reload());
  document.addEventListener("visibilitychange", () => {
    if (!isShared) listeners.forEach(document.hidden ? drop : ask);
  });
}
