// Log in with a token, typed or from the address behind `#`, which a browser sends to nobody.
// @ts-check
import { $, html, put } from "./studio.js";

$("#plain").hidden = location.protocol === "https:";
$("#see").onchange = () => {
  $("#token").type = $("#see").checked ? "text" : "password";
};

/** The page that was asked for; none of another site. */
function back() {
  const to = new URLSearchParams(location.search).get("to") ?? "";
  return /^(run|evolution|work|draw|begin|devices|tune|compare|wall)(\?[^#]*)?$/.test(to) ? to : "./";
}

/** @param {string} token */
async function logIn(token) {
  const button = $("#go");
  button.disabled = true;
  const headers = { "Content-Type": "application/json" };
  const answer = await fetch("api/login", { method: "POST", headers, body: JSON.stringify({ token }) }).catch(() => null);
  if (answer?.ok) return location.assign(back());
  const said = answer ? (await answer.json().catch(() => ({}))).error : "The studio does not answer.";
  put($("#say"), html`<div class="banner bad"><div>${said ?? "That was not it."}</div></div>`);
  $("#token").setAttribute("aria-invalid", "true");
  button.disabled = false;
}

$("#form").onsubmit = (event) => {
  event.preventDefault();
  logIn($("#token").value.trim());
};
const brought = location.hash.slice(1);
if (brought) {
  history.replaceState(null, "", location.pathname + location.search);
  logIn(brought);
}
