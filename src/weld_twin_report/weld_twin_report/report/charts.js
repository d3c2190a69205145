// Copyright 2026 weld_twin contributors
// SPDX-License-Identifier: Apache-2.0
// Draws every figure.chart with uPlot: ticks, values under the cursor, one cursor for all of a key.
// What else shows an instant listens to the event 'instant', and sends it: {key, x, from}.
'use strict';
window.charts = (() => {
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const titled = (axis) => (axis.unit ? `${axis.label} [${axis.unit}]` : axis.label);
  // Steps of an axis that counts: stations have no halves.
  const WHOLE = [1, 2, 5].flatMap((k) => [1, 10, 100, 1000, 10000].map((ten) => k * ten)).sort((a, b) => a - b);
  const drawn = [];
  let told = false;

  // Micrometres are the last that a length is read to; of all else three digits.
  const LAST = { mm: 3, s: 2 };
  function value(axis, digits) {
    const short = (v) => (axis.unit in LAST ? v.toFixed(LAST[axis.unit]) : Number(v.toPrecision(digits)));
    return (chart, v) => (v == null ? '–' : `${short(v)} ${axis.unit}`.trim());
  }

  function series(line, axis) {
    return {
      label: line.name,
      stroke: () => colour(line.colour),
      width: 1.5,
      paths: line.points ? () => null : undefined,
      dash: line.dashed ? [6, 4] : undefined,
      points: { show: line.points || line.marked, size: 5, fill: () => colour(line.colour) },
      value: value(axis, 3),
    };
  }

  function scaled(axis, size) {
    return {
      label: titled(axis), labelSize: 20, labelFont: '12px system-ui, sans-serif',
      font: '12px system-ui, sans-serif', size, stroke: () => colour('soft'),
      grid: { stroke: () => colour('rule'), width: 1 }, ticks: { stroke: () => colour('rule'), width: 1, size: 4 },
    };
  }

  // A shaded band is two lines without strokes and what lies between them.
  function banded(spec, lines, data) {
    if (!spec.band) return undefined;
    for (const side of spec.band) {
      lines.push({ width: 0, points: { show: false }, label: '', class: 'hidden' });
      data.push(side);
    }
    return [{ series: [lines.length - 1, lines.length - 2], fill: () => `${colour(spec.lines[0].colour)}38` }];
  }

  function options(spec, width, lines, bands) {
    const [across, up] = spec.axes;
    return {
      width, height: spec.height, series: lines, bands,
      axes: [{ ...scaled(across, 30), incrs: across.label === 'station' ? WHOLE : undefined }, scaled(up, 52)],
      scales: { x: { time: Boolean(spec.dates) }, y: { range: spec.zero ? (c, low, high) => [0, 1.08 * high || 1] : undefined } },
      cursor: { drag: { x: false, y: false }, y: false, sync: spec.key ? { key: spec.key, setSeries: false } : undefined },
      legend: { live: true },
      hooks: { setCursor: [(chart) => tell(spec, chart)] },
    };
  }

  function tell(spec, chart) {
    if (!spec.key || told || chart.cursor.idx == null) return;
    told = true;
    document.dispatchEvent(new CustomEvent('instant', {
      detail: { key: spec.key, x: chart.data[0][chart.cursor.idx], from: chart },
    }));
    told = false;
  }

  function make(figure) {
    const spec = JSON.parse(figure.querySelector('script').textContent);
    const place = figure.querySelector('.plot');
    const lines = [
      { label: spec.axes[0].label, value: spec.dates ? undefined : value(spec.axes[0], 6) },
      ...spec.lines.map((line) => series(line, spec.axes[1])),
    ];
    const data = [spec.x, ...spec.lines.map((line) => line.values)];
    const bands = banded(spec, lines, data);
    const chart = new uPlot(options(spec, place.clientWidth || 300, lines, bands), data, place);
    const one = { figure, spec, place, chart };
    drawn.push(one);
    // Until an instant is looked at, a curve has the values of where it is furthest off.
    // At the very edge there is no cursor.
    if (spec.band) chart.setCursor({ left: Math.max(chart.valToPos(spec.x[furthest(data[1])], 'x'), 1), top: 1 });
    new ResizeObserver(() => fit(one)).observe(place);
    return one;
  }

  function furthest(values) {
    return values.reduce((best, v, i) => (Math.abs(v) > Math.abs(values[best]) ? i : best), 0);
  }

  function fit(one) {
    const width = one.place.clientWidth;
    if (width && width !== one.chart.width) one.chart.setSize({ width, height: one.spec.height });
  }

  // Gives the lines of a chart other values, by name.
  function update(figure, values) {
    const one = drawn.find((item) => item.figure === figure);
    const data = one.chart.data.slice();
    one.spec.lines.forEach((line, k) => { if (values[line.name]) data[k + 1] = values[line.name]; });
    one.chart.setData(data);
  }

  function follow(event) {
    const { key, x, from } = event.detail;
    if (from || told) return;
    told = true;
    for (const { spec, chart } of drawn) {
      if (spec.key === key) chart.setCursor({ left: chart.valToPos(x, 'x'), top: 1 }, false);
    }
    told = false;
  }

  // A curve over the angle of a joint shows where that joint stands at the instant looked at.
  function stand(event) {
    const { run, sample } = event.detail;
    for (const { spec, chart } of drawn) {
      const q = spec.joint == null ? null : window.sheet.data.runs[run].joints[spec.joint];
      if (q) chart.setCursor({ left: chart.valToPos(q[sample], 'x'), top: 1 }, false);
    }
  }

  function again() {
    for (const { chart } of drawn) chart.redraw(false);
  }

  // Canvases are drawn before the rules of a print hold: this class has its colours and the widths of
  // its charts at once.
  function printing(on) {
    document.documentElement.classList.toggle('printing', on);
    drawn.forEach(fit);
  }
  window.addEventListener('beforeprint', () => printing(true), { capture: true });
  window.addEventListener('afterprint', () => printing(false), { capture: true });

  document.querySelectorAll('figure.chart').forEach(make);
  document.addEventListener('instant', follow);
  document.addEventListener('looked', stand);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', again);
  matchMedia('print').addEventListener('change', again);
  window.addEventListener('beforeprint', again);
  window.addEventListener('afterprint', again);
  return { update, colour };
})();
