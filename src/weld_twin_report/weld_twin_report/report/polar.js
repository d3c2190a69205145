// Copyright 2026 weld_twin contributors
// SPDX-License-Identifier: Apache-2.0
// Draws circles: the radial deviation magnified about the commanded circle, reversals at the rim.
'use strict';
(() => {
  const { data } = window.sheet;
  const canvases = [...document.querySelectorAll('canvas[data-circle]')];
  const colour = window.charts.colour;
  if (!canvases.length) return;

  const radial = (circle, deviation) => circle.angle.map((_, i) => (
    circle.out[3 * i] * deviation[3 * i] + circle.out[3 * i + 1] * deviation[3 * i + 1]
    + circle.out[3 * i + 2] * deviation[3 * i + 2]) / 1e3);

  // 1, 2 or 5 times a power of ten that a third of the radius has room for.
  function step(largest) {
    const power = 10 ** Math.floor(Math.log10(Math.max(largest, 1e-6)));
    return power * [1, 2, 5, 10].find((k) => k * power >= largest);
  }

  function draw(canvas) {
    const circle = data.circles.find((item) => item.run === Number(canvas.dataset.circle));
    const run = data.runs[circle.run];
    const ratio = Math.max(window.devicePixelRatio || 1, 2), side = canvas.clientWidth;
    canvas.width = Math.round(side * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, side * ratio / 2, canvas.clientHeight * ratio / 2);
    pen.font = '12px system-ui, sans-serif';
    const rim = 0.36 * Math.min(side, canvas.clientHeight), base = 0.66 * rim, span = 0.26 * rim;
    const before = radial(circle, run.before), now = radial(circle, run.now);
    const unit = step(Math.max(...before.map(Math.abs)));
    const place = (angle, value) => {
      const r = base + span * value / unit;
      return [r * Math.cos(angle), -r * Math.sin(angle)];
    };
    rings(pen, base, span, unit, circle, side, canvas.clientHeight);
    trace(pen, circle, before, place, colour('before'));
    if (data.found) trace(pen, circle, now, place, colour('after'));
    marks(pen, circle, rim);
  }

  function rings(pen, base, span, unit, circle, width, height) {
    pen.lineWidth = 1;
    [-1, 0, 1].forEach((k) => {
      pen.strokeStyle = colour(k ? 'rule' : 'soft');
      pen.beginPath();
      pen.arc(0, 0, base + k * span, 0, 7);
      pen.stroke();
    });
    pen.fillStyle = colour('soft');
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    pen.fillText(`rings ${unit} mm apart`, 0, -8);
    pen.fillText(`drawn ${Math.round(circle.radius * span / base / unit)} × larger`, 0, 8);
  }

  function trace(pen, circle, values, place, stroke) {
    pen.strokeStyle = stroke;
    pen.lineWidth = 1.6;
    pen.beginPath();
    values.forEach((value, i) => pen[i ? 'lineTo' : 'moveTo'](...place(circle.angle[i], value)));
    pen.stroke();
  }

  // Names at the rim, those that would lie on each other joined.
  function marks(pen, circle, rim) {
    const told = [];
    for (const [joint, angle] of circle.reversals) {
      const name = data.joints[joint].length > 3 ? String(joint + 1) : data.joints[joint];
      const turn = ((angle % (2 * Math.PI)) + 2 * Math.PI) % (2 * Math.PI);
      const near = told.find((item) => Math.abs(item.turn - turn) < 0.13);
      const names = (near || told[told.push({ turn, names: [] }) - 1]).names;
      if (circle.named.includes(joint) && !names.includes(name)) names.push(name);
    }
    pen.fillStyle = pen.strokeStyle = colour('ink');
    pen.lineWidth = 1.5;
    for (const { turn, names } of told) {
      const [c, s] = [Math.cos(turn), -Math.sin(turn)];
      pen.beginPath();
      pen.moveTo(0.94 * rim * c, 0.94 * rim * s);
      pen.lineTo(1.02 * rim * c, 1.02 * rim * s);
      pen.stroke();
      pen.textAlign = Math.abs(c) < 0.3 ? 'center' : (c > 0 ? 'left' : 'right');
      const more = names.length > 2 ? `${names[0]} +${names.length - 1}` : names.join(', ');
      pen.fillText(more, 1.08 * rim * c, 1.08 * rim * s);
    }
  }

  const redraw = () => canvases.forEach(draw);
  redraw();
  document.addEventListener('switched', redraw);
  new ResizeObserver(redraw).observe(canvases[0]);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);
  window.addEventListener('beforeprint', redraw);
  window.addEventListener('afterprint', redraw);
})();
