// Nodes of a lamp and a sensor each, which lead a virtual bean along the path that is drawn.
// @ts-check
import { enterWall, openWall, wallMarkup } from "../crates/tropism-studio/assets/wall.js";
import { $, html, put, say } from "./studio.js";

export async function openNodes() {
  if ($("#wall")) return;
  put(
    $("#view-nodes"),
    html`<div class="head">
        <div class="head-row"><h1>Nodes that steer together</h1><span class="chip virtual">virtual bean</span></div>
        <p class="lede">
          Each node is a lamp with a proximity sensor behind the plant. It knows its own echo and what its neighbours say; nobody knows where the plant
          is. Touch a node to lay the path through it.
        </p>
      </div>
      ${wallMarkup()}`,
  );
  enterWall();
  await openWall("").catch(say);
}
