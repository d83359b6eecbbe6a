// SPDX-License-Identifier: Apache-2.0
#include "takt/report/html.h"

namespace takt::report {

// Works on what the page already shows: the readout under the pointer or the arrow keys, zoom along x by dragging
// (double click, Escape or the button go back), and series that a click on their key hides.
const char* const page_script = R"js(
(() => {
'use strict';
const svgElement = (name, attributes, text) => {
  const e = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v);
  if (text !== undefined) e.textContent = text;
  return e;
};
const clamp = (v, low, high) => Math.min(high, Math.max(low, v));
const shown = (v, step) => v.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9))).replace('-', '\u2212');

function niceStep(width, about) {
  const raw = width / about, power = 10 ** Math.floor(Math.log10(raw));
  for (const lead of [1, 2, 5]) if (lead * power >= raw * (1 - 1e-9)) return lead * power;
  return 10 * power;
}

function nearest(xs, x) {
  let best = -1;
  for (let i = 0; i < xs.length; ++i)
    if (xs[i] !== null && (best < 0 || Math.abs(xs[i] - x) < Math.abs(xs[best] - x))) best = i;
  return best;
}

function bringToLife(canvas) {
  const data = JSON.parse(canvas.querySelector('script').textContent);
  const chart = canvas.querySelector('svg.chart'), plot = canvas.querySelector('svg.plot');
  const grid = canvas.querySelector('.grid'), over = canvas.querySelector('.over');
  const back = canvas.querySelector('.back');
  const whole = {x: [data.x.low, data.x.high], y: [data.y.low, data.y.high]};
  let view = {x: [...whole.x], y: [...whole.y]}, hidden = new Set(), dragFrom = null, at = null;

  const share = (axis, v) => (v - view[axis][0]) / (view[axis][1] - view[axis][0]);
  const percent = s => (100 * s).toFixed(3) + '%';

  function draw() {
    const [x0, x1] = view.x, [y0, y1] = view.y;
    const wx = whole.x[1] - whole.x[0], wy = whole.y[1] - whole.y[0], e = data.extent;
    plot.setAttribute('viewBox', [e * (x0 - whole.x[0]) / wx, e * (whole.y[1] - y1) / wy, e * (x1 - x0) / wx, e * (y1 - y0) / wy].join(' '));
    grid.replaceChildren();
    const yStep = niceStep(y1 - y0, 5), xStep = niceStep(x1 - x0, 9);
    for (let k = Math.ceil(y0 / yStep); k * yStep <= y1; ++k) {
      const y = percent(1 - share('y', k * yStep));
      grid.append(svgElement('line', {x1: 0, x2: '100%', y1: y, y2: y}), svgElement('text', {class: 'y', x: -8, y}, shown(k * yStep, yStep)));
    }
    const first = Math.ceil(x0 / xStep);
    for (let k = first; k * xStep <= x1; ++k) {
      const x = percent(share('x', k * xStep));
      grid.append(svgElement('line', {class: 'upright', x1: x, x2: x, y1: 0, y2: '100%'}),
                  svgElement('text', {class: (k - first) % 2 ? 'x other' : 'x', x, y: '100%'}, shown(k * xStep, xStep)));
    }
    for (const m of over.querySelectorAll('[data-at]')) {
      const s = share('x', whole.x[0] + m.dataset.at * wx);
      m.style.display = s < 0 || s > 1 ? 'none' : '';
      for (const a of m.tagName === 'line' ? ['x1', 'x2'] : ['x']) m.setAttribute(a, percent(s));
    }
    for (const p of plot.querySelectorAll('path')) p.style.display = hidden.has(p.dataset.series) ? 'none' : '';
    back.hidden = x0 === whole.x[0] && x1 === whole.x[1];
  }

  // The y axis follows what is in view.
  function zoom(a, b) {
    view.x = [a, b];
    let low = Infinity, high = -Infinity;
    for (const s of data.series) if (!hidden.has(s.name)) s.x.forEach((x, i) => {
      if (s.y[i] === null || x < a || x > b) return;
      const half = s.sigma[i] || 0;
      low = Math.min(low, s.y[i] - half); high = Math.max(high, s.y[i] + half);
    });
    const all = a === whole.x[0] && b === whole.x[1] && !hidden.size;
    const margin = .06 * (high - low);
    view.y = all || !(high > low) ? [...whole.y] : [low - margin, high + margin];
    draw();
  }

  function probe(x) {
    at = x;
    over.querySelectorAll('.cursor, .probe').forEach(e => e.remove());
    canvas.querySelectorAll('.value').forEach(e => e.textContent = '');
    if (x === null) return;
    const drawn = new Set();
    let snapped = null;
    for (const s of data.series) {
      const i = hidden.has(s.name) ? -1 : nearest(s.x, x);
      if (i < 0 || s.y[i] === null || drawn.has(s.name)) continue;
      drawn.add(s.name);
      snapped ??= s.x[i];
      const h = share('x', s.x[i]), v = 1 - share('y', s.y[i]);
      if (h >= 0 && h <= 1 && v >= 0 && v <= 1)
        over.append(svgElement('circle', {class: 'probe c' + s.colour, cx: percent(h), cy: percent(v), r: 4}));
      const step = (view.y[1] - view.y[0]) / 1000;
      const value = shown(s.y[i], step) + (s.sigma[i] ? ' \u00b1 ' + shown(s.sigma[i], step) : '') + ' ' + data.y.unit;
      for (const key of canvas.querySelectorAll('.key')) if (key.dataset.series === s.name) key.querySelector('.value').textContent = value;
    }
    const note = canvas.querySelector('.where');
    if (snapped === null) return;
    note.textContent = data.x.name + ' ' + shown(snapped, (view.x[1] - view.x[0]) / 1000) + ' ' + data.x.unit;
    over.prepend(svgElement('line', {class: 'cursor', x1: percent(share('x', snapped)), x2: percent(share('x', snapped)), y1: 0, y2: '100%'}));
  }

  const xOf = event => {
    const box = plot.getBoundingClientRect();
    return view.x[0] + clamp((event.clientX - box.left) / box.width, 0, 1) * (view.x[1] - view.x[0]);
  };
  const lens = svgElement('rect', {class: 'lens', y: 0, height: '100%', x: 0, width: 0});
  plot.addEventListener('pointermove', event => {
    const x = xOf(event);
    if (dragFrom !== null) {
      const [a, b] = [share('x', Math.min(dragFrom, x)), share('x', Math.max(dragFrom, x))];
      lens.setAttribute('x', percent(a)); lens.setAttribute('width', percent(b - a));
    }
    probe(x);
  });
  plot.addEventListener('pointerleave', () => { if (dragFrom === null) probe(null); });
  plot.addEventListener('pointerdown', event => {
    if (event.button !== 0 || event.pointerType === 'touch') return;
    dragFrom = xOf(event);
    lens.setAttribute('width', 0); over.append(lens);
    try { plot.setPointerCapture(event.pointerId); } catch { /* a pointer that is gone */ }
    event.preventDefault(); canvas.focus({preventScroll: true});
  });
  const release = event => {
    if (dragFrom === null) return;
    const [a, b] = [Math.min(dragFrom, xOf(event)), Math.max(dragFrom, xOf(event))];
    dragFrom = null; lens.remove();
    if (event.type === 'pointerup' && b - a > .01 * (view.x[1] - view.x[0])) zoom(a, b);
  };
  plot.addEventListener('pointerup', release);
  plot.addEventListener('pointercancel', release);
  const reset = () => { zoom(...whole.x); probe(null); };
  plot.addEventListener('dblclick', reset);
  back.addEventListener('click', reset);
  canvas.addEventListener('keydown', event => {
    if (event.target !== canvas) return;
    if (event.key === 'Escape') return reset();
    const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    if (!step) return;
    event.preventDefault();
    const width = view.x[1] - view.x[0];
    probe(clamp((at ?? view.x[0] + width / 2) + step * width / (event.shiftKey ? 20 : 200), ...view.x));
  });
  for (const key of canvas.querySelectorAll('.key')) {
    key.disabled = false;
    key.setAttribute('aria-pressed', 'true');
    key.addEventListener('click', () => {
      const name = key.dataset.series;
      if (!hidden.delete(name)) hidden.add(name);
      key.setAttribute('aria-pressed', String(!hidden.has(name)));
      zoom(...view.x); probe(null);
    });
  }
  // A transparent sheet, so that the pointer is felt between the lines.
  plot.prepend(svgElement('rect', {width: data.extent, height: data.extent, fill: 'transparent'}));
  canvas.tabIndex = 0;
  chart.setAttribute('focusable', 'false');
}

document.documentElement.classList.add('live');
document.querySelectorAll('.canvas').forEach(bringToLife);
})();
)js";

}  // namespace takt::report
