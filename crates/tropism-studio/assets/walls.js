// Walls of nodes in the studio: which wall, its path saved as a file, and real walls that are watched.
// @ts-check
import { $, asked, command, get, html, listen, post, put, refuse, say, session, virtual } from "./studio.js";
import { enterWall, openWall, pathNames, showWatched, wallMarkup } from "./wall.js";

/** How often a watched wall is asked for, in ms. */
const AGAIN_MS = 5000;

put(
  $("#wall-view"),
  wallMarkup(
    html`<details class="sheet change" id="save-sheet">
      <summary>Save the wall and run it</summary>
      <div class="two-fields"><label class="field"><span>Name</span><input id="name" autocomplete="off" spellcheck="false" maxlength="60" value="wall" /></label></div>
      <div class="row wide"><button class="btn" type="button" id="save">Save the wall file</button></div>
      <div class="stack" id="commands"></div>
    </details>`,
  ),
);
enterWall();

/** The wall that is shown: a file, or a folder after `watched:`. */
let chosen = "";

async function watch() {
  const at = chosen.slice("watched:".length);
  while (chosen === `watched:${at}`) {
    if (!document.hidden) {
      const { wall, pictures, command: line } = await get("api/wall/watched", { at });
      if (chosen !== `watched:${at}`) return;
      showWatched(wall, pictures);
      put($("#commands"), command(line));
      put($("#banner"), "");
    }
    await new Promise((done) => setTimeout(done, AGAIN_MS));
  }
}

/** @param {string} choice */
async function choose(choice) {
  chosen = choice;
  const isWatched = choice.startsWith("watched:");
  put($("#reality"), isWatched ? "" : virtual("virtual bean"));
  $("#lede").textContent = isWatched
    ? "What the nodes said, by the journal of tropism watch-wall."
    : "Each node is a lamp with a sensor behind the plant. It knows its own reading and what its neighbours say; nobody knows where the plant is. Choose a node to lay the path through it.";
  $("#save").hidden = $("#name").hidden = isWatched;
  put($("#commands"), "");
  if (isWatched) await watch();
  else await openWall(choice);
}

$("#which").onchange = () => choose($("#which").value).catch(say);
$("#save").onclick = async () => {
  try {
    const { file, commands } = await post("api/wall/save", { name: $("#name").value.trim(), file: chosen, path: pathNames() });
    put($("#commands"), html`<p>${file} is saved.</p>${commands.map(command)}`);
    await offer();
  } catch (error) {
    say(error);
  }
};

/** Offers the walls that are there. */
async function offer() {
  const { files, watched } = await get("api/walls", {});
  const option = (/** @type {string} */ value, /** @type {string} */ title) => html`<option value="${value}">${title}</option>`;
  put(
    $("#which"),
    html`${option("", "three levels of two nodes")}${files.map((name) => option(name, name))}${watched.map((at) => option(`watched:${at}`, `${at}, watched`))}`,
  );
  $("#which").value = chosen;
  return { files, watched };
}

session.then(async ({ session: own }) => {
  if (!own) return;
  listen("items", "", () => offer().catch(say));
  try {
    const { files, watched } = await offer();
    const at = asked.get("at") ?? "";
    chosen = watched.includes(at) ? `watched:${at}` : files.includes(at) ? at : "";
    $("#which").value = chosen;
    await choose(chosen);
  } catch (error) {
    refuse(error);
  }
});
