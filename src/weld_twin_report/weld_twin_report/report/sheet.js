// Copyright 2026 weld_twin contributors
// SPDX-License-Identifier: Apache-2.0
// What the parts of the sheet share: which causes are thought mended, what that leaves, which
// instant is looked at, and whether it passes. Parts listen to 'switched' and 'instant'.
'use strict';
window.sheet = (() => {
  const data = JSON.parse(document.getElementById('data').textContent);
  const mended = data.switches.map(() => true);
  const all = (selector) => [...document.querySelectorAll(selector)];
  const put = (id, text) => { const item = document.getElementById(id); if (item) item.textContent = text; };
  const mm = (value) => `${value.toFixed(Math.abs(value) >= 10 ? 2 : 3)} mm`;
  for (const run of data.runs) {
    run.before = run.before || summed(run, () => true);
    run.now = run.left;
    run.size = { before: sizes(run.before), now: sizes(run.now) };
  }

  // The deviation of a run with the parts that are there, in um, x y z after each other.
  function summed(run, there) {
    const out = run.left.slice();
    run.parts.forEach((part, k) => {
      if (there(k)) part.forEach((value, i) => { out[i] += value; });
    });
    return out;
  }

  function sizes(flat) {
    const out = [];
    for (let i = 0; i < flat.length; i += 3) out.push(Math.hypot(flat[i], flat[i + 1], flat[i + 2]) / 1e3);
    return out;
  }

  // RMS in mm over all samples, not only those on the page.
  function rms(there) {
    const on = [1, ...data.switches.map((_, k) => (there(k) ? 1 : 0))];
    let sum = 0;
    data.squares.forEach((row, i) => row.forEach((value, j) => { sum += on[i] * on[j] * value; }));
    return Math.sqrt(Math.max(sum, 0));
  }

  // What the page was written with where it has it: it has all samples, not only those drawn.
  function most() {
    const told = data.most[mended.map(Number).join('')];
    return told ?? Math.max(0, ...data.runs.flatMap((run) => run.size.now));
  }

  function judged(largest) {
    const { tolerance, below, above, words } = data.rule;
    if (tolerance == null) return ['None', words.None];
    if (largest + below <= tolerance) return ['pass', words.pass];
    if (largest - above > tolerance) return ['fail', words.fail];
    return ['open', words.open];
  }

  // Where a verdict is open: up to where it would pass, and from where it would fail.
  function limits(kind) {
    const { tolerance, below, above } = data.rule;
    if (kind !== 'open') return '';
    const passes = tolerance > below ? `passes up to ${mm(tolerance - below)}` : 'nothing passes';
    return ` (${passes}, fails above ${mm(tolerance + above)})`;
  }

  // Millimetres as they are written in any language, 0.3 or 0,3; null where it is nothing of the kind.
  function read(text) {
    const told = /^(\d+(?:[.,]\d*)?|[.,]\d+)(?:\s*mm)?$/.exec(text.trim());
    const value = told ? Number(told[1].replace(',', '.')) : NaN;
    return value > 0 ? value : null;
  }

  function asked(field) {
    const empty = field.value.trim() === '', unread = !empty && read(field.value) == null;
    data.rule.tolerance = empty ? null : read(field.value);
    document.getElementById('unread').hidden = !unread;
    field.setAttribute('aria-invalid', String(unread));
    accept();
  }

  function accept() {
    const now = document.getElementById('now-verdict');
    if (now) now.dataset.size = most();
    for (const item of all('[data-size]')) {
      const [kind, word] = judged(Number(item.dataset.size));
      const before = item.dataset.before;
      item.className = `mark ${kind}`;
      item.textContent = before && data.rule.tolerance == null ? '' : `${before}${word}`;
    }
    const remedy = document.getElementById('remedy');
    if (remedy) remedy.hidden = !all('#acceptance [data-size]').some((item) => item.classList.contains('open'));
    for (const item of all('[data-top]')) {
      const size = Number(item.dataset.top), [kind, word] = judged(size), { tolerance } = data.rule;
      item.className = `status judged ${kind}`;
      item.hidden = tolerance == null;
      if (tolerance == null) continue;
      const told = `${word}: ${mm(size)} of ${mm(tolerance)} allowed${limits(kind)}, ${item.dataset.where}`;
      item.textContent = told[0].toUpperCase() + told.slice(1);
    }
  }

  function switched() {
    const there = (k) => !mended[k];
    for (const run of data.runs) {
      if (run.parts.length) run.now = summed(run, there);
      run.size.now = sizes(run.now);
    }
    for (const box of all('input[data-switch]')) box.checked = mended[Number(box.dataset.switch)];
    const now = rms(there), before = rms(() => true);
    const share = 100 * now / Math.max(before, 1e-12);
    put('now-rms', mm(now));
    put('now-max', mm(most()));
    put('now-share', `${share.toFixed(share < 10 ? 1 : 0)} %`);
    for (const figure of all('#seam figure.chart')) {
      const run = data.runs[Number(figure.dataset.key.replace('run', ''))];
      window.charts.update(figure, { 'with that mended': run.size.now });
    }
    accept();
    document.dispatchEvent(new CustomEvent('switched'));
  }

  function instant(event) {
    const { key, x } = event.detail, k = Number(key.replace('run', ''));
    const run = data.runs[k];
    if (!run) return;
    let i = 0;
    run.t.forEach((t, j) => { if (Math.abs(t - x) < Math.abs(run.t[i] - x)) i = j; });
    const where = run.dots ? `station ${run.t[i]}` : `${run.t[i].toFixed(2)} s`;
    put('instant', `${run.name}, ${where}: ${mm(run.size.before[i])} as it is, ${mm(run.size.now[i])} then`);
    for (const cell of all('td[data-joint]')) {
      const q = run.joints[Number(cell.dataset.joint)];
      cell.textContent = q ? `${q[i].toFixed(1)} ${cell.dataset.unit}` : '';
    }
    for (const item of all('.strip li')) {
      const { run: own, from, to } = item.dataset;
      const time = run.dots ? i : run.t[i];
      item.classList.toggle('here', !run.dots && Number(own) === k && time >= Number(from) && time <= Number(to));
    }
    document.dispatchEvent(new CustomEvent('looked', { detail: { run: k, sample: i } }));
  }

  function listen() {
    for (const box of all('input[data-switch]')) {
      box.addEventListener('change', () => {
        mended[Number(box.dataset.switch)] = box.checked;
        switched();
      });
    }
    for (const button of all('button[data-all]')) {
      button.addEventListener('click', () => {
        mended.fill(button.dataset.all === 'on');
        switched();
      });
    }
    const field = document.getElementById('tolerance');
    if (field) {
      field.addEventListener('input', () => asked(field));
      // A browser keeps what was typed when the page is loaded again.
      asked(field);
    }
    document.addEventListener('instant', instant);
    window.addEventListener('beforeprint', () => {
      all('details').forEach((item) => { item.open = true; });
      put('printed-at', `; printed ${new Date().toISOString().slice(0, 16).replace('T', ' ')} UTC`);
    });
  }

  // Begins where it is worst, so that nothing is empty before somebody points.
  function worst() {
    let best = { size: -1 };
    data.runs.forEach((run, k) => run.size.before.forEach((size, i) => {
      if (size > best.size) best = { size, key: `run${k}`, x: run.t[i] };
    }));
    if (best.key) document.dispatchEvent(new CustomEvent('instant', { detail: best }));
  }

  if (data.runs.length === 0) return { data };
  document.documentElement.classList.add('live');
  listen();
  switched();
  // Not before the scripts that follow this one listen.
  document.addEventListener('DOMContentLoaded', worst);
  return { data };
})();
