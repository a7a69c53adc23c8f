// Opens a page's live events before all else: they come while its scripts and styles load. `listen` takes them over.
// @ts-check
if (!("early" in globalThis)) {
  const { events = "", event = "" } = /** @type {HTMLScriptElement} */ (document.currentScript).dataset;
  const at = new URLSearchParams(location.search).get("at") ?? "";
  const path = event === "items" ? events : `${events}?${new URLSearchParams({ at })}`;
  const source = new EventSource(path);
  /** @type {MessageEvent[]} */
  const heard = [];
  const keep = (/** @type {MessageEvent} */ message) => heard.push(message);
  source.addEventListener(event, keep);
  const taken = () => {
    source.removeEventListener(event, keep);
    return heard;
  };
  /** @type {any} */ (globalThis).early = { path, source, taken };
}
