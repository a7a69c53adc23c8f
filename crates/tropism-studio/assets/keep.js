// What is kept of a piece of work: its files to save, its tags, its name, and its end.
// @ts-check
import { $, get, html, onYes, pageOf, post, put, say, toast } from "./studio.js";

/**
 * Shows in `#keep` what can be saved and changed of work.
 * @param {string} kind @param {string} at @param {{ name: string, isOver?: boolean }} about
 */
export function keep(kind, at, { name, isOver = false }) {
  const begin = (form, of) => `begin?${new URLSearchParams({ form, [of]: at, out: name.replace(/[^\w-]/g, "-") })}`;
  const files =
    kind === "run"
      ? html`<a class="btn" href="api/run/photographs?${new URLSearchParams({ at })}" download>Photographs (ZIP)</a>
          ${isOver ? html`<a class="btn" href="api/file?${new URLSearchParams({ at: `${at}/track.csv` })}" download>Track (CSV)</a>` : ""}
          <a class="btn change" href="${begin("timelapse", "run")}">Film…</a>
          <a class="btn change" href="${begin("export", "run")}">Archive…</a>
          <a class="btn change" href="${begin("report", "of")}">Report…</a>`
      : kind === "rule"
        ? ""
        : html`<a class="btn change" href="${begin("report", "of")}">Report…</a>`;
  put(
    $("#keep"),
    html`<div class="row">${files}</div>
      <form class="row" id="tagging" autocomplete="off">
        <span class="row" id="tags"></span>
        <label class="inline-field small soft change"
          ><span>Tag</span><input class="search" id="tag" required maxlength="30" pattern="[\\p{L}\\p{N}._\\-]+" title="letters, digits, - _ ." spellcheck="false" autocapitalize="none"
        /></label>
        <button class="btn change">Add</button>
      </form>
      ${
        at === ""
          ? ""
          : html`<details class="change">
              <summary>Rename or delete</summary>
              <form class="row" id="rename">
                <label class="field"><span>New name</span><input id="new-name" required spellcheck="false" autocapitalize="none" value="${at.split("/").at(-1)}" /></label>
                <button class="btn">Rename</button><button class="btn danger" type="button" id="delete">Delete…</button>
              </form>
            </details>
            <dialog id="sure" aria-labelledby="sure-title">
              <form method="dialog" class="stack">
                <h2 id="sure-title">Delete ${name}?</h2>
                <p class="small">It goes into a folder for what was deleted, where it can be had back at its computer. Write its name once more to delete it.</p>
                <label class="field"><span>Name</span><input id="own-name" spellcheck="false" autocapitalize="none" autocomplete="off" /></label>
                <div class="row wide"><button class="btn danger" value="yes">Delete</button><button class="btn" value="no">Keep it</button></div>
              </form>
            </dialog>`
      }`,
  );
  tagging(at);
  const rename = $("#rename");
  if (!rename) return;
  rename.onsubmit = async (event) => {
    event.preventDefault();
    try {
      const found = await post("api/rename", { at, name: $("#new-name").value.trim() });
      location.replace(pageOf(kind, found.at));
    } catch (error) {
      say(error);
    }
  };
  $("#delete").onclick = () => {
    $("#own-name").value = "";
    $("#sure").showModal();
  };
  onYes($("#sure"), async () => {
    try {
      const { kept } = await post("api/delete", { at, name: $("#own-name").value.trim() });
      toast(`It lies in ${kept} now.`);
      setTimeout(() => location.replace("./"), 1500);
    } catch (error) {
      say(error);
    }
  });
}

/** Shows the tags of work, and lets them be changed. @param {string} at */
async function tagging(at) {
  /** @type {string[] | null} */
  let tags = null;
  const show = () =>
    put(
      $("#tags"),
      (tags ?? []).map(
        (tag) =>
          html`<span class="chip tagged"
            ><a href="./?${new URLSearchParams({ tag })}">${tag}</a
            ><button class="change" type="button" data-untag="${tag}" aria-label="Take the tag ${tag} off">×</button></span
          >`,
      ),
    );
  /** @param {string[]} wanted */
  const set = async (wanted) => {
    ({ tags } = await post("api/tags", { at, tags: wanted }));
    show();
  };
  $("#tagging").onsubmit = (event) => {
    event.preventDefault();
    set([...(tags ?? []), $("#tag").value.trim()]).then(() => ($("#tag").value = ""), say);
  };
  $("#tags").onclick = ({ target }) => {
    const off = target.dataset.untag;
    if (off) set((tags ?? []).filter((tag) => tag !== off)).then(() => $("#tag").focus(), say);
  };
  const known = await get("api/tags", { at }).catch(() => ({ tags: [] }));
  // What was set meanwhile is newer.
  tags ??= known.tags;
  show();
}
