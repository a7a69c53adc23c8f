// Overview: what runs, what needs somebody, the queue, everything.
// @ts-check
import {
  $,
  $$,
  asked,
  capital,
  chip,
  folded,
  html,
  icon,
  lampClass,
  lampText,
  listen,
  mmss,
  moment,
  now,
  pageOf,
  post,
  put,
  say,
  span,
  virtual,
} from "./studio.js";

/** @typedef {import("./types.d.ts").Item} Item */

/** @type {Map<string, Item>} */
const items = new Map();
/** @type {import("./types.d.ts").ShownJob[]} */
let queue = [];
let isKnown = false;

const find = $("#find");
const kind = $("#kind");
const folder = $("#folder");
const tag = $("#tag");
const sort = $("#sort");

// Made once: hundreds of names are compared with it, again and again.
const { compare: byName } = new Intl.Collator(undefined, { numeric: true });
/** @type {Record<"new" | "best" | "name", (a: Item, b: Item) => number>} */
const ORDERS = {
  new: (a, b) => rank(b) - rank(a) || (b.began ?? 0) - (a.began ?? 0),
  best: (a, b) => (b.value ?? -Infinity) - (a.value ?? -Infinity) || byName(a.name, b.name),
  name: (a, b) => byName(a.name, b.name),
};
/** What goes on stands first. @param {Item} item */
const rank = (item) => Number(item.state === "live" || item.state === "overdue");
const address = (/** @type {Item} */ item) => pageOf(item.kind, item.at);

/** Rows of a page: more are not looked through by eye. */
const PAGE = 50;
let page = Number(asked.get("page") ?? 0);
/** Rows by the place of what they show. @type {Map<string, { tr: HTMLElement, shows: Item | null }>} */
const drawn = new Map();

/** Whether an item lies in a folder, or in one below it. @param {Item} item @param {string} folder */
const isIn = (item, folder) => !folder || item.at.startsWith(`${folder}/`);

/** The folders that hold work, as they are, without those that are work themselves. */
function folders() {
  const all = new Set();
  for (const { at } of items.values()) {
    const names = at.split("/").slice(0, -1);
    for (let depth = 1; depth <= names.length; depth++) {
      const folder = names.slice(0, depth).join("/");
      // What lies in a study is the study's.
      if (items.has(folder)) break;
      all.add(folder);
    }
  }
  return [...all].sort(byName);
}

/** Offers what there is to choose from; nothing where there is no choice. @param {HTMLSelectElement} select @param {string} every @param {string[]} words */
function offer(select, every, words) {
  const { value } = select;
  const all = value && !words.includes(value) ? [...words, value] : words;
  put(select, [html`<option value="">${every}</option>`, all.map((word) => html`<option>${word}</option>`)]);
  select.value = value;
  select.hidden = !all.length;
}

/** Keeps what is chosen in the address: one comes back to it. */
function remember() {
  const chosen = { find: find.value, kind: kind.value, folder: folder.value, tag: tag.value, sort: sort.value, page: String(page) };
  const told = Object.entries(chosen).filter(([name, value]) => value && value !== (name === "sort" ? "new" : "0"));
  history.replaceState(null, "", told.length ? `?${new URLSearchParams(told)}` : location.pathname);
}

function rows() {
  const wanted = find.value.trim().toLowerCase();
  const all = [...items.values()];
  const found = all
    .filter((item) => item.name.toLowerCase().includes(wanted) && (!kind.value || item.kind === kind.value))
    .filter((item) => isIn(item, folder.value) && (!tag.value || item.tags.includes(tag.value)))
    .sort(ORDERS[/** @type {"new"} */ (sort.value)]);
  page = Math.max(0, Math.min(page, Math.ceil(found.length / PAGE) - 1));
  const shown = found.slice(page * PAGE, (page + 1) * PAGE);
  const row = (/** @type {Item} */ item) =>
    html`<th class="c-name" scope="row">
        <a class="open" href="${address(item)}">${item.name}</a>${item.tags.map((tag) => html` <span class="chip">${tag}</span>`)}
      </th>
      <td class="c-kind">
        <span class="kind">${icon(item.kind)}${item.kind}${item.is_virtual ? html` ${virtual()}` : ""}</span>
      </td>
      <td class="c-state">${chip(item.state)}</td>
      <td class="c-since soft">${item.began ? moment(item.began) : ""}</td>
      <td class="n c-best">${item.text}</td>
      <td class="c-health">${item.health === "good" ? html`<span class="soft">good</span>` : item.health}</td>`;
  // Those rows are drawn that changed, and those moved that moved: else each photograph would cost a frame.
  const place = $("#rows");
  shown.forEach((item, index) => {
    const { tr, shows } = drawn.get(item.at) ?? { tr: document.createElement("tr"), shows: null };
    if (shows !== item) put(tr, row(item));
    drawn.set(item.at, { tr, shows: item });
    if (place.children[index] !== tr) place.insertBefore(tr, place.children[index] ?? null);
  });
  while (place.children.length > shown.length) place.lastElementChild.remove();
  for (const at of drawn.keys()) if (!items.has(at)) drawn.delete(at);
  $("#count").textContent = `${found.length} of ${all.length}`;
  $("#none").hidden = found.length > 0 || all.length === 0;
  $("#pager").hidden = found.length <= PAGE;
  $("#which").textContent = `${page * PAGE + 1} to ${page * PAGE + shown.length} of ${found.length}`;
  $("#before").setAttribute("aria-disabled", String(page === 0));
  $("#after").setAttribute("aria-disabled", String((page + 1) * PAGE >= found.length));
}

/** Shows the first page of what is chosen now. */
function choose() {
  page = 0;
  rows();
  remember();
}

/** @param {number} by */
function turn(by) {
  page += by;
  rows();
  remember();
}

/** @param {Item} item */
function runCard(item) {
  const photo = new URLSearchParams({ at: item.at, name: item.photo_name ?? "", ...(item.photo_v ? { v: item.photo_v } : {}) });
  const picture = item.photo_name
    ? html`<img src="api/run/photo?${photo}" alt="" width="648" height="300" /><span
          class="tag"
          data-photo="${item.photo}"
        ></span>`
    : html`<span class="tag">no photograph yet</span>`;
  return html`<a class="sheet card" href="${address(item)}">
    <div class="thumb">${picture}</div>
    <div class="row">
      <h3>${item.name}</h3>
      ${chip(item.state)}${item.is_virtual ? virtual() : ""}
    </div>
    <p class="small">
      ${item.lamp ? html`<span class="lamp ${lampClass(item.lamp)}">${capital(lampText(item.lamp))}</span> ` : ""}
      ${item.next ? html`&ensp;next photograph in <b class="num" data-next="${item.next}"></b>` : ""}
    </p>
    <p class="soft small">
      ${item.step === null ? "" : `Step ${item.step}, ${item.text}.`} ${item.health === "good" ? "" : item.health}
    </p>
  </a>`;
}

/** @param {Item} item */
function workCard(item) {
  const share = item.total ? Math.round((100 * (item.done ?? 0)) / item.total) : 0;
  return html`<a class="sheet card" href="${address(item)}">
    <div class="row">
      <h3>${item.name}</h3>
      ${chip(item.state, item.kind === "evolution" ? "Evolving" : "Live")}
    </div>
    <p class="small">${item.kind === "evolution" ? html`Best <b>${item.text}</b>` : item.text}</p>
    <progress max="100" value="${share}" aria-label="${item.name}: done"></progress>
    <p class="soft small">${share} % done. The page may be closed.</p>
  </a>`;
}

function queueCard() {
  const open = queue.filter((job) => job.state === "waiting" || job.state === "running");
  const failed = queue.filter((job) => job.state === "failed").slice(-2);
  if (!open.length && !failed.length) return "";
  const job = (/** @type {typeof queue[0]} */ one, /** @type {number} */ place) =>
    html`<li class="row">
      <span class="chip ${one.state === "running" ? "live" : ""}"
        >${icon(one.state === "running" ? "live" : "wait")}${place + 1}</span
      >
      <span>${one.at}</span>
      ${one.state === "waiting" ? html`<button class="btn quiet push change" type="button" data-remove="${one.number}">Take out</button>` : ""}
    </li>`;
  return html`<div class="sheet">
    <h3>Queue</h3>
    <p class="soft small">One heavy job at a time. The queue survives a restart.</p>
    <ol class="steps">
      ${open.map(job)}
    </ol>
    ${failed.map((one) => html`<div class="small"><b>${one.at} failed:</b> ${folded(one.problem)}</div>`)}
  </div>`;
}

function draw() {
  const all = [...items.values()];
  offer(folder, "Every folder", folders());
  offer(tag, "Every tag", [...new Set(all.flatMap((item) => item.tags))].sort(byName));
  rows();
  const live = all.filter(
    (item) => rank(item) && !all.some((other) => other !== item && rank(other) && item.at.startsWith(`${other.at}/`)),
  );
  const cards = live
    .sort(ORDERS.new)
    .slice(0, 8)
    .map((item) => (item.kind === "run" ? runCard(item) : workCard(item)));
  put($("#cards"), [cards, queueCard()]);
  $("#now-section").hidden = $("#cards").textContent.trim() === "";
  const needs = all.filter(
    (item) => ["overdue", "died", "paused", "broken"].includes(item.state) || (item.state === "live" && item.health !== "good"),
  );
  const one = (/** @type {Item} */ item) => html`<li><a href="${address(item)}">${item.name}</a>: ${item.health}.</li>`;
  put(
    $("#needs"),
    needs.length
      ? html`<div class="banner">
          <div>
            <strong>${needs.length === 1 ? "One thing needs you." : `${needs.length} things need you.`}</strong>
            <ul class="plain">
              ${needs.slice(0, 5).map(one)}
            </ul>
          </div>
        </div>`
      : "",
  );
  $("#all-section").hidden = isKnown && all.length === 0;
  $("#empty").hidden = !isKnown || all.length > 0;
  tick();
}

/** Ages and what is due, once a second. */
function tick() {
  for (const tag of $$("[data-photo]")) tag.textContent = `taken ${mmss(Math.max(0, now() - Number(tag.dataset.photo)))} ago`;
  for (const due of $$("[data-next]")) {
    const left = Number(due.dataset.next) - now();
    due.textContent = left >= 0 ? mmss(left) : `0:00, ${span(-left)} late`;
  }
}

find.oninput = kind.onchange = folder.onchange = tag.onchange = sort.onchange = choose;
$("#clear").onclick = () => {
  find.value = kind.value = folder.value = tag.value = "";
  choose();
};
$("#before").onclick = () => turn(-1);
$("#after").onclick = () => turn(1);
addEventListener("click", (event) => {
  const button = /** @type {any} */ (event.target).closest?.("[data-remove]");
  if (button) post("api/queue/remove", { number: Number(button.dataset.remove) }).catch(say);
});

for (const [name, select] of Object.entries({ kind, sort })) if (asked.get(name)) select.value = asked.get(name);
find.value = asked.get("find") ?? "";
for (const [name, select] of Object.entries({ folder, tag })) {
  put(select, html`<option>${asked.get(name) ?? ""}</option>`);
  select.value = asked.get(name) ?? "";
}

// At once: it does not wait for the words in the foot.
listen(
  "items",
  "",
  (data) => {
    if (data.all) items.clear();
    for (const item of data.items) items.set(item.at, item);
    for (const at of data.gone) if (!data.items.some((item) => item.at === at)) items.delete(at);
    queue = data.queue ?? queue;
    isKnown = true;
    draw();
  },
  (isLost) => document.body.classList.toggle("cut-off", isLost),
);
setInterval(tick, 1000);
