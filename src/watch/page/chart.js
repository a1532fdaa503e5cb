// Error against time, on log axes.

const SVG = "http://www.w3.org/2000/svg";

/** Where an axis is labelled: powers of ten, with more between them where there would be few. */
function ticks(low, high) {
  const decades = Math.log10(high / low);
  const steps = decades > 2.5 ? [1] : decades > 1 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 8];
  const all = [];
  for (let k = Math.floor(Math.log10(low)); k <= Math.ceil(Math.log10(high)); k++) {
    for (const s of steps) all.push(Number((s * 10 ** k).toPrecision(6)));
  }
  return all.filter((t) => t >= low * 0.999 && t <= high * 1.001);
}

/** Draws the curve of a run: points of seconds, samples, error, uncertainty. */
function drawChart(svg, curve, target, forecast, hovered) {
  const points = curve.filter((p) => p[0] > 0 && p[2] > 0);
  svg.replaceChildren();
  const [width, height] = [svg.clientWidth || 360, svg.clientHeight || 250];
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const add = (name, attributes, text) => {
    const made = document.createElementNS(SVG, name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    if (text !== undefined) made.textContent = text;
    return svg.appendChild(made);
  };
  if (!points.length) {
    svg.setAttribute("aria-label", "no error known yet");
    add("text", { x: width / 2, y: height / 2, "text-anchor": "middle" }, "no error known yet");
    return null;
  }
  const last = points[points.length - 1];
  const low = (p) => Math.max(p[2] - p[3], 0.5 * p[2]);
  const times = points.map((p) => p[0]).concat(forecast ? [forecast[0]] : []);
  const errors = points.flatMap((p) => [low(p), p[2] + p[3]]).concat(target ? [target] : [], forecast ? [forecast[1]] : []);
  const x = [Math.min(...times) / 1.2, Math.max(...times) * 1.2], y = [Math.min(...errors) / 1.25, Math.max(...errors) * 1.25];
  const box = { left: 52, right: width - 18, top: 8, bottom: height - 34 };
  const across = (t) => box.left + (Math.log(t / x[0]) / Math.log(x[1] / x[0])) * (box.right - box.left);
  const down = (e) => box.bottom - (Math.log(e / y[0]) / Math.log(y[1] / y[0])) * (box.bottom - box.top);

  let free = -Infinity;
  for (const t of ticks(...x)) {
    add("line", { class: "grid", x1: across(t), x2: across(t), y1: box.top, y2: box.bottom });
    const label = t < 10000 ? String(t) : t.toExponential().replace("+", "");
    const half = 3.5 * label.length;
    if (across(t) - half < free) continue;
    free = across(t) + half + 8;
    add("text", { x: across(t), y: box.bottom + 14, "text-anchor": "middle" }, label);
  }
  free = Infinity;
  for (const e of ticks(...y)) {
    add("line", { class: "grid", x1: box.left, x2: box.right, y1: down(e), y2: down(e) });
    if (free - down(e) < 14) continue;
    free = down(e);
    add("text", { x: box.left - 5, y: down(e) + 4, "text-anchor": "end" }, Number((100 * e).toPrecision(3)) + " %");
  }
  add("text", { x: (box.left + box.right) / 2, y: height - 4, "text-anchor": "middle" }, "seconds of rendering");

  const path = (list) => "M" + list.map(([t, e]) => across(t).toFixed(1) + " " + down(e).toFixed(1)).join("L");
  const upper = points.map((p) => [p[0], p[2] + p[3]]), lower = points.map((p) => [p[0], low(p)]).reverse();
  add("path", { class: "band", d: path(upper.concat(lower)) + "Z" });
  if (target) {
    add("line", { class: "target", x1: box.left, x2: box.right, y1: down(target), y2: down(target) });
    const below = down(target) < box.top + 20;
    add("text", { class: "named", x: box.left + 6, y: down(target) + (below ? 14 : -5) }, "target " + short(target));
  }
  if (forecast) {
    const steps = Array.from({ length: 20 }, (_, i) => last[0] * (forecast[0] / last[0]) ** (i / 19));
    add("path", { class: "forecast", d: path(steps.map((t) => [t, last[2] * Math.sqrt(last[0] / t)])) });
    const middle = steps[10];
    const room = across(middle) + 60 < box.right;
    if (room) add("text", { class: "named", x: across(middle) + 6, y: down(last[2] * Math.sqrt(last[0] / middle)) - 4 }, "forecast");
  }
  add("path", { class: "line", d: path(points.map((p) => [p[0], p[2]])) });
  add("circle", { class: "dot", cx: across(last[0]), cy: down(last[2]), r: 3.5 });
  svg.setAttribute("aria-label", `relative error ${percent(last[2])} after ${clock(last[0])}`);

  if (hovered === null) return null;
  const at = points.reduce((best, p) => (Math.abs(across(p[0]) - hovered) < Math.abs(across(best[0]) - hovered) ? p : best));
  add("line", { class: "cross", x1: across(at[0]), x2: across(at[0]), y1: box.top, y2: box.bottom });
  add("circle", { class: "dot", cx: across(at[0]), cy: down(at[2]), r: 4.5 });
  return at;
}
