// Copyright 2026 weld_twin contributors
// SPDX-License-Identifier: Apache-2.0
// Draws the seam: an orthographic view turned by hand, the same for both pictures.
'use strict';
(() => {
  const data = window.sheet.data;
  const canvases = [...document.querySelectorAll('canvas[data-side]')];
  const VIEWS = { angled: [-0.9, 0.55], top: [-Math.PI / 2, Math.PI / 2], front: [-Math.PI / 2, 0], side: [0, 0] };
  const COLOURS = [[58, 110, 190], [34, 160, 140], [226, 168, 20], [214, 74, 40], [150, 10, 70]];
  if (!canvases.length) return;
  const view = { turn: 0, tilt: 0, zoom: 1, stretch: data.stretch, looked: null };
  const middle = centre();

  function centre() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const run of data.runs) {
      for (let i = 0; i < run.path.length; i++) {
        low[i % 3] = Math.min(low[i % 3], run.path[i]);
        high[i % 3] = Math.max(high[i % 3], run.path[i]);
      }
    }
    return low.map((v, k) => (Number.isFinite(v) ? (v + high[k]) / 2 : 0));
  }

  // Looks from one of the named directions, near enough to fill the picture.
  function look(name) {
    [view.turn, view.tilt] = VIEWS[name];
    view.zoom = 1;
    view.half = [1, 1];
    const { direction } = projector(1, 1);
    for (const run of data.runs) {
      for (let i = 0; i < run.path.length; i += 3) {
        const p = run.path.slice(i, i + 3).map((v, k) => v - middle[k] + view.stretch * run.before[i + k]);
        direction(...p).forEach((v, k) => { view.half[k] = Math.max(view.half[k], Math.abs(v)); });
      }
    }
  }

  function style(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  }

  function colour(share) {
    const at = Math.min(Math.max(share, 0), 1) * (COLOURS.length - 1);
    const k = Math.min(Math.floor(at), COLOURS.length - 2), part = at - k;
    const mix = COLOURS[k].map((v, j) => Math.round(v + part * (COLOURS[k + 1][j] - v)));
    return `rgb(${mix})`;
  }

  function sized(canvas) {
    const ratio = Math.max(window.devicePixelRatio || 1, 2);
    const width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.font = '12px system-ui, sans-serif';
    return { pen, width, height };
  }

  // The projection: turn about the vertical, then tilt towards the viewer.
  function projector(width, height) {
    const scale = view.zoom * Math.min(0.43 * width / view.half[0], 0.38 * height / view.half[1]);
    const ct = Math.cos(view.turn), st = Math.sin(view.turn);
    const ci = Math.cos(view.tilt), si = Math.sin(view.tilt);
    const direction = (x, y, z) => [-x * st + y * ct, -(z * ci - (x * ct + y * st) * si)];
    const point = (x, y, z) => {
      const [u, v] = direction(x - middle[0], y - middle[1], z - middle[2]);
      return [width / 2 + scale * u, height / 2 + scale * v];
    };
    return { point, direction, scale };
  }

  function draw(canvas) {
    const { pen, width, height } = sized(canvas);
    const project = projector(width, height);
    const side = canvas.dataset.side === 'before' ? 'before' : 'now';
    // Where the axes and the ruler stand, and then the words too.
    const foot = footing(project.point, width, height), told = [];
    const line = data.runs.flatMap((run) => run.t.map((_, i) => project.point(...at(run, i))));
    const taken = [[-34, -34, 34, 34].map((v, k) => foot[k % 2] + v), [0.7 * width - 14, height - 38, width, height]];
    data.runs.forEach((run, k) => {
      drawRun(pen, project.point, run, run[side]);
      if (!run.dots) drawCourse(pen, project.point, run, { width, height, taken, told, line });
      if (view.looked && view.looked.run === k) drawLooked(pen, project.point, run, run[side]);
    });
    drawAxes(pen, project.direction, foot);
    drawRuler(pen, project.scale, width, height);
  }

  function lined(pen, ...points) {
    pen.beginPath();
    points.forEach((p, i) => (i ? pen.lineTo(...p) : pen.moveTo(...p)));
    pen.stroke();
  }

  function drawRun(pen, point, run, gap) {
    const count = run.path.length / 3, stretch = view.stretch;
    const nominal = [], measured = [], size = [];
    for (let i = 0; i < count; i++) {
      const [x, y, z] = run.path.slice(3 * i, 3 * i + 3);
      const [a, b, c] = gap.slice(3 * i, 3 * i + 3);
      nominal.push(point(x, y, z));
      measured.push(point(x + stretch * a, y + stretch * b, z + stretch * c));
      size.push(Math.hypot(a, b, c) / data.top);
    }
    pen.lineCap = pen.lineJoin = 'round';
    pen.strokeStyle = style('--soft');
    pen.lineWidth = 0.8;
    if (run.dots) {
      drawDots(pen, nominal, measured, size);
      return;
    }
    lined(pen, ...nominal);
    pen.lineWidth = 2.4;
    for (let i = 1; i < count; i++) {
      pen.strokeStyle = colour((size[i - 1] + size[i]) / 2);
      lined(pen, measured[i - 1], measured[i]);
    }
  }

  const at = (run, i) => run.path.slice(3 * i, 3 * i + 3);

  // Writes a word beside a point, where nothing else stands.
  function write(pen, [u, v], text, { width, height, taken, told, line }) {
    // Several recordings of one seam start at one place: one word does.
    if (told.some(([a, b, word]) => word === text && Math.hypot(a - u, b - v) < 12)) return;
    told.push([u, v, text]);
    const long = pen.measureText(text).width;
    const box = (dx, dy) => [u + dx, v + dy - 7, u + dx + long, v + dy + 7];
    const free = ([left, top, right, bottom]) => left >= 5 && top >= 3 && right <= width - 5 && bottom <= height - 3
      && taken.every(([a, b, c, d]) => right < a || left > c || bottom < b || top > d);
    const places = [-9, 12, -26, 28, -44, -62].flatMap((dy) => [[7, dy], [-7 - long, dy]]);
    const under = ([left, top, right, bottom]) => line.filter(([x, y]) => x > left - 3 && x < right + 3
      && y > top - 3 && y < bottom + 3).length;
    const open = places.filter((place) => free(box(...place))).map((place) => [under(box(...place)), place]);
    const [, [dx, dy]] = open.reduce((a, b) => (b[0] < a[0] ? b : a), open[0] || [0, places[0]]);
    taken.push(box(dx, dy));
    pen.fillText(text, u + dx, v + dy);
  }

  // Start, end and three arrows in the direction of travel.
  function drawCourse(pen, point, run, sheet) {
    const last = run.path.length / 3 - 1;
    if (last < 8) return;
    pen.fillStyle = pen.strokeStyle = style('--ink');
    pen.textBaseline = 'middle';
    pen.textAlign = 'left';
    const [start, end] = [point(...at(run, 0)), point(...at(run, last))];
    const together = Math.hypot(start[0] - end[0], start[1] - end[1]) < 40;
    const told = together ? [[start, 'start, end']] : [[start, 'start'], [end, 'end']];
    for (const [[u, v], text] of told) {
      pen.beginPath();
      pen.arc(u, v, 3, 0, 7);
      pen.fill();
      write(pen, [u, v], text, sheet);
    }
    for (const part of [0.2, 0.5, 0.8]) {
      const i = Math.round(part * last), gap = Math.max(2, Math.round(last / 60));
      const [a, b] = [point(...at(run, i - gap > 0 ? i - gap : 0)), point(...at(run, Math.min(i + gap, last)))];
      const turn = Math.atan2(b[1] - a[1], b[0] - a[0]);
      const tip = point(...at(run, i));
      pen.beginPath();
      pen.moveTo(...tip);
      for (const side of [-0.5, 0.5]) pen.lineTo(tip[0] - 10 * Math.cos(turn + side), tip[1] - 10 * Math.sin(turn + side));
      pen.fill();
    }
  }

  // The instant that the cursor of the charts is at.
  function drawLooked(pen, point, run, gap) {
    const i = view.looked.sample, nominal = at(run, i), off = gap.slice(3 * i, 3 * i + 3);
    const [u, v] = point(...nominal.map((value, k) => value + view.stretch * off[k]));
    pen.strokeStyle = style('--ink');
    pen.lineWidth = 2;
    lined(pen, point(...nominal), [u, v]);
    pen.beginPath();
    pen.arc(u, v, 7, 0, 7);
    pen.stroke();
  }

  // Tells the sample next to the pointer, if there is one near.
  function hovered(canvas, event) {
    const box = canvas.getBoundingClientRect(), { point } = projector(canvas.clientWidth, canvas.clientHeight);
    const side = canvas.dataset.side === 'before' ? 'before' : 'now';
    let best = 18, found = null;
    data.runs.forEach((run, k) => {
      for (let i = 0; i < run.path.length / 3; i++) {
        const p = at(run, i).map((value, j) => value + view.stretch * run[side][3 * i + j]);
        const [u, v] = point(...p);
        const far = Math.hypot(u - (event.clientX - box.left), v - (event.clientY - box.top));
        if (far < best) { best = far; found = { key: `run${k}`, x: run.t[i] }; }
      }
    });
    if (found) document.dispatchEvent(new CustomEvent('instant', { detail: found }));
  }

  function drawDots(pen, nominal, measured, size) {
    nominal.forEach((from, i) => {
      pen.strokeStyle = pen.fillStyle = colour(size[i]);
      pen.lineWidth = 1.2;
      lined(pen, from, measured[i]);
      pen.beginPath();
      pen.arc(...measured[i], 1.8, 0, 7);
      pen.fill();
    });
  }

  // The corner for the axes that the seam leaves free.
  function footing(point, width, height) {
    const corners = [[34, height - 34], [34, 34], [width - 34, 34]];
    const near = corners.map(([u, v]) => {
      let count = 0;
      for (const run of data.runs) {
        for (let i = 0; i < run.path.length / 3; i++) {
          const [x, y] = point(...at(run, i));
          if (Math.abs(x - u) < 40 && Math.abs(y - v) < 40) count++;
        }
      }
      return count;
    });
    return corners[near.indexOf(Math.min(...near))];
  }

  function drawAxes(pen, direction, foot) {
    pen.lineWidth = 1.2;
    pen.fillStyle = pen.strokeStyle = style('--soft');
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    [['x', 1, 0, 0], ['y', 0, 1, 0], ['z', 0, 0, 1]].forEach(([name, ...axis]) => {
      const [u, v] = direction(...axis);
      if (Math.hypot(u, v) < 0.15) return;
      lined(pen, foot, [foot[0] + 18 * u, foot[1] + 18 * v]);
      pen.fillText(name, foot[0] + 25 * u, foot[1] + 25 * v);
    });
  }

  function drawRuler(pen, scale, width, height) {
    const wanted = 0.25 * width / scale;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const length = power * [5, 2, 1].find((k) => k * power <= wanted);
    const end = width - 14, start = end - length * scale, y = height - 14;
    pen.strokeStyle = pen.fillStyle = style('--soft');
    pen.lineWidth = 1.2;
    lined(pen, [start, y - 4], [start, y], [end, y], [end, y - 4]);
    pen.textAlign = 'right';
    pen.textBaseline = 'bottom';
    pen.fillText(length >= 1e4 ? `${length / 1e3} mm` : `${length} µm`, end, y - 5);
  }

  function drawLegend() {
    const { pen, width, height } = sized(document.getElementById('legend'));
    for (let x = 0; x < width; x++) {
      pen.fillStyle = colour(x / width);
      pen.fillRect(x, 2, 1.5, 10);
    }
    pen.fillStyle = style('--soft');
    pen.textBaseline = 'bottom';
    ['left', 'center', 'right'].forEach((side, k) => {
      pen.textAlign = side;
      const value = (k * data.top / 2000).toPrecision(2);
      const text = k ? (k === 2 ? `≥ ${Number(value)} mm` : `${Number(value)}`) : '0';
      pen.fillText(text, k * width / 2, height - 4);
    });
  }

  function redraw() {
    canvases.forEach(draw);
    drawLegend();
    document.querySelectorAll('.times').forEach((item) => { item.textContent = `${view.stretch} ×`; });
  }

  let waiting = false;
  function later() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; redraw(); });
  }

  function turned(u, v) {
    view.turn -= 0.01 * u;
    view.tilt = Math.min(Math.max(view.tilt + 0.01 * v, -Math.PI / 2), Math.PI / 2);
    later();
  }

  function zoomed(factor) {
    view.zoom = Math.min(Math.max(view.zoom * factor, 0.2), 60);
    later();
  }

  function listen(canvas) {
    const fingers = new Map();
    const spread = () => {
      const [a, b] = [...fingers.values()];
      return Math.hypot(a[0] - b[0], a[1] - b[1]);
    };
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      canvas.focus({ preventScroll: true });
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    canvas.addEventListener('pointermove', (event) => {
      const last = fingers.get(event.pointerId);
      if (!last) { hovered(canvas, event); return; }
      const before = fingers.size === 2 ? spread() : 0;
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      if (fingers.size === 1) turned(event.clientX - last[0], event.clientY - last[1]);
      else if (before > 0) zoomed(spread() / before);
    });
    for (const end of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
    }
    canvas.addEventListener('wheel', (event) => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      zoomed(Math.exp(-0.001 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener('keydown', (event) => {
      const step = { ArrowLeft: [-10, 0], ArrowRight: [10, 0], ArrowUp: [0, -10], ArrowDown: [0, 10] }[event.key];
      if (step) turned(...step);
      else if (event.key === '+' || event.key === '-') zoomed(event.key === '+' ? 1.2 : 1 / 1.2);
      else return;
      event.preventDefault();
    });
  }

  function controls() {
    document.querySelectorAll('button[data-view]').forEach((button) => {
      button.addEventListener('click', () => {
        look(button.dataset.view);
        later();
      });
    });
    const slider = document.getElementById('stretch'), most = Math.log10(data.stretch * 10);
    slider.value = String(Math.log10(data.stretch) / most);
    slider.addEventListener('input', () => {
      view.stretch = Number((10 ** (most * Number(slider.value))).toPrecision(1));
      later();
    });
  }

  look('angled');
  canvases.forEach(listen);
  controls();
  redraw();
  new ResizeObserver(later).observe(document.querySelector('.panels'));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', later);
  document.addEventListener('switched', later);
  document.addEventListener('looked', (event) => { view.looked = event.detail; later(); });
  document.addEventListener('keydown', (event) => { if (event.key === 'Escape') document.activeElement.blur(); });
  window.addEventListener('beforeprint', redraw);
  window.addEventListener('afterprint', later);
})();
