// Keeps the page for times without a network.
const CACHE = "tropism-{{version}}";
self.addEventListener("install", (event) => {
  const files = ["./", "play.lzma", "icon.svg", "manifest.webmanifest"];
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(files)).then(() => self.skipWaiting()));
});
self.addEventListener("activate", (event) => {
  // What photographs need comes after the page is shown; where it does not come, it is fetched when it is needed.
  event.waitUntil(caches.open(CACHE).then((cache) => cache.add("whole.lzma")).catch(() => {}));
  const old = (name) => name.startsWith("tropism-") && name !== CACHE;
  event.waitUntil(caches.keys().then((names) => Promise.all(names.filter(old).map((name) => caches.delete(name)))).then(() => self.clients.claim()));
});
self.addEventListener("fetch", (event) => {
  event.respondWith(caches.match(event.request, { ignoreSearch: true }).then((kept) => kept ?? fetch(event.request)));
});
