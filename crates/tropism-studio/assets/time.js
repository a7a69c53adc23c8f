// The server's clock, and times in words.
// @ts-check

/** Seconds by which the server's clock is ahead of this one. */
let ahead = 0;
/** @param {number} unix */
export const setClock = (unix) => {
  ahead = unix - Date.now() / 1000;
};
/** Seconds since 1970 by the server's clock. */
export const now = () => Date.now() / 1000 + ahead;

/** @param {number} seconds */
export const mmss = (seconds) => `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`;
/** A span of time in words. @param {number} seconds */
export function span(seconds) {
  const s = Math.max(0, seconds);
  if (s < 60) return `${Math.floor(s)} s`;
  if (s < 3600) return `${Math.floor(s / 60)} min`;
  if (s < 86_400) return `${Math.floor(s / 3600)} h ${Math.floor((s % 3600) / 60)} min`;
  return `${Math.floor(s / 86_400)} d ${Math.floor((s % 86_400) / 3600)} h`;
}
// Made once: to make them takes longer than all that they write on a page.
const CLOCK = new Intl.DateTimeFormat([], { hour: "2-digit", minute: "2-digit", hour12: false });
const DAY = new Intl.DateTimeFormat([], { day: "numeric", month: "short" });
/** A moment in the words of a person. @param {number} unix */
export function moment(unix) {
  const date = new Date(unix * 1000);
  const days = Math.floor((new Date(now() * 1000).setHours(0, 0, 0, 0) - new Date(date).setHours(0, 0, 0, 0)) / 86_400_000 + 0.5);
  const clock = CLOCK.format(date);
  if (days === 0) return clock;
  if (days === 1) return `yesterday ${clock}`;
  return `${DAY.format(date)} ${clock}`;
}
