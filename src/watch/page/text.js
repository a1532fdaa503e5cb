"use strict";

// Numbers as people read them.

/** So many significant digits, without an exponent where there need be none. */
function digits(x, n) {
  if (x === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(x)));
  if (size < -5 || size > 8) return x.toExponential(n - 1);
  return x.toFixed(Math.max(0, n - 1 - size));
}

function percent(x, n = 3) {
  return x === null || x === undefined ? "unknown" : digits(100 * x, n) + " %";
}

/** A share that someone has typed. */
function short(x) {
  return Number((100 * x).toPrecision(6)) + " %";
}

/** A duration: 4.2 s, 42 s, 3 min 20 s, 2 h 5 min. */
function clock(seconds) {
  const s = Math.round(seconds);
  if (seconds < 9.95) return seconds.toFixed(1) + " s";
  if (s < 120) return s + " s";
  if (s < 7200) return Math.floor(s / 60) + " min" + (s % 60 ? " " + (s % 60) + " s" : "");
  const minutes = Math.round(s / 60);
  if (s < 48 * 3600) return Math.floor(minutes / 60) + " h" + (minutes % 60 ? " " + (minutes % 60) + " min" : "");
  return digits(s / 86400, 3) + " days";
}

function count(x) {
  if (x >= 1e9) return digits(x / 1e9, 3) + " billion";
  if (x >= 1e6) return digits(x / 1e6, 3) + " million";
  return Math.round(x).toLocaleString("en");
}

const DOUBTS = {
  "no-light": "no light found yet",
  "unlit": "no light found yet in a part of the picture",
  "hidden": "light that mirrors and glass show was found too rarely",
  "uncertain": "it rests on too few samples",
};

/** A relative error with its uncertainty, and what there is to doubt. */
function errorText(now) {
  if (!now || now.relative_error === null) return (now && DOUBTS[now.relative_error_doubt]) || "unknown";
  let text = percent(now.relative_error);
  if (now.relative_error_uncertainty > 0) text += " \u00b1 " + percent(now.relative_error_uncertainty, 2);
  return text;
}

function id(name) {
  return document.getElementById(name);
}

function element(name, attributes = {}, text = "") {
  const made = document.createElement(name);
  for (const key in attributes) made.setAttribute(key, attributes[key]);
  made.textContent = text;
  return made;
}
